//! From `start` to the parameters of a basis.

use crate::config::ModelFile;
use crate::config::scalar::{Number, Start};
use crate::error::InputError;
use kmcfit_core::internals::functions::Basis;
use kmcfit_core::internals::functions::basis::from_physical_powers;
use kmcfit_core::internals::system::Grid;

/// The parameters to start from: those of a constant, those listed, or the closest to a column.
pub(super) fn parameters(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    basis: &Basis,
    given: &Start,
) -> Result<Vec<f64>, InputError> {
    match given {
        Start::Number(value) => Ok(basis.constant(grid, value.0)),
        Start::List(values) => listed(file, grid, key, basis, values),
        Start::Column(c) => {
            let values = super::column(file, grid, key, c)?;
            basis.project(grid, &values).ok_or_else(|| {
                file.error_at(key, "the column cannot be turned into this basis")
                    .found(format!("`{}`", basis.name()))
                    .expected("a basis whose functions the nodes can tell apart")
            })
        }
    }
}

fn listed(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    basis: &Basis,
    values: &[Number],
) -> Result<Vec<f64>, InputError> {
    let one_per = match basis {
        Basis::Nodal => "one per node",
        Basis::Constant => "the value at all times",
        Basis::PiecewiseConstant { .. } => "one per cell between knots",
        Basis::PiecewiseLinear { .. } => "one per knot",
        Basis::Polynomial { .. } => "the factors of t^0, t^1, … with t in s",
        Basis::BSpline { .. } => {
            return Err(file
                .error_at(key, "a start of the basis `b-spline` cannot be a list")
                .found("a list")
                .expected("a finite number, or a column: {data: file.csv, column: name}"));
        }
    };
    let wanted = basis.parameters(grid);
    if values.len() != wanted {
        let plural = if wanted == 1 { "" } else { "s" };
        return Err(file
            .error_at(key, "the list does not fit the basis")
            .found(format!("{} for `{}`", count(values.len()), basis.name()))
            .expected(format!("{wanted} number{plural}, {one_per}")));
    }
    let values: Vec<f64> = values.iter().map(|v| v.0).collect();
    Ok(match basis {
        Basis::Polynomial { .. } => from_physical_powers(grid, &values),
        _ => values,
    })
}

fn count(numbers: usize) -> String {
    match numbers {
        1 => "1 number".to_owned(),
        n => format!("{n} numbers"),
    }
}
