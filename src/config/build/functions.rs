//! Functions: basis, start, fixed part; and the truth.

mod basis;
mod limits;
mod start;

use super::QUANTITIES;
use super::on_grid::{Wanted, column_on_grid};
use crate::config::ModelFile;
use crate::config::NumberOrColumn;
use crate::config::scalar::Start;
use crate::config::spec::{Basis, ColumnSpec, FunctionSpec};
use crate::dynamics::{Device, Grid};
use crate::error::InputError;
use crate::functions::{self, CoefficientFunction, Quantity};

/// All functions on the grid, mass first.
pub(super) fn build(
    file: &ModelFile,
    grid: &Grid,
    warnings: &mut Vec<String>,
) -> Result<Vec<CoefficientFunction>, InputError> {
    let list: Vec<CoefficientFunction> = QUANTITIES
        .into_iter()
        .map(|quantity| function(file, grid, quantity))
        .collect::<Result<_, _>>()?;
    if list.iter().all(|f| f.parameters() == 0) {
        warnings.push("every function is fixed, so there is nothing to fit".into());
    }
    Ok(list)
}

/// What the model says about a function.
pub(super) fn spec(file: &ModelFile, quantity: Quantity) -> &FunctionSpec {
    match quantity {
        Quantity::Mass => &file.spec.functions.mass,
        Quantity::Damping => &file.spec.functions.damping,
        Quantity::Stiffness => &file.spec.functions.stiffness,
    }
}

fn function(
    file: &ModelFile,
    grid: &Grid,
    quantity: Quantity,
) -> Result<CoefficientFunction, InputError> {
    let key = format!("functions.{}", quantity.name());
    let spec = spec(file, quantity);
    basis::keys_fit(file, &key, spec)?;
    limits::check(file, grid, &key, spec)?;
    match (&spec.fixed, &spec.start, spec.basis) {
        (Some(_), Some(_), _) => Err(file
            .error_at(&format!("{key}.start"), "a fixed function has no start")
            .expected("either `fixed` or `start`")),
        (Some(fixed), None, _) => {
            let values = values(file, grid, &format!("{key}.fixed"), fixed)?;
            positive_mass(file, quantity, &format!("{key}.fixed"), &values)?;
            Ok(CoefficientFunction::fixed(quantity, values))
        }
        (None, None, _) => Err(file
            .error_at(&key, "this function has neither a start nor a fixed value")
            .expected("`start` for a function to be fitted, `fixed` for a known one")),
        (None, Some(_), None) => Err(file
            .error_at(&key, "a function to be fitted needs a basis")
            .expected(format!("`basis`, one of {}", basis_names()))),
        (None, Some(given), Some(kind)) => {
            let basis = basis::build(file, grid, &key, spec, kind)?;
            free(file, grid, quantity, basis, given)
        }
    }
}

fn free(
    file: &ModelFile,
    grid: &Grid,
    quantity: Quantity,
    basis: functions::Basis,
    given: &Start,
) -> Result<CoefficientFunction, InputError> {
    let key = format!("functions.{}.start", quantity.name());
    let start = start::parameters(file, grid, &key, &basis, given)?;
    let function = CoefficientFunction::free(quantity, basis, grid, start);
    let mut values = vec![0.0; grid.nodes()];
    function.values_into(&function.start, &mut values);
    positive_mass(file, quantity, &key, &values)?;
    Ok(function)
}

/// Values at the nodes: the same number, or a column that `key` names.
pub(super) fn values(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &NumberOrColumn,
) -> Result<Vec<f64>, InputError> {
    match given {
        NumberOrColumn::Number(value) => Ok(vec![value.0; grid.nodes()]),
        NumberOrColumn::Column(c) => column(file, grid, key, c),
    }
}

/// The nodal values of a column that `key` names.
fn column(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &ColumnSpec,
) -> Result<Vec<f64>, InputError> {
    let wanted = Wanted {
        data: &given.data.0,
        data_key: &format!("{key}.data"),
        column: &given.column.0,
        column_key: &format!("{key}.column"),
    };
    column_on_grid(file, &wanted, grid)
}

/// The equation of motion needs a positive mass everywhere.
fn positive_mass(
    file: &ModelFile,
    quantity: Quantity,
    key: &str,
    values: &[f64],
) -> Result<(), InputError> {
    let broken = values.iter().position(|m| *m <= 0.0);
    match broken {
        Some(i) if quantity == Quantity::Mass => Err(file
            .error_at(key, "the mass must be positive at all times")
            .found(match values.iter().all(|m| m == &values[i]) {
                true => values[i].to_string(),
                false => format!("{} at node {i}", values[i]),
            })
            .expected("a number greater than 0, in kg")),
        _ => Ok(()),
    }
}

fn basis_names() -> String {
    let names: Vec<&str> = Basis::ALL.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// The true device on the grid, where the model names it.
pub(super) fn truth(file: &ModelFile, grid: &Grid) -> Result<Option<Device>, InputError> {
    let Some(spec) = &file.spec.truth else {
        return Ok(None);
    };
    let column = |quantity: Quantity| {
        let named = spec.columns.as_ref().and_then(|c| match quantity {
            Quantity::Mass => c.mass.as_ref(),
            Quantity::Damping => c.damping.as_ref(),
            Quantity::Stiffness => c.stiffness.as_ref(),
        });
        let name = named.map_or(quantity.column(), |name| name.0.as_str());
        let wanted = Wanted {
            data: &spec.data.0,
            data_key: "truth.data",
            column: name,
            column_key: &format!("truth.columns.{}", quantity.name()),
        };
        column_on_grid(file, &wanted, grid)
    };
    Ok(Some(Device {
        mass: column(Quantity::Mass)?,
        coefficients: vec![column(Quantity::Damping)?, column(Quantity::Stiffness)?],
    }))
}
