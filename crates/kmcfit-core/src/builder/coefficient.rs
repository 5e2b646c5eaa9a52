//! Specification of one coefficient function: basis, start, bounds and penalties.

use super::BuildError;
use super::basis::{BasisSpec, Knots};
use crate::constraints::TimeHistory;
use crate::functions::basis::from_physical_powers;
use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Prior, WeightRule};
use crate::number_format::significant;
use crate::system::Grid;

/// Last key of a known part.
pub(super) const KNOWN_PART: &str = "known_part";

/// Start of a coefficient function, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// Equal at all times.
    Constant(f64),
    /// One value per parameter: per node, cell or knot; for a polynomial the coefficients of `t^0, t^1, …` (t in s).
    Parameters(Vec<f64>),
    /// Nodal values, projected onto the basis.
    Nodal(Vec<f64>),
}

/// Weight of a penalty in J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PenaltyWeight {
    /// Fixed weight.
    Given(f64),
    /// Chosen by a rule.
    Rule(WeightRule),
    /// Weight whose smoothing time is one dominant period (equation error only).
    Period,
}

/// Penalty on a coefficient function p, added to J.
#[derive(Debug, Clone, PartialEq)]
pub enum Roughness {
    /// `weight * integral (d^order (p - reference)/dt^order)^2 dt`.
    Tikhonov {
        /// Order of the derivative: 0, 1 or 2.
        order: usize,
        /// Weight.
        weight: PenaltyWeight,
        /// Reference values of a penalty of order 0, zero by default; other orders have none.
        reference: Option<TimeHistory>,
    },
    /// `weight * total variation of p`: equal for jumps and slow changes of the same height.
    TotalVariation {
        /// Weight: a number, or the rule [`WeightRule::Bic`].
        weight: PenaltyWeight,
    },
}

/// Fixed values, a known constant with a standard deviation, a basis with a start, or for a record the shared function.
#[derive(Debug, Clone, PartialEq)]
enum CoefficientForm {
    Fixed(TimeHistory),
    Uncertain(Prior),
    Estimated(BasisSpec, Start),
    Shared,
}

/// A coefficient function: mass (kg), damping (N s/m), stiffness (N/m) or the factor of a further term; fixed, or estimated in
/// a basis. It corresponds to an entry of `functions` in a model file.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientSpec {
    form: CoefficientForm,
    pub(super) min: Option<TimeHistory>,
    pub(super) max: Option<TimeHistory>,
    /// Lower bound as a share of the smallest start value.
    min_of_start: Option<f64>,
    pub(super) penalties: Vec<Roughness>,
    pub(super) width: Option<f64>,
    /// Known part that is added.
    pub(super) known_part: Option<Box<CoefficientSpec>>,
}

impl CoefficientSpec {
    fn new(form: CoefficientForm) -> Self {
        Self {
            form,
            min: None,
            max: None,
            min_of_start: None,
            penalties: Vec::new(),
            width: None,
            known_part: None,
        }
    }

    /// Fixed values.
    pub fn known(values: TimeHistory) -> Self {
        Self::new(CoefficientForm::Fixed(values))
    }

    /// Fixed and constant.
    pub fn fixed(value: f64) -> Self {
        Self::known(TimeHistory::Constant(value))
    }

    /// Constant, known as `value` with the standard deviation `sigma`: a parameter whose prior adds `((x - value)/sigma)^2` to J, so
    /// that every interval includes it. It requires a sigma in every record.
    pub fn uncertain(value: f64, sigma: f64) -> Self {
        Self::new(CoefficientForm::Uncertain(Prior { mean: value, sigma }))
    }

    /// For a record ([`Record::coefficient`](super::Record::coefficient)): the shared function, with the known part of this record.
    pub fn shared() -> Self {
        Self::new(CoefficientForm::Shared)
    }

    /// Adds a known part, [`CoefficientSpec::known`] or [`CoefficientSpec::uncertain`], to the function. Start, bounds and penalties
    /// concern the function without it.
    #[must_use]
    pub fn known_part(mut self, part: CoefficientSpec) -> Self {
        self.known_part = Some(Box::new(part));
        self
    }

    /// Estimated in a basis.
    pub fn estimated(basis: BasisSpec, start: Start) -> Self {
        Self::new(CoefficientForm::Estimated(basis, start))
    }

    /// Estimated, constant in time.
    pub fn constant(start: f64) -> Self {
        Self::estimated(BasisSpec::Constant, Start::Constant(start))
    }

    /// Estimated at every node, as in the paper.
    pub fn nodal(start: f64) -> Self {
        Self::estimated(BasisSpec::Nodal, Start::Constant(start))
    }

    /// Constant between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_constant(knots: usize, start: f64) -> Self {
        let basis = BasisSpec::PiecewiseConstant(Knots::Count(knots));
        Self::estimated(basis, Start::Constant(start))
    }

    /// Linear between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_linear(knots: usize, start: f64) -> Self {
        let basis = BasisSpec::PiecewiseLinear(Knots::Count(knots));
        Self::estimated(basis, Start::Constant(start))
    }

    /// A cubic spline with equally spaced `knots`, both ends of the record included.
    pub fn b_spline(knots: usize, start: f64) -> Self {
        Self::estimated(
            BasisSpec::BSpline(Knots::Count(knots)),
            Start::Constant(start),
        )
    }

    /// A polynomial with start coefficients of `t^0, t^1, …` (t in s): one number for a constant, two for a line.
    pub fn polynomial(start: &[f64]) -> Self {
        let degree = start.len().saturating_sub(1);
        Self::estimated(
            BasisSpec::Polynomial { degree },
            Start::Parameters(start.to_vec()),
        )
    }

    /// Lower bound, in the unit of the function.
    #[must_use]
    pub fn min(self, min: f64) -> Self {
        self.bounds(Some(TimeHistory::Constant(min)), None)
    }

    /// Upper bound, in the unit of the function.
    #[must_use]
    pub fn max(self, max: f64) -> Self {
        self.bounds(None, Some(TimeHistory::Constant(max)))
    }

    /// Lower bound of `share` times the smallest start value, where no other lower bound is given and the upper one is above it.
    #[must_use]
    pub fn min_of_start(mut self, share: f64) -> Self {
        self.min_of_start = Some(share);
        self
    }

    /// Lower bound, given or by the nodal values of the start.
    pub(super) fn lower_bound(&self, start: &[f64]) -> Option<TimeHistory> {
        let by_start = || {
            let least = start.iter().copied().fold(f64::INFINITY, f64::min);
            let bound = self.min_of_start? * least;
            let is_below = self.max.as_ref().is_none_or(|max| bound < max.least());
            (self.is_estimated() && is_below).then_some(TimeHistory::Constant(bound))
        };
        self.min.clone().or_else(by_start)
    }

    /// Bounds that may vary in time; `None` keeps the present one.
    #[must_use]
    pub fn bounds(mut self, min: Option<TimeHistory>, max: Option<TimeHistory>) -> Self {
        self.min = min.or(self.min);
        self.max = max.or(self.max);
        self
    }

    /// Tikhonov penalty `weight * integral (d^order p/dt^order)^2 dt`, `order` 0, 1 or 2.
    #[must_use]
    pub fn tikhonov(self, order: usize, weight: f64) -> Self {
        self.penalty(Roughness::Tikhonov {
            order,
            weight: PenaltyWeight::Given(weight),
            reference: None,
        })
    }

    /// Penalty `weight * total variation`, equal for jumps and slow changes of the same height.
    #[must_use]
    pub fn total_variation(self, weight: f64) -> Self {
        let weight = PenaltyWeight::Given(weight);
        self.penalty(Roughness::TotalVariation { weight })
    }

    /// Adds a penalty.
    #[must_use]
    pub fn penalty(mut self, penalty: Roughness) -> Self {
        self.penalties.push(penalty);
        self
    }

    /// Width of the law, for laws that have one: the smoothing speed (m/s) of Coulomb friction.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = Some(width);
        self
    }

    /// Basis of an estimated function.
    pub(super) fn basis(&self) -> Option<&BasisSpec> {
        match &self.form {
            CoefficientForm::Estimated(basis, _) => Some(basis),
            _ => None,
        }
    }

    /// Sets the number of knots of a basis that has them.
    pub(super) fn set_knots(&mut self, count: usize) {
        if let CoefficientForm::Estimated(
            BasisSpec::PiecewiseConstant(knots)
            | BasisSpec::PiecewiseLinear(knots)
            | BasisSpec::BSpline(knots),
            _,
        ) = &mut self.form
        {
            *knots = Knots::Count(count);
        }
    }

    /// True if the function is estimated.
    pub(super) fn is_estimated(&self) -> bool {
        matches!(self.form, CoefficientForm::Estimated(..))
    }

    /// True for the shared function, with a known part of a record.
    pub(super) fn is_shared(&self) -> bool {
        self.form == CoefficientForm::Shared
    }

    /// Known constant with a standard deviation, if it is one.
    pub(super) fn prior(&self) -> Option<Prior> {
        match self.form {
            CoefficientForm::Uncertain(prior) => Some(prior),
            _ => None,
        }
    }

    /// Constructs the function on a grid; errors name keys below `key`.
    pub(super) fn on(
        &self,
        kind: CoefficientKind,
        key: &str,
        grid: &Grid,
    ) -> Result<CoefficientFunction, BuildError> {
        self.check(kind, key, grid)?;
        let nodes = grid.nodes();
        let (key, function) = match &self.form {
            CoefficientForm::Fixed(values) => {
                let key = fixed_key(key);
                let values = values_at_nodes(values, &key, nodes)?;
                (key, CoefficientFunction::fixed(kind, values))
            }
            CoefficientForm::Uncertain(prior) => {
                let key = fixed_key(key);
                check_prior(&key, prior)?;
                (key, CoefficientFunction::uncertain(kind, *prior, nodes))
            }
            CoefficientForm::Shared => {
                return Err(BuildError::new(
                    key,
                    "this function has neither a start nor a fixed value",
                )
                .expected("`start` for a function to be fitted, `fixed` for a known one"));
            }
            CoefficientForm::Estimated(basis, start) => {
                let basis = basis.on(key, grid)?;
                let key = format!("{key}.start");
                let start = parameters(&key, &basis, start, grid)?;
                let function = CoefficientFunction::free(kind, basis, grid, start);
                (key, function)
            }
        };
        let mut values = vec![0.0; nodes];
        function.values_into(&function.start, &mut values);
        check_values(kind, &key, &values)?;
        Ok(function)
    }

    /// Error for invalid bounds or penalties, and for either on a fixed function.
    fn check(&self, kind: CoefficientKind, key: &str, grid: &Grid) -> Result<(), BuildError> {
        let given = [
            ("min", self.min.is_some()),
            ("max", self.max.is_some()),
            ("penalty", !self.penalties.is_empty()),
        ];
        if let Some((name, _)) = given.iter().find(|(_, given)| *given)
            && !self.is_estimated()
        {
            let problem = "a fixed function has neither bounds nor penalties";
            return Err(BuildError::new(format!("{key}.{name}"), problem)
                .found(format!("`fixed` and `{name}`"))
                .expected("one of the two"));
        }
        let bound = |name: &str, bound: &Option<TimeHistory>| match bound {
            Some(values) => {
                values_at_nodes(values, &format!("{key}.{name}"), grid.nodes()).map(drop)
            }
            None => Ok(()),
        };
        bound("min", &self.min)?;
        bound("max", &self.max)?;
        uncrossed(key, kind.unit(), self.min.as_ref(), self.max.as_ref(), grid)?;
        for (i, penalty) in self.penalties.iter().enumerate() {
            penalty.check(&format!("{key}.penalty[{i}]"), grid)?;
        }
        Ok(())
    }
}

/// Key of the fixed values of a function: `known_part` has them itself.
fn fixed_key(key: &str) -> String {
    match key.ends_with(KNOWN_PART) {
        true => key.to_owned(),
        false => format!("{key}.fixed"),
    }
}

/// Error for a known value that is not finite, or a standard deviation that is not positive.
fn check_prior(key: &str, prior: &Prior) -> Result<(), BuildError> {
    if !(prior.sigma.is_finite() && prior.sigma > 0.0) {
        return Err(BuildError::new(
            format!("{key}.sigma"),
            "a standard deviation must be positive",
        )
        .found(prior.sigma)
        .expected("a number greater than 0, in the unit of the function"));
    }
    match prior.mean.is_finite() {
        true => Ok(()),
        false => Err(
            BuildError::new(format!("{key}.value"), "not a finite number")
                .found(prior.mean)
                .expected("a finite number"),
        ),
    }
}

/// Error if a lower bound exceeds the upper one; the keys are `min` and `max` below `key`.
pub(super) fn uncrossed(
    key: &str,
    unit: &str,
    min: Option<&TimeHistory>,
    max: Option<&TimeHistory>,
    grid: &Grid,
) -> Result<(), BuildError> {
    let (Some(min), Some(max)) = (min, max) else {
        return Ok(());
    };
    match (0..grid.nodes()).find(|&i| min.at(i) > max.at(i)) {
        Some(i) => {
            let problem = "min is greater than max";
            let [min, max, time] = [min.at(i), max.at(i), grid.time(i)].map(|x| significant(x, 6));
            Err(BuildError::new(format!("{key}.min"), problem)
                .found(format!("min {min} {unit} and max {max} {unit} at {time} s"))
                .expected("min at most max at all times"))
        }
        None => Ok(()),
    }
}

/// Values at all nodes; error if one is not finite.
pub(super) fn values_at_nodes(
    values: &TimeHistory,
    key: &str,
    nodes: usize,
) -> Result<Vec<f64>, BuildError> {
    let values = match values {
        TimeHistory::Constant(value) => vec![*value; nodes],
        TimeHistory::Nodal { values, .. } => values.clone(),
    };
    if values.len() != nodes {
        return Err(
            BuildError::new(key, "the number of values differs from that of the nodes")
                .found(format!("{} values", values.len()))
                .expected(format!("{nodes} values")),
        );
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(BuildError::new(key, "not a finite number")
            .found(value)
            .expected("finite numbers")),
        None => Ok(values),
    }
}

/// Error for values that are not finite, and for a mass that is not positive.
fn check_values(kind: CoefficientKind, key: &str, values: &[f64]) -> Result<(), BuildError> {
    if let Some(value) = values.iter().find(|value| !value.is_finite()) {
        return Err(BuildError::new(key, "not a finite number")
            .found(value)
            .expected("finite numbers"));
    }
    match values.iter().position(|m| *m <= 0.0) {
        Some(i) if kind == CoefficientKind::MASS => Err(BuildError::new(
            key,
            "the mass must be positive at all times",
        )
        .found(match values.iter().all(|m| m == &values[i]) {
            true => values[i].to_string(),
            false => format!("{} at node {i}", values[i]),
        })
        .expected("a number greater than 0, in kg")),
        _ => Ok(()),
    }
}

/// Parameters of a start.
fn parameters(
    key: &str,
    basis: &Basis,
    start: &Start,
    grid: &Grid,
) -> Result<Vec<f64>, BuildError> {
    match start {
        Start::Constant(value) => Ok(basis.constant(grid, *value)),
        Start::Parameters(values) => listed(key, basis, values, grid),
        Start::Nodal(values) => basis.project(grid, values).ok_or_else(|| {
            BuildError::new(key, "the column cannot be projected onto this basis")
                .found(format!("`{}`", basis.name()))
                .expected("a basis whose functions are linearly independent at the nodes")
        }),
    }
}

fn listed(key: &str, basis: &Basis, values: &[f64], grid: &Grid) -> Result<Vec<f64>, BuildError> {
    let one_per = match basis {
        Basis::Nodal => "one per node",
        Basis::Constant => "the value at all times",
        Basis::PiecewiseConstant { .. } => "one per cell between knots",
        Basis::PiecewiseLinear { .. } => "one per knot",
        Basis::BSpline { .. } => "one per basis function",
        Basis::Polynomial { .. } => "the coefficients of t^0, t^1, … with t in s",
    };
    let count = |numbers: usize| match numbers {
        1 => "1 number".to_owned(),
        n => format!("{n} numbers"),
    };
    let wanted = basis.parameters(grid);
    if values.len() != wanted {
        return Err(BuildError::new(key, "the list does not fit the basis")
            .found(format!("{} for `{}`", count(values.len()), basis.name()))
            .expected(format!("{}, {one_per}", count(wanted))));
    }
    Ok(match basis {
        Basis::Polynomial { .. } => from_physical_powers(grid, values),
        _ => values.to_vec(),
    })
}
