//! Keys of the coefficient functions.

use super::{
    Bound, KnotSpec, KnownValue, NumberOrColumn, OneOrList, StartSpec, WeightChoice, words,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// A coefficient function: estimated, with a basis and start values, or fixed.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "function", extend("expecting" = "a map such as {basis: nodal, start: 2.0}"))]
pub struct FunctionSpec {
    /// Basis of an estimated function, which defines its parameters.
    #[schemars(extend("example" = "piecewise-linear", "needs" = "`start`"))]
    pub basis: Option<BasisName>,
    /// Knots of a piecewise function or spline: their number (equally spaced, ends included) or their times; `auto`: about
    /// 40 intervals and, where no penalty is given, one on the curvature with the weight `reml` (for equation-error
    /// `period`).
    #[schemars(extend(
        "example" = "11",
        "unit" = "s, of times",
        "range" = "2 or more, at most the number of nodes; times increase and include both ends of the record",
        "needs" = "`basis`: piecewise-constant, piecewise-linear or b-spline; `auto` also `sigma` in every experiment, or method equation-error"
    ))]
    pub knots: Option<KnotSpec>,
    /// Degree of a polynomial.
    #[schemars(extend("example" = "2", "needs" = "`basis: polynomial`"))]
    pub degree: Option<usize>,
    /// Start values: one number, one value per node, cell or knot, polynomial coefficients, or a column of a file. A mass,
    /// damping or stiffness without them starts from the record.
    #[schemars(extend(
        "example" = "2.0",
        "unit" = "that of the function",
        "default" = "for mass, damping and stiffness from the record",
        "range" = "greater than 0 for a mass",
        "needs" = "`basis`"
    ))]
    pub start: Option<StartSpec>,
    /// Fixed values, in place of `basis`; with a standard deviation, `{value: 4.5, sigma: 0.02}`, one that enters all
    /// intervals. `unknown` for a mass that nothing determines: all results are then ratios to it.
    #[schemars(extend(
        "example" = "1.0",
        "unit" = "that of the function",
        "range" = "greater than 0 for a mass",
        "needs" = "no `start`"
    ))]
    pub fixed: Option<KnownValue>,
    /// Known values added to the estimated function, as `fixed`. Start, bounds, penalties and constraints concern the
    /// estimated part. In `functions` of an experiment without other keys it is added to the shared function.
    #[schemars(extend(
        "example" = "1.4665",
        "unit" = "that of the function",
        "default" = "none",
        "range" = "greater than 0 for a mass",
        "needs" = "no `fixed`"
    ))]
    pub known_part: Option<KnownValue>,
    /// Lower bound. A mass has the default because a fit can otherwise end with a mass of nearly zero; `none` lifts it.
    #[schemars(extend(
        "example" = "0.05",
        "unit" = "that of the function",
        "default" = "for a mass with gauss-newton or projected-gradient 0.001 times its smallest start value, otherwise `none`",
        "range" = "at most `max`",
        "needs" = "`basis`; method gauss-newton, projected-gradient or equation-error"
    ))]
    pub min: Option<Bound>,
    /// Upper bound.
    #[schemars(extend(
        "example" = "10.0",
        "unit" = "that of the function",
        "default" = "`none`",
        "range" = "at least `min`",
        "needs" = "`basis`; method gauss-newton, projected-gradient or equation-error"
    ))]
    pub max: Option<Bound>,
    /// Penalty on the roughness, added to J; or a list of penalties.
    #[schemars(extend("example" = "{kind: tikhonov, order: 2, weight: 0.1}", "default" = "none", "needs" = "`basis`"))]
    pub penalty: Option<OneOrList<PenaltyKeys>>,
    /// Width of the law of the coefficient. Coulomb friction: velocity in m/s over which its sign is smoothed, well below the peak
    /// velocity of the response.
    #[schemars(extend(
        "example" = "0.01",
        "range" = "greater than 0",
        "needs" = "a coefficient whose law has a width, which requires it"
    ))]
    pub width: Option<f64>,
}

words! {
    /// Basis of a coefficient function.
    pub enum BasisName {
        /// One parameter per node of the grid.
        Nodal = "nodal",
        /// One constant.
        Constant = "constant",
        /// One value per interval between knots.
        PiecewiseConstant = "piecewise-constant",
        /// One value per knot, linear in between.
        PiecewiseLinear = "piecewise-linear",
        /// Polynomial over the whole record.
        Polynomial = "polynomial",
        /// Cubic B-spline.
        BSpline = "b-spline",
    }
}

/// Penalty on the roughness of a function p: `tikhonov`, weight times the integral of the squared derivative, or `tv`,
/// weight times the total variation, which permits jumps.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "penalty", extend("expecting" = "a map such as {kind: tikhonov, order: 2, weight: 0.1}"))]
pub struct PenaltyKeys {
    /// Measure of roughness.
    #[schemars(extend("example" = "tikhonov", "needs" = "tv: method gauss-newton or equation-error"))]
    pub kind: PenaltyKind,
    /// For `tikhonov`: order of the derivative, 0 (difference from `reference`), 1 (slope) or 2 (curvature).
    #[schemars(extend("example" = "2", "range" = "0, 1 or 2", "needs" = "`kind: tikhonov`"))]
    pub order: Option<usize>,
    /// Weight of the penalty in J, or the rule that chooses it.
    #[schemars(extend(
        "example" = "0.1",
        "unit" = "of J per unit of the measure",
        "range" = "0 or more",
        "needs" = "a rule: method gauss-newton, and `kind: tikhonov` except for bic; discrepancy, reml and bic also `sigma` (for reml and bic a number or `estimate`); bic: `kind: tv` and basis nodal or piecewise-constant; period: order 1 or 2 and method equation-error"
    ))]
    pub weight: WeightChoice,
    /// For `tikhonov` of order 0: the reference values.
    #[schemars(extend("example" = "1.0", "unit" = "that of the function", "default" = "0", "needs" = "`order: 0`"))]
    pub reference: Option<NumberOrColumn>,
}

words! {
    /// Measure of roughness.
    pub enum PenaltyKind {
        /// Integral of the squared derivative.
        Tikhonov = "tikhonov",
        /// Total variation.
        TotalVariation = "tv",
    }
}
