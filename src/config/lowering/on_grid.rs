//! Coefficient functions given as CSV columns, interpolated at the nodes.

use super::ModelKey;
use crate::error::InputError;
use crate::tables::{Table, TableFormat, increasing};
use crate::units::Measurand;
use kmcfit_core::system::Grid;

/// Column of times in files of functions.
const TIME_COLUMN: &str = "t_s";
/// Distance between a row and a node, in steps, up to which no interpolation is needed.
const SAME_TIME: f64 = 1e-6;

/// A column of a data file, both with their keys in the model file, at the nodes: unchanged if its rows are the nodes, else interpolated linearly.
pub(super) fn column_on_grid(
    (data, data_at): (&str, &ModelKey<'_>),
    (column, column_at): (&str, &ModelKey<'_>),
    grid: &Grid,
) -> Result<Vec<f64>, InputError> {
    let about_data = data_at.asks_for();
    let tables = data_at.file.tables(data, &TableFormat::default());
    let table = tables.and_then(Table::only).map_err(&about_data)?;
    check_seconds(&table).map_err(&about_data)?;
    let times = increasing(&table, TIME_COLUMN).map_err(&about_data)?;
    let values = table.column(column).map_err(column_at.asks_for())?;
    let same = |(i, t): (usize, &f64)| (t - grid.time(i)).abs() <= SAME_TIME * grid.step();
    if times.len() == grid.nodes() && times.iter().enumerate().all(same) {
        return Ok(values.to_vec());
    }
    let (first, last) = (grid.time(0), grid.time(grid.nodes() - 1));
    let slack = SAME_TIME * grid.step();
    let covered = times.first().is_some_and(|t| *t <= first + slack)
        && times.last().is_some_and(|t| *t >= last - slack);
    if !covered {
        let span = |a: Option<&f64>, b: Option<&f64>| match (a, b) {
            (Some(a), Some(b)) => format!("{a} s to {b} s"),
            _ => "no rows".into(),
        };
        let short = InputError::file(table.path(), "the times do not cover the record")
            .found(span(times.first(), times.last()))
            .expected(format!("at least {first} s to {last} s"));
        return Err(about_data(short));
    }
    Ok(grid
        .times()
        .iter()
        .map(|t| linear(times, values, *t))
        .collect())
}

/// Refuses times whose stated unit is not s.
fn check_seconds(table: &Table) -> Result<(), InputError> {
    let index = table.find(&TIME_COLUMN.into())?;
    let unit = table.stated_unit(index).explicit(Measurand::Time);
    match unit.filter(|unit| unit.factor() != 1.0) {
        None => Ok(()),
        Some(unit) => Err(
            InputError::file(table.path(), "the times are not in seconds")
                .found(format!(
                    "the unit {} of `{}`",
                    unit.symbol(),
                    table.label(index)
                ))
                .expected(format!("`{TIME_COLUMN}` in s")),
        ),
    }
}

/// Linear interpolation, constant beyond the ends.
fn linear(times: &[f64], values: &[f64], t: f64) -> f64 {
    let after = times.partition_point(|x| *x < t);
    if after == 0 {
        return values[0];
    }
    if after == times.len() {
        return values[after - 1];
    }
    let (a, b) = (times[after - 1], times[after]);
    let share = (t - a) / (b - a);
    values[after - 1] * (1.0 - share) + values[after] * share
}
