//! Attempts from several starting points, and the weight path, in the result document.

use kmcfit_core::internals::solvers::Status;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A fit from one starting point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptSummary {
    /// Starting point.
    pub start: String,
    /// J at its start; absent if the start has no response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_cost: Option<f64>,
    /// J at its end; absent if the start has no response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// Number of iterations.
    pub iterations: u64,
    /// Status at its end.
    pub status: Status,
}

/// Choice of the weight of a penalty by a rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeightSummary {
    /// The rule of the model file.
    pub rule: String,
    /// The weight used.
    pub weight: f64,
    /// Weight that each rule chooses on the path; absent for a rule without a choice.
    pub picks: BTreeMap<String, f64>,
    /// Seed of the random vectors behind the degrees of freedom.
    pub seed: u64,
    /// Remark on the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remark: Option<String>,
    /// Fits along the path, in order of decreasing weight.
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
    /// Iterations of this fit, summed over its starting points.
    #[serde(default)]
    pub iterations: u64,
    /// Misfit.
    pub misfit: f64,
    /// `sum |L theta - target|^2` of the penalties on the path.
    pub roughness: f64,
    /// Effective number of parameters that the data determine; absent if not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
}

/// A penalty on the roughness of a function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PenaltySummary {
    /// Name of the function.
    pub function: String,
    /// Order of the penalised derivative.
    pub order: usize,
    /// Weight of the squared integral in J.
    pub weight: f64,
    /// Rule that chose the weight; absent for a given one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<String>,
    /// Number of parameters of the function.
    pub parameters: usize,
    /// Effective number of these that the samples determine; absent with many parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effective_parameters: Option<f64>,
}
