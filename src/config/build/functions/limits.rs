//! Ranges of `min`, `max`, `smooth` and `variation`.

use super::values;
use crate::config::ModelFile;
use crate::config::scalar::{Number, Weight};
use crate::config::spec::{FunctionSpec, SmoothSpec};
use crate::error::InputError;
use kmcfit_core::internals::system::Grid;

/// Highest derivative that can be penalised.
const HIGHEST_ORDER: usize = 2;

/// Refuses limits that leave no values, penalties that are none, and either on a fixed function.
pub(super) fn check(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    spec: &FunctionSpec,
) -> Result<(), InputError> {
    not_fixed(file, key, spec)?;
    bounds(file, grid, key, spec)?;
    for (place, smooth) in spec.smooth.iter().flat_map(|list| list.iter()) {
        penalty(file, grid, &format!("{key}.smooth{place}"), smooth)?;
    }
    match &spec.variation {
        Some(variation) => weight(file, &format!("{key}.variation.weight"), variation.weight),
        None => Ok(()),
    }
}

fn not_fixed(file: &ModelFile, key: &str, spec: &FunctionSpec) -> Result<(), InputError> {
    let given = [
        ("min", spec.min.is_some()),
        ("max", spec.max.is_some()),
        ("smooth", spec.smooth.is_some()),
        ("variation", spec.variation.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((name, _)) if spec.fixed.is_some() => Err(file
            .error_at(
                &format!("{key}.{name}"),
                "a fixed function cannot be limited or smoothed",
            )
            .found(format!("`fixed` and `{name}`"))
            .expected("one of the two")),
        _ => Ok(()),
    }
}

fn bounds(file: &ModelFile, grid: &Grid, key: &str, spec: &FunctionSpec) -> Result<(), InputError> {
    let at = |name: &str| format!("{key}.{name}");
    let read = |name: &str, given: &Option<_>| {
        let read = |given| values(file, grid, &at(name), given);
        given.as_ref().map(read).transpose()
    };
    let (Some(min), Some(max)) = (read("min", &spec.min)?, read("max", &spec.max)?) else {
        return Ok(());
    };
    match min.iter().zip(&max).position(|(min, max)| min > max) {
        Some(i) => Err(file
            .error_at(&at("min"), "the smallest value is above the largest")
            .found(format!(
                "min {} and max {} at {} s",
                min[i],
                max[i],
                grid.time(i)
            ))
            .expected("min at most max at all times")),
        None => Ok(()),
    }
}

fn penalty(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    smooth: &SmoothSpec,
) -> Result<(), InputError> {
    if smooth.order.0 > HIGHEST_ORDER {
        return Err(file
            .error_at(
                &format!("{key}.order"),
                "this derivative cannot be penalised",
            )
            .found(smooth.order.0)
            .expected("0 (the value), 1 (the slope) or 2 (the curvature)"));
    }
    if let Weight::Number(number) = smooth.weight {
        weight(file, &format!("{key}.weight"), number)?;
    }
    let at = format!("{key}.reference");
    match &smooth.reference {
        Some(_) if smooth.order.0 > 0 => Err(file
            .error_at(&at, "only a penalty of order 0 has a reference")
            .found(format!("a reference with order {}", smooth.order.0))
            .expected("no `reference`, or `order: 0`")),
        Some(reference) => values(file, grid, &at, reference).map(drop),
        None => Ok(()),
    }
}

fn weight(file: &ModelFile, key: &str, weight: Number) -> Result<(), InputError> {
    match weight.0 < 0.0 {
        true => Err(file
            .error_at(key, "a weight cannot be negative")
            .found(weight.0)
            .expected("a number, 0 or more")),
        false => Ok(()),
    }
}
