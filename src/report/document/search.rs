//! The way of a fit to its optimum: attempts from several starting points, the path of a weight.

use kmcfit_core::internals::solvers::Status;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One attempt of the start ladder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptSummary {
    /// Where it started.
    pub start: String,
    /// J at its start; absent if the start had no motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_cost: Option<f64>,
    /// J at its end; absent if the start had no motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// Iterations it took.
    pub iterations: u64,
    /// How it ended.
    pub status: Status,
}

/// How the weight of the smoothness was chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeightSummary {
    /// The rule asked for.
    pub rule: String,
    /// The weight used.
    pub weight: f64,
    /// What each rule picks on the path; absent where it picks none.
    pub picks: BTreeMap<String, f64>,
    /// Seed of the random vectors behind the degrees of freedom.
    pub seed: u64,
    /// What the user should know about the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remark: Option<String>,
    /// The fits along the path, by falling weight.
    pub path: Vec<PathSummary>,
}

impl WeightSummary {
    /// Iterations of all fits along the path.
    pub fn iterations(&self) -> u64 {
        self.path.iter().map(|point| point.iterations).sum()
    }
}

/// One fit along the path of weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PathSummary {
    /// Weight.
    pub weight: f64,
    /// Iterations of this fit, all its starts together.
    #[serde(default)]
    pub iterations: u64,
    /// Misfit of the readings.
    pub misfit: f64,
    /// `sum |L theta - target|^2` of the penalties on the path.
    pub roughness: f64,
    /// Effective number of parameters that the data determine; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
}
