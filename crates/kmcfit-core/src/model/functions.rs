//! Keys of the coefficient functions.

use super::{
    Bound, KnotSpec, KnownValue, KnownValueMap, NumberOrColumn, OneOrList, StartSpec, WeightChoice,
    words,
};
use crate::constraints::TimeHistory;
use schemars::JsonSchema;
use serde::Deserialize;

/// A coefficient function: estimated, with a basis and start values, or fixed.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "function", extend("expecting" = "a map such as {basis: nodal, start: 2.0}"))]
pub struct CoefficientSpec {
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
    pub penalty: Option<OneOrList<PenaltySpec>>,
    /// Width of the law of the coefficient. Coulomb friction: velocity in m/s over which its sign is smoothed, well below the peak
    /// velocity of the response.
    #[schemars(extend(
        "example" = "0.01",
        "range" = "greater than 0",
        "needs" = "a coefficient whose law has a width, which requires it"
    ))]
    pub width: Option<f64>,
    /// Lower bound as a share of the smallest start value, where no other lower bound is given and the upper one is above it.
    #[serde(skip)]
    pub min_of_start: Option<f64>,
}

impl CoefficientSpec {
    /// Fixed values.
    pub fn known(values: TimeHistory) -> Self {
        Self {
            fixed: Some(KnownValue::History(values)),
            ..Self::default()
        }
    }

    /// Fixed and constant.
    pub fn fixed(value: f64) -> Self {
        Self::known(TimeHistory::Constant(value))
    }

    /// Constant, known as `value` with the standard deviation `sigma`: a parameter whose prior adds `((x - value)/sigma)^2` to J, so
    /// that every interval includes it. It requires a sigma in every record.
    pub fn uncertain(value: f64, sigma: f64) -> Self {
        let fixed = KnownValueMap {
            value: Some(value),
            sigma: Some(sigma),
            ..KnownValueMap::default()
        };
        Self {
            fixed: Some(KnownValue::Map(fixed)),
            ..Self::default()
        }
    }

    /// Adds a known part, [`CoefficientSpec::known`] or [`CoefficientSpec::uncertain`], to the function; without another key it is the
    /// shared function with the known part of one record. Start, bounds and penalties concern the function without it.
    #[must_use]
    pub fn known_part(mut self, part: CoefficientSpec) -> Self {
        self.known_part = part.fixed;
        self
    }

    /// Estimated in a basis.
    pub fn estimated(basis: BasisName, start: StartSpec) -> Self {
        Self {
            basis: Some(basis),
            start: Some(start),
            ..Self::default()
        }
    }

    /// Estimated, constant in time.
    pub fn constant(start: f64) -> Self {
        Self::estimated(BasisName::Constant, StartSpec::Number(start))
    }

    /// Estimated at every node, as in the paper.
    pub fn nodal(start: f64) -> Self {
        Self::estimated(BasisName::Nodal, StartSpec::Number(start))
    }

    /// Constant between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_constant(knots: usize, start: f64) -> Self {
        Self::estimated(BasisName::PiecewiseConstant, StartSpec::Number(start))
            .knots(KnotSpec::Count(knots))
    }

    /// Linear between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_linear(knots: usize, start: f64) -> Self {
        Self::estimated(BasisName::PiecewiseLinear, StartSpec::Number(start))
            .knots(KnotSpec::Count(knots))
    }

    /// A cubic spline with equally spaced `knots`, both ends of the record included.
    pub fn b_spline(knots: usize, start: f64) -> Self {
        Self::estimated(BasisName::BSpline, StartSpec::Number(start)).knots(KnotSpec::Count(knots))
    }

    /// A polynomial with start coefficients of `t^0, t^1, …` (t in s): one number for a constant, two for a line.
    pub fn polynomial(start: &[f64]) -> Self {
        let degree = Some(start.len().saturating_sub(1));
        let start = StartSpec::List(start.to_vec());
        Self {
            degree,
            ..Self::estimated(BasisName::Polynomial, start)
        }
    }

    /// Sets the knots of a piecewise function or spline.
    #[must_use]
    pub fn knots(mut self, knots: KnotSpec) -> Self {
        self.knots = Some(knots);
        self
    }

    /// Lower bound, in the unit of the function.
    #[must_use]
    pub fn min(mut self, min: f64) -> Self {
        self.min = Some(Bound::At(NumberOrColumn::Number(min)));
        self
    }

    /// Upper bound, in the unit of the function.
    #[must_use]
    pub fn max(mut self, max: f64) -> Self {
        self.max = Some(Bound::At(NumberOrColumn::Number(max)));
        self
    }

    /// Tikhonov penalty `weight * integral (d^order p/dt^order)^2 dt`, `order` 0, 1 or 2.
    #[must_use]
    pub fn tikhonov(self, order: usize, weight: f64) -> Self {
        self.penalty(PenaltySpec::tikhonov(order, WeightChoice::Number(weight)))
    }

    /// Penalty `weight * total variation`, equal for jumps and slow changes of the same height.
    #[must_use]
    pub fn total_variation(self, weight: f64) -> Self {
        self.penalty(PenaltySpec::total_variation(WeightChoice::Number(weight)))
    }

    /// Adds a penalty.
    #[must_use]
    pub fn penalty(mut self, penalty: PenaltySpec) -> Self {
        let mut list = self.penalties().to_vec();
        list.push(penalty);
        self.penalty = Some(OneOrList::List(list));
        self
    }

    /// Width of the law, for laws that have one: the smoothing speed (m/s) of Coulomb friction.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = Some(width);
        self
    }

    /// Its penalties.
    pub fn penalties(&self) -> &[PenaltySpec] {
        self.penalty.as_ref().map_or(&[], OneOrList::values)
    }
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
pub struct PenaltySpec {
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

impl PenaltySpec {
    /// `weight * integral (d^order p/dt^order)^2 dt`.
    pub fn tikhonov(order: usize, weight: WeightChoice) -> Self {
        Self {
            kind: PenaltyKind::Tikhonov,
            order: Some(order),
            weight,
            reference: None,
        }
    }

    /// `weight * total variation of p`: equal for jumps and slow changes of the same height.
    pub fn total_variation(weight: WeightChoice) -> Self {
        Self {
            kind: PenaltyKind::TotalVariation,
            order: None,
            weight,
            reference: None,
        }
    }
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
