//! Entries of the result document on the fit from each starting point, the path of penalty weights, and each roughness
//! penalty.

use kmcfit_core::solvers::Status;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A fit from one starting point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptSummary {
    /// Name of the start strategy.
    pub start: String,
    /// J at the starting point: m² s without sigma, chi-square with sigma, N² s for the equation error (see
    /// [`cost_kind`](super::ModelSummary::cost_kind)); absent if not finite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_cost: Option<f64>,
    /// J at the end, in the same unit; absent if not finite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// Number of iterations.
    pub iterations: u64,
    /// Status at the end.
    pub status: Status,
}

/// Choice of the weight of a penalty by a rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeightSummary {
    /// Name of the rule that the model file sets.
    pub rule: String,
    /// Weight used for the fit.
    pub weight: f64,
    /// Weight chosen on the path by each rule, keyed by rule name (`discrepancy`, `l-curve`, `gcv`; `bic` on a path of total
    /// variation); rules that choose none are omitted.
    pub picks: BTreeMap<String, f64>,
    /// Seed of the random probe vectors used to estimate the effective degrees of freedom.
    pub seed: u64,
    /// Remark on the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remark: Option<String>,
    /// Fits along the path, in order of decreasing weight.
    pub path: Vec<PathPointSummary>,
}

/// One fit along the path of weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PathPointSummary {
    /// Weight: factor on the penalties of the path.
    pub weight: f64,
    /// Iterations of this fit, summed over its starting points.
    #[serde(default)]
    pub iterations: u64,
    /// Misfit: part of J from the samples.
    pub misfit: f64,
    /// Unweighted penalty `|L theta - target|^2` with `L` the roughness rows (for target 0 the integral of the squared
    /// derivative), summed over the penalties on the path; on a path of total variation that variation.
    pub roughness: f64,
    /// Effective number of parameters that the data determine; absent if not finite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Bayesian information criterion, on a path of total variation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bic: Option<f64>,
}

/// A penalty on the roughness of a function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PenaltySummary {
    /// Name of the function.
    pub function: String,
    /// Order of the penalised derivative.
    pub order: usize,
    /// Weight in J of `|L theta - target|^2`.
    pub weight: f64,
    /// Name of the rule that chose the weight; absent if the weight is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<String>,
    /// Number of parameters of the function.
    pub parameters: usize,
    /// Effective number of the function's parameters that the samples determine; absent if not computed, e.g. with more than
    /// 64 parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effective_parameters: Option<f64>,
}
