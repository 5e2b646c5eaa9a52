//! A coefficient function on a grid: what its keys state together.

use super::BuildError;
use crate::constraints::TimeHistory;
use crate::functions::basis::from_physical_powers;
use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Prior};
use crate::model::{
    BasisName, Bound, CoefficientSpec, KnotSpec, KnownValue, KnownValueMap, NumberOrColumn,
    StartSpec,
};
use crate::number_format::significant;
use crate::system::Grid;

/// Last key of a known part.
pub(super) const KNOWN_PART: &str = "known_part";
/// Key of a mass that may be `unknown`.
pub const UNKNOWN_MASS: &str = "functions.mass.fixed";

/// Fixed values, a known constant with a standard deviation, a start in a basis, or for a record the shared function.
pub(super) enum Form<'a> {
    Fixed(TimeHistory),
    Uncertain(Prior),
    Estimated(BasisName, &'a StartSpec),
    Shared,
}

impl CoefficientSpec {
    /// Lower bound, given or by the nodal values of the start.
    pub(super) fn lower_bound(&self, start: &[f64]) -> Option<TimeHistory> {
        let by_start = || {
            let least = start.iter().copied().fold(f64::INFINITY, f64::min);
            let bound = self.min_of_start? * least;
            let upper = limit(self.max.as_ref());
            let is_below = upper.is_none_or(|max| bound < max.least());
            (self.is_estimated() && is_below).then_some(TimeHistory::Constant(bound))
        };
        match self.min {
            None => by_start(),
            Some(_) => limit(self.min.as_ref()),
        }
    }

    /// Upper bound.
    pub(super) fn upper_bound(&self) -> Option<TimeHistory> {
        limit(self.max.as_ref())
    }

    /// True if the function is estimated.
    pub(super) fn is_estimated(&self) -> bool {
        self.fixed.is_none() && self.basis.is_some()
    }

    /// True for the shared function, with a known part of a record.
    pub(super) fn is_shared(&self) -> bool {
        let has_other = self.min.is_some()
            || self.max.is_some()
            || self.penalty.is_some()
            || self.width.is_some()
            || self.start.is_some()
            || self.basis.is_some()
            || self.fixed.is_some();
        self.known_part.is_some() && !has_other
    }

    /// True for automatic knots.
    pub(super) fn has_automatic_knots(&self) -> bool {
        matches!(self.knots, Some(KnotSpec::Auto(_)))
    }

    /// Known constant with a standard deviation, if it is one.
    pub(super) fn prior(&self) -> Option<Prior> {
        match &self.fixed {
            Some(KnownValue::Map(map)) => Some(Prior {
                mean: map.value?,
                sigma: map.sigma?,
            }),
            _ => None,
        }
    }

    /// The form that the keys `fixed`, `start` and `basis` state together.
    pub(super) fn form(&self, key: &str) -> Result<Form<'_>, BuildError> {
        let is_own = key.starts_with("experiments");
        let error = |part: &str, problem: &str| BuildError::new(format!("{key}.{part}"), problem);
        match (&self.fixed, &self.start, self.basis) {
            (Some(_), Some(_), _) => Err(error("start", "`fixed` and `start` exclude each other")
                .expected("either `fixed` or `start`")),
            (Some(_), None, Some(_)) => {
                Err(error("basis", "`fixed` and `basis` exclude each other")
                    .expected("either `fixed`, or `basis` with `start`"))
            }
            (Some(fixed), None, None) => known(fixed, &fixed_key(key)),
            (None, None, None) if is_own && self.is_shared() => Ok(Form::Shared),
            (None, None, _) => Err(BuildError::new(
                key,
                "this function has neither a start nor a fixed value",
            )
            .expected("`start` for a function to be fitted, `fixed` for a known one")
            .hint("mass, damping and stiffness of a fit start from the record")),
            (None, Some(_), None) => {
                let names: Vec<&str> = BasisName::ALL.iter().map(|basis| basis.name()).collect();
                Err(
                    BuildError::new(key, "a function to be fitted needs a basis")
                        .expected(format!("`basis`, one of {}", names.join(", "))),
                )
            }
            (None, Some(start), Some(basis)) => Ok(Form::Estimated(basis, start)),
        }
    }

    /// Constructs the function on a grid; errors name keys below `key`.
    pub(super) fn on(
        &self,
        kind: CoefficientKind,
        key: &str,
        grid: &Grid,
    ) -> Result<CoefficientFunction, BuildError> {
        self.check_basis_keys(key)?;
        let form = self.form(key)?;
        self.check(kind, key, grid)?;
        let nodes = grid.nodes();
        let (key, function) = match form {
            Form::Fixed(values) => {
                let key = fixed_key(key);
                let values = values_at_nodes(&values, &key, nodes)?;
                (key, CoefficientFunction::fixed(kind, values))
            }
            Form::Uncertain(prior) => {
                let key = fixed_key(key);
                check_prior(&key, &prior)?;
                (key, CoefficientFunction::uncertain(kind, prior, nodes))
            }
            // Without functions of its own it has no entry.
            Form::Shared => {
                return Err(BuildError::new(key, "this function has only a known part"));
            }
            Form::Estimated(name, start) => {
                let basis = self.basis_on(name, key, grid)?;
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
        let (min, max) = (limit(self.min.as_ref()), limit(self.max.as_ref()));
        let given = [
            ("min", min.is_some()),
            ("max", max.is_some()),
            ("penalty", !self.penalties().is_empty()),
        ];
        if let Some((name, _)) = given.iter().find(|(_, given)| *given)
            && !self.is_estimated()
        {
            let problem = "a fixed function has neither bounds nor penalties";
            return Err(BuildError::new(format!("{key}.{name}"), problem)
                .found(format!("`fixed` and `{name}`"))
                .expected("one of the two"));
        }
        for (name, given) in [("min", &self.min), ("max", &self.max)] {
            if let Some(Bound::At(given)) = given {
                let key = format!("{key}.{name}");
                values_at_nodes(&history(given, &key)?, &key, grid.nodes())?;
            }
        }
        uncrossed(key, kind.unit(), min.as_ref(), max.as_ref(), grid)?;
        for (suffix, penalty) in self.penalty.iter().flat_map(|list| list.iter()) {
            penalty.check(&format!("{key}.penalty{suffix}"), grid)?;
        }
        Ok(())
    }
}

/// A limit, where one is given.
pub(super) fn limit(bound: Option<&Bound>) -> Option<TimeHistory> {
    match bound {
        Some(Bound::At(NumberOrColumn::Number(value))) => Some(TimeHistory::Constant(*value)),
        Some(Bound::At(NumberOrColumn::History(values))) => Some(values.clone()),
        _ => None,
    }
}

/// Known values at `key`.
fn known<'a>(given: &KnownValue, key: &str) -> Result<Form<'a>, BuildError> {
    let map = match given {
        KnownValue::Number(value) => return Ok(Form::Fixed(TimeHistory::Constant(*value))),
        KnownValue::History(values) => return Ok(Form::Fixed(values.clone())),
        KnownValue::Unknown(_) if key == UNKNOWN_MASS => {
            return Ok(Form::Fixed(TimeHistory::Constant(1.0)));
        }
        KnownValue::Unknown(_) => {
            return Err(BuildError::new(key, "only the mass can be unknown")
                .found("`unknown`")
                .expected("a value, or `basis` for a function to be fitted")
                .hint("all coefficients are ratios to an unknown mass: `functions: {mass: {fixed: unknown}}`"));
        }
        KnownValue::Map(map) => map,
    };
    let KnownValueMap {
        value,
        sigma,
        data,
        column,
    } = map;
    match (value, sigma, data, column) {
        (Some(mean), Some(sigma), None, None) => Ok(Form::Uncertain(Prior {
            mean: *mean,
            sigma: *sigma,
        })),
        (None, None, Some(_), Some(_)) => Err(unread(key)),
        _ => {
            let keys = [
                ("value", value.is_some()),
                ("sigma", sigma.is_some()),
                ("data", data.is_some()),
                ("column", column.is_some()),
            ];
            let given = keys.iter().filter(|(_, is_given)| *is_given);
            let given: Vec<String> = given.map(|(name, _)| format!("`{name}`")).collect();
            let problem = "neither a value with its standard deviation nor a column of a file";
            Err(BuildError::new(key, problem)
                .found(match given.is_empty() {
                    true => "an empty map".to_owned(),
                    false => given.join(" and "),
                })
                .expected("{value: 4.5, sigma: 0.02}, or {data: file.csv, column: name}"))
        }
    }
}

/// Values over time.
pub(super) fn history(given: &NumberOrColumn, key: &str) -> Result<TimeHistory, BuildError> {
    match given {
        NumberOrColumn::Number(value) => Ok(TimeHistory::Constant(*value)),
        NumberOrColumn::History(values) => Ok(values.clone()),
        NumberOrColumn::Column(_) => Err(unread(key)),
    }
}

/// Error for a column of a file, which is read before.
fn unread(key: &str) -> BuildError {
    BuildError::new(key, "the column of this file has not been read")
        .expected("numbers, or values at the nodes")
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
    start: &StartSpec,
    grid: &Grid,
) -> Result<Vec<f64>, BuildError> {
    match start {
        StartSpec::Number(value) => Ok(basis.constant(grid, *value)),
        StartSpec::List(_) if matches!(basis, Basis::BSpline { .. }) => Err(BuildError::new(
            key,
            "`start` of the basis `b-spline` must be one number",
        )
        .found("a list")
        .expected("a finite number, or a column: {data: file.csv, column: name}")),
        StartSpec::List(values) => listed(key, basis, values, grid),
        StartSpec::Column(_) => Err(unread(key)),
        StartSpec::Nodal(values) => basis.project(grid, values).ok_or_else(|| {
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
