//! What a user states: the types of a model file, with the documentation of every key on its field.
//!
//! YAML and JSON are read into them by serde, Rust programs write them, the Python package lowers its classes to them; the schema of
//! schemars has the documentation for `kmcfit explain` and for editors. A new key is a new field; an optional one is an `Option`. Beside
//! the meaning of a key stand an `example`, and where it has them its `unit`, `default`, `range`, and the keys it `needs`. Conditions that
//! concern several keys are checked where the model is lowered to a problem.

mod by_coefficient;
mod experiment;
mod functions;
mod input;
mod noise;
mod sensors;
mod study;
mod values;

pub use by_coefficient::{ByCoefficient, CoefficientMap, Own, Shared, TruthColumns};
pub use experiment::*;
pub use functions::*;
pub use input::*;
pub use noise::*;
pub use sensors::*;
pub use study::*;
pub use values::*;

use crate::constraints::Shape;
use crate::functions::CoefficientKind;
use crate::objective::GradientKind;
use crate::solvers::{Initial, QpSolver};
use crate::system::Method;
use schemars::JsonSchema;
use serde::Deserialize;

/// A model: records of one system, its coefficient functions, and the settings of the fit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "model", extend("expecting" = "a map with the keys format, experiments, functions, fit, …"))]
pub struct ModelSpec {
    /// Version of the file format.
    #[schemars(extend("example" = "1"))]
    pub format: FormatVersion,
    /// Title for reports.
    #[schemars(extend("example" = "A decaying mass", "default" = "file name"))]
    pub title: Option<String>,
    /// Records of one system on a common time axis, measured or to be simulated.
    #[schemars(extend("example" = "[{initial: {displacement: 3.3, velocity: 1.0}}]"))]
    pub experiments: Vec<ExperimentSpec>,
    /// Time grid and stepper.
    #[schemars(extend("example" = "{nodes: 2000, method: midpoint}", "default" = "one node per sample, rk4"))]
    pub grid: Option<GridSpec>,
    /// Coefficient functions of the equation of motion.
    #[schemars(extend(
        "example" = "{mass: {fixed: 1.0}, damping: {basis: constant, start: 0.0}, stiffness: {basis: constant, start: 1.0}}"
    ))]
    pub functions: ByCoefficient<Shared>,
    /// Constraints on the functions beyond their own `min` and `max`; one map for each.
    #[schemars(extend("example" = "[{function: mass, shape: non-increasing}]", "default" = "none"))]
    pub constraints: Option<Vec<ConstraintSpec>>,
    /// Method, start and stopping tests of the fit.
    #[schemars(extend(
        "example" = "{method: gauss-newton, initial: data}",
        "default" = "Gauss-Newton from the start values"
    ))]
    pub fit: Option<FitSpec>,
    /// True functions, for reports only.
    #[schemars(extend("example" = "{data: truth.csv}", "default" = "unknown"))]
    pub truth: Option<TruthSpec>,
    /// Initial states for which the free response is predicted.
    #[schemars(extend("example" = "[{displacement: -3.3, velocity: 1.0}]", "default" = "none"))]
    pub predict: Option<Vec<StateSpec>>,
    /// Analyses of `kmcfit study`.
    #[schemars(extend("example" = "{starts: 20, seed: 1}"))]
    pub study: Option<StudySpec>,
}

/// Displacement and velocity at one time.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "state", extend("expecting" = "a map such as {displacement: 3.3, velocity: 1.0}"))]
pub struct StateSpec {
    /// Displacement.
    #[schemars(extend("example" = "3.3", "unit" = "m"))]
    pub displacement: f64,
    /// Velocity.
    #[schemars(extend("example" = "1.0", "unit" = "m/s"))]
    pub velocity: f64,
}

/// Time grid and stepper.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "grid", extend("expecting" = "a map such as {nodes: 2000, method: midpoint}"))]
pub struct GridSpec {
    /// Number of nodes, with the step duration/(nodes - 1); `auto` chooses it from the spectrum of the records, and a fit
    /// refines it until the discretisation error is below a tenth of the standard errors.
    #[schemars(extend(
        "example" = "2000",
        "default" = "auto with `sigma` and no `method`, for gauss-newton and projected-gradient; otherwise one per sample",
        "range" = "3 to 1e8"
    ))]
    pub nodes: Option<Nodes>,
    /// Time integration method.
    #[schemars(extend("example" = "midpoint", "default" = "rk4"))]
    pub method: Option<Method>,
    /// Length of the time axis.
    #[schemars(extend(
        "example" = "25.0",
        "unit" = "s",
        "default" = "that of the records",
        "range" = "greater than 0",
        "needs" = "a grid without records; with records their span is used"
    ))]
    pub duration: Option<f64>,
}

/// A constraint on coefficient functions.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "constraint", extend("expecting" = "a map such as {function: mass, shape: non-increasing}"))]
pub struct ConstraintSpec {
    /// Constrained function.
    #[schemars(extend("example" = "mass", "needs" = "one of min, max, slope, shape, at, mean and integral"))]
    pub function: Option<CoefficientKind>,
    /// Lower bound at all times.
    #[schemars(extend(
        "example" = "0.05",
        "unit" = "that of the function",
        "range" = "at most `max`",
        "needs" = "`function`"
    ))]
    pub min: Option<NumberOrColumn>,
    /// Upper bound at all times.
    #[schemars(extend(
        "example" = "10.0",
        "unit" = "that of the function",
        "range" = "at least `min`",
        "needs" = "`function`"
    ))]
    pub max: Option<NumberOrColumn>,
    /// Lower and upper bound of the slope.
    #[schemars(extend(
        "example" = "{min: -0.2, max: 0.0}",
        "unit" = "that of the function per s",
        "range" = "min at most max",
        "needs" = "`function`"
    ))]
    pub slope: Option<RangeSpec>,
    /// Monotonicity or sign of the curvature; or a list of both.
    #[schemars(extend("example" = "non-increasing", "needs" = "`function`"))]
    pub shape: Option<OneOrList<Shape>>,
    /// Times at which the value is prescribed.
    #[schemars(extend("example" = "0.0", "unit" = "s", "range" = "within the record", "needs" = "`function`, `value`"))]
    pub at: Option<OneOrList<f64>>,
    /// Prescribed values, one for all times or one each.
    #[schemars(extend("example" = "1.0", "unit" = "that of the function", "needs" = "`function`, `at`"))]
    pub value: Option<OneOrList<f64>>,
    /// Mean over the record.
    #[schemars(extend("example" = "0.75", "unit" = "that of the function", "needs" = "`function`"))]
    pub mean: Option<f64>,
    /// Integral over the record.
    #[schemars(extend("example" = "18.75", "unit" = "that of the function times s", "needs" = "`function`"))]
    pub integral: Option<f64>,
    /// Two functions; the first equals `ratio` times the second.
    #[schemars(extend("example" = "[damping, stiffness]", "range" = "two functions"))]
    pub equal: Option<Vec<CoefficientKind>>,
    /// Ratio of the two functions of `equal`.
    #[schemars(extend("example" = "0.1", "default" = "1", "range" = "not 0", "needs" = "`equal`"))]
    pub ratio: Option<f64>,
    /// Passivity, c - m'/2 >= 0 and k' <= 0: the stored energy never grows.
    #[schemars(extend("example" = "true"))]
    pub passive: Option<bool>,
    /// Bounds of the natural frequency sqrt(k/m)/2π at every time.
    #[schemars(extend("example" = "{min: 0.1, max: 0.3}", "unit" = "Hz", "range" = "greater than 0"))]
    pub frequency: Option<RangeSpec>,
    /// Upper bound of the damping ratio |c|/(2 sqrt(k m)).
    #[schemars(extend("example" = "{max: 0.2}", "range" = "`max` alone, greater than 0"))]
    pub damping_ratio: Option<RangeSpec>,
    /// Soft constraint: weight of the mean squared violation in J.
    #[schemars(extend(
        "example" = "10.0",
        "default" = "hard constraint",
        "range" = "greater than 0",
        "needs" = "a constraint other than damping_ratio"
    ))]
    pub soft: Option<f64>,
}

/// A range; either end may be left out.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "range", extend("expecting" = "a map such as {min: 0.1, max: 0.5}"))]
pub struct RangeSpec {
    /// Lower end.
    #[schemars(extend("example" = "0.1", "default" = "unbounded", "range" = "at most `max`"))]
    pub min: Option<f64>,
    /// Upper end.
    #[schemars(extend("example" = "0.5", "default" = "unbounded", "range" = "at least `min`"))]
    pub max: Option<f64>,
}

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
    /// Test of the bases at the optimum against finer ones: twice as many knots, two halves for a constant.
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

/// True functions, for reports only.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "truth", extend("expecting" = "a map such as {data: truth.csv}"))]
pub struct TruthSpec {
    /// Table of the true functions with times in `t_s`, relative to the model file.
    #[schemars(extend("example" = "truth.csv"))]
    pub data: String,
    /// Names of its columns.
    #[schemars(extend("example" = "{mass: m}", "default" = "mass_kg, damping_N_s_per_m, stiffness_N_per_m, …"))]
    pub columns: Option<ByCoefficient<TruthColumns>>,
}
