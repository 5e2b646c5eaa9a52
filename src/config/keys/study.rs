//! Keys of a study.

use super::Kind::{Bool, Choice, Count, List, Map, Number, Text};
use super::experiment::{FORCE, STATE};
use super::{Group, Key, NUMBER_OR_COLUMN, NUMBERS};
use crate::config::spec::{ChannelName, FunctionName, NoiseName};

pub static STUDY: Group = Group {
    name: "study",
    text: "What `kmcfit study` looks into besides what it always does.",
    keys: &[
        Key::new(
            "confidence",
            Number,
            "Confidence of drawn bands, profiles, tubes and refits.",
            "0.95",
        )
        .default("0.95"),
        Key::new("seed", Count, "Seed of everything random.", "1").default("1"),
        Key::new(
            "profiles",
            List(&Map(&PROFILE)),
            "Numbers whose profile is drawn: the least cost with the number held.",
            "[{function: mass, at: 0.0}]",
        )
        .default("none"),
        Key::new(
            "tubes",
            NUMBERS,
            "Times at which the extreme devices are sought.",
            "[0.0, 12.5, 25.0]",
        )
        .unit("s")
        .default("five over the record"),
        Key::new(
            "level",
            Number,
            "Largest J of a device in the tubes.",
            "2010.0",
        )
        .unit("that of J")
        .default("what the confidence allows"),
        Key::new("starts", Count, "Fits from scattered starts.", "20").default("none"),
        Key::new(
            "spread",
            Number,
            "The starts lie within this factor of the start values.",
            "3.0",
        )
        .default("3"),
        Key::new(
            "same",
            Number,
            "Optima whose k/m, c/m and motions agree to this are one.",
            "1e-3",
        )
        .default("1e-3"),
        Key::new("bootstrap", Count, "Refits to simulated readings.", "200").default("none"),
        Key::new(
            "noise",
            Choice(NoiseName::NAMES),
            "Where the noise of the refits comes from.",
            "residual",
        )
        .default("parametric"),
        Key::new(
            "equivalents",
            List(&Map(&EQUIVALENT)),
            "Masses for which devices with the same motion are sought.",
            "[{name: constant mass, mass: 1.0}]",
        )
        .default("masses that grow, fall and swing away from the fit's"),
        Key::new(
            "varies",
            Bool,
            "Whether each function is held against a constant.",
            "true",
        )
        .default("false"),
        Key::new(
            "candidates",
            List(&Map(&CANDIDATE)),
            "Experiments that might be made next.",
            "[{name: again, initial: {displacement: 3.3, velocity: 1.0}}]",
        )
        .default("none"),
    ],
};

static PROFILE: Group = Group {
    name: "profile",
    text: "A number: a function's value at a time, its mean, a constant, or a scalar.",
    keys: &[
        Key::new(
            "function",
            Choice(FunctionName::NAMES),
            "Which function.",
            "mass",
        ),
        Key::new("at", Number, "At which time.", "0.0").unit("s"),
        Key::new("mean", Bool, "Its mean in place of a value.", "true"),
        Key::new(
            "scalar",
            Text,
            "An estimated number, as the report calls it, in place of a function.",
            "initial velocity",
        ),
    ],
};

static EQUIVALENT: Group = Group {
    name: "equivalent",
    text: "A device to be sought with the motion of the fit.",
    keys: &[
        Key::new("name", Text, "What the report calls it.", "constant mass").required(),
        Key::new("mass", NUMBER_OR_COLUMN, "Its mass.", "1.0")
            .unit("kg")
            .required(),
        Key::new(
            "damping",
            NUMBER_OR_COLUMN,
            "The damping that it should be near to.",
            "0.0",
        )
        .unit("N s/m")
        .default("that of the fit"),
    ],
};

static CANDIDATE: Group = Group {
    name: "candidate",
    text: "An experiment that might be made.",
    keys: &[
        Key::new("name", Text, "What the report calls it.", "a blow").required(),
        Key::new(
            "initial",
            Map(&STATE),
            "State at its beginning.",
            "{displacement: 0.0, velocity: 3.0}",
        )
        .required(),
        Key::new(
            "force",
            Map(&FORCE),
            "Force on the mass, as a shape.",
            "{shape: sine, amplitude: 1.0, frequency: 0.2}",
        )
        .default("none"),
        Key::new(
            "channel",
            Choice(ChannelName::NAMES),
            "What is measured, at every node.",
            "acceleration",
        )
        .default("displacement"),
        Key::new("sigma", Number, "Standard deviation of a reading.", "0.1")
            .unit("SI unit of the channel")
            .default("that of the first channel of the model"),
    ],
};
