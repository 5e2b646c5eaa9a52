//! Numbers that are known, or become scalars of the problem.

use crate::config::ModelFile;
use crate::config::scalar::{NumberOrEstimate, ScalarOr};
use crate::config::spec::EstimateValue;
use crate::error::InputError;
use kmcfit_core::internals::functions::{Prior, ScalarParameter, Value};

/// A number of the model and what a report calls it.
pub struct Named<'a> {
    /// Key of the model.
    pub key: String,
    /// Name for reports.
    pub name: String,
    /// SI unit.
    pub unit: &'a str,
    /// Where a search starts without a given start or prior.
    pub start: f64,
    /// How large a change of it is large.
    pub size: f64,
}

/// The value: known, or added to `scalars`.
pub fn value(
    file: &ModelFile,
    named: &Named,
    given: &EstimateValue,
    scalars: &mut Vec<ScalarParameter>,
) -> Result<Value, InputError> {
    let (start, prior) = match given {
        ScalarOr::Scalar(NumberOrEstimate::Number(number)) => return Ok(Value::Known(number.0)),
        ScalarOr::Scalar(NumberOrEstimate::Estimate) => (None, None),
        ScalarOr::Map(spec) => (spec.start.map(|s| s.0), spec.prior.as_ref()),
    };
    let prior = match prior {
        Some(prior) if prior.sigma.0 <= 0.0 => {
            return Err(file
                .error_at(
                    &format!("{}.prior.sigma", named.key),
                    "a standard deviation must be positive",
                )
                .found(prior.sigma.0)
                .expected("a number greater than 0"));
        }
        other => other.map(|prior| Prior {
            mean: prior.mean.0,
            sigma: prior.sigma.0,
        }),
    };
    let size = if named.size > 0.0 { named.size } else { 1.0 };
    scalars.push(ScalarParameter {
        name: named.name.clone(),
        unit: named.unit.to_owned(),
        start: start.or(prior.map(|p| p.mean)).unwrap_or(named.start),
        size,
        prior,
    });
    Ok(Value::Sought(scalars.len() - 1))
}
