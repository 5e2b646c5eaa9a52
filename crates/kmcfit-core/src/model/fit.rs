//! Settings of the fit.

use super::values::words;
use crate::objective::GradientKind;
use crate::solvers::{Initial, QpSolver};
use schemars::JsonSchema;
use serde::Deserialize;

/// Method, start and stopping tests of the fit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "fit", extend("expecting" = "a map such as {method: gauss-newton, initial: data}"))]
pub struct FitSpec {
    /// Fit method.
    #[schemars(extend(
        "example" = "lbfgs",
        "default" = "gauss-newton",
        "needs" = "bounds and constraints: gauss-newton, projected-gradient or equation-error; total variation and rules for a weight: gauss-newton or equation-error"
    ))]
    pub method: Option<FitMethod>,
    /// Starting point.
    #[schemars(extend("example" = "data", "default" = "functions", "needs" = "a method other than equation-error"))]
    pub initial: Option<Initial>,
    /// Gradient of the cost.
    #[schemars(extend(
        "example" = "continuous",
        "default" = "discrete",
        "needs" = "a method other than equation-error; continuous: no `sigma` and a sample at every node"
    ))]
    pub gradient: Option<GradientKind>,
    /// Solver of the quadratic programs of constrained steps (gauss-newton and projected-gradient).
    #[schemars(extend(
        "example" = "clarabel",
        "default" = "auto",
        "needs" = "method gauss-newton or projected-gradient"
    ))]
    pub qp: Option<QpSolver>,
    /// Judgement of what the model lacks: candidates, each the model with one thing more.
    #[schemars(extend(
        "example" = "false",
        "default" = "true",
        "needs" = "`sigma` in every experiment; a method other than equation-error"
    ))]
    pub refinement: Option<bool>,
    /// Number of step pairs that L-BFGS stores.
    #[schemars(extend("example" = "20", "default" = "20", "range" = "1 or more", "needs" = "`method: lbfgs`"))]
    pub memory: Option<usize>,
    /// Stopping tests; the first one met ends the fit.
    #[schemars(extend(
        "example" = "{iterations: 200, cost_ratio: 1e-4}",
        "default" = "{iterations: 1000, tolerance: 1e-10}",
        "needs" = "a method other than equation-error"
    ))]
    pub stop: Option<StopSpec>,
}

words! {
    /// Fit method.
    pub enum FitMethod {
        /// Steepest descent.
        SteepestDescent = "steepest-descent",
        /// Limited-memory BFGS.
        Lbfgs = "lbfgs",
        /// Projected gradient, with constraints.
        ProjectedGradient = "projected-gradient",
        /// Gauss-Newton, with constraints.
        GaussNewton = "gauss-newton",
        /// Minimum of the equation error, with constraints; no response is simulated.
        EquationError = "equation-error",
    }
}

/// Stopping tests; the first one met ends the fit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "stop", extend("expecting" = "a map such as {iterations: 1000, cost_ratio: 1e-4}"))]
pub struct StopSpec {
    /// Iteration limit; without another test exactly this number of iterations.
    #[schemars(extend("example" = "200", "default" = "1000"))]
    pub iterations: Option<usize>,
    /// Limit of J/J0 for convergence (with the gradient's limit, if given).
    #[schemars(extend("example" = "1e-4", "unit" = "part of the first J", "range" = "greater than 0"))]
    pub cost_ratio: Option<f64>,
    /// Limit of the squared gradient norm relative to its initial value, for convergence.
    #[schemars(extend("example" = "1e-4", "unit" = "part of the first G^2", "range" = "greater than 0"))]
    pub gradient_ratio: Option<f64>,
    /// Relative change of J and of the functions in one iteration, for convergence.
    #[schemars(extend("example" = "1e-10", "default" = "1e-10, if no other rule is given", "range" = "greater than 0"))]
    pub tolerance: Option<f64>,
    /// Relative change of the functions in one iteration, for convergence.
    #[schemars(extend("example" = "1e-12", "range" = "greater than 0"))]
    pub step: Option<f64>,
    /// Time limit.
    #[schemars(extend("example" = "60", "unit" = "s", "range" = "greater than 0"))]
    pub seconds: Option<f64>,
}
