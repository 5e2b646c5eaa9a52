//! Keys of a whole model file, of its grid, and of a story.

use super::Kind::{AnyOf, Choice, Count, Format, List, Map, Number, Text, Word};
use super::experiment::{EXPERIMENT, STATE};
use super::fit::{FIT, TRUTH};
use super::function::{CONSTRAINT, FUNCTIONS};
use super::study::STUDY;
use super::{Group, Key};
use crate::config::spec::StepMethod;

/// A whole model file.
pub static MODEL: Group = Group {
    name: "model",
    text: "A model: records of one device, what is sought, and how.",
    keys: &[
        Key::new("format", Format, "Version of the file format.", "1").required(),
        Key::new("title", Text, "What reports call the run.", "A decaying mass")
            .default("the name of the file"),
        Key::new(
            "experiments",
            List(&Map(&EXPERIMENT)),
            "Measured (or to be simulated) motions of the same device, over the same time.",
            "[{initial: {displacement: 3.3, velocity: 1.0}}]",
        )
        .required(),
        Key::new(
            "grid",
            Map(&GRID),
            "Time nodes and stepper.",
            "{nodes: 2000, method: midpoint}",
        )
        .default("one node per reading, rk4"),
        Key::new(
            "functions",
            Map(&FUNCTIONS),
            "Mass, damping, stiffness and further terms over time.",
            "{mass: {fixed: 1.0}, damping: {basis: constant, start: 0.0}, stiffness: {basis: constant, start: 1.0}}",
        )
        .required(),
        Key::new(
            "constraints",
            List(&Map(&CONSTRAINT)),
            "What the functions must satisfy besides their own `min` and `max`; each map demands one thing.",
            "[{function: mass, shape: non-increasing}]",
        )
        .default("none"),
        Key::new(
            "fit",
            Map(&FIT),
            "How to fit.",
            "{method: gauss-newton, initial: data}",
        )
        .default("Gauss-Newton from the start values"),
        Key::new(
            "truth",
            Map(&TRUTH),
            "The true functions, where they are known; for reports only.",
            "{data: truth.csv}",
        )
        .default("unknown"),
        Key::new(
            "predict",
            List(&Map(&STATE)),
            "Other initial states to predict the motion from.",
            "[{displacement: -3.3, velocity: 1.0}]",
        )
        .default("none"),
        Key::new(
            "study",
            Map(&STUDY),
            "What `kmcfit study` looks into besides what it always does.",
            "{starts: 20, varies: true}",
        ),
    ],
};

/// A story.
pub static STORY: Group = Group {
    name: "story",
    text: "A story: models that `kmcfit study` runs in order and tells on one page.",
    keys: &[
        Key::new("format", Format, "Version of the file format.", "1").required(),
        Key::new(
            "title",
            Text,
            "What the page is called.",
            "From the paper to the device",
        )
        .default("the name of the file"),
        Key::new(
            "story",
            List(&Text),
            "Model files, in the order in which they are told; paths start from this file.",
            "[paper.yaml, paper-smooth.yaml]",
        )
        .required(),
    ],
};

static GRID: Group = Group {
    name: "grid",
    text: "Time nodes and stepper.",
    keys: &[
        Key::new(
            "nodes",
            AnyOf(&[Count, Word("auto")]),
            "Number of time nodes, the step is duration/(nodes - 1); or `auto`, from the frequencies in the readings.",
            "2000",
        )
        .default("one per reading"),
        Key::new(
            "method",
            Choice(StepMethod::NAMES),
            "How the motion is stepped through time.",
            "midpoint",
        )
        .default("rk4"),
        Key::new("duration", Number, "Length of the time axis.", "25.0")
            .unit("s")
            .default("that of the readings"),
    ],
};
