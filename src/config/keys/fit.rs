//! Keys of how to fit, and of the truth.

use super::Kind::{Choice, Count, Map, Number, Text};
use super::{Group, Key};
use crate::config::spec::{FitMethod, Gradient, InitialName};

pub static FIT: Group = Group {
    name: "fit",
    text: "How to fit.",
    keys: &[
        Key::new("method", Choice(FitMethod::NAMES), "Solver.", "lbfgs").default("gauss-newton"),
        Key::new(
            "initial",
            Choice(InitialName::NAMES),
            "Where the fit starts.",
            "data",
        )
        .default("functions"),
        Key::new(
            "gradient",
            Choice(Gradient::NAMES),
            "Which gradient the solver follows.",
            "continuous",
        )
        .default("discrete"),
        Key::new(
            "memory",
            Count,
            "Pairs of steps that L-BFGS remembers.",
            "20",
        )
        .default("20"),
        Key::new(
            "stop",
            Map(&STOP),
            "When to stop; whichever comes first.",
            "{iterations: 200, cost_ratio: 1e-4}",
        )
        .default("{iterations: 1000, tolerance: 1e-10}"),
    ],
};

static STOP: Group = Group {
    name: "stop",
    text: "When to stop; whichever comes first.",
    keys: &[
        Key::new(
            "iterations",
            Count,
            "After so many iterations; exactly so many if nothing else is asked for.",
            "200",
        )
        .default("1000"),
        Key::new(
            "cost_ratio",
            Number,
            "Converged when J/J0 is at most this (and so is the gradient, if asked for).",
            "1e-4",
        )
        .unit("part of the first J"),
        Key::new(
            "gradient_ratio",
            Number,
            "Converged when the squared norm of the gradient is at most this part of its first value.",
            "1e-4",
        )
        .unit("part of the first G^2"),
        Key::new(
            "tolerance",
            Number,
            "Converged when an iteration changes J and the functions by less than this part.",
            "1e-10",
        )
        .default("1e-10, if no other rule is given"),
        Key::new(
            "step",
            Number,
            "Converged when an iteration changes no function by more than this part of its size.",
            "1e-12",
        ),
        Key::new("seconds", Number, "Wall-clock limit.", "60").unit("s"),
    ],
};

pub static TRUTH: Group = Group {
    name: "truth",
    text: "The true functions, for reports only.",
    keys: &[
        Key::new(
            "data",
            Text,
            "File of the true functions with times in `t_s`, relative to the model file.",
            "truth.csv",
        )
        .required(),
        Key::new(
            "columns",
            Map(&TRUTH_COLUMNS),
            "Names of its columns.",
            "{mass: m}",
        )
        .default("mass_kg, damping_N_s_per_m, stiffness_N_per_m, …"),
    ],
};

const fn column(name: &'static str, text: &'static str, unit: &'static str) -> Key {
    Key::new(name, Text, text, "my_column").unit(unit)
}

static TRUTH_COLUMNS: Group = Group {
    name: "truth_columns",
    text: "Names of the columns of the true functions.",
    keys: &[
        column("mass", "Column of the mass.", "kg").default("mass_kg"),
        column("damping", "Column of the damping.", "N s/m").default("damping_N_s_per_m"),
        column("stiffness", "Column of the stiffness.", "N/m").default("stiffness_N_per_m"),
        column("cubic_stiffness", "Column of the cubic stiffness.", "N/m^3"),
        column(
            "quadratic_damping",
            "Column of the quadratic damping.",
            "N s^2/m^2",
        ),
        column("coulomb_friction", "Column of the Coulomb friction.", "N"),
        column("offset", "Column of the offset.", "N"),
    ],
};
