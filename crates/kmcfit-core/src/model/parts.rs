//! Grid, constraints and true functions.

use super::{ByCoefficient, Nodes, NumberOrColumn, OneOrList, TruthColumns};
use crate::constraints::Shape;
use crate::functions::CoefficientKind;
use crate::system::Method;
use schemars::JsonSchema;
use serde::Deserialize;

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
