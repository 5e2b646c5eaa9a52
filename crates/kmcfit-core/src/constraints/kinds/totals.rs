//! Means and integrals over the record.

use super::linear_form::{LinearForm, group};
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use crate::functions::Basis;
use crate::system::quadrature::trapezoid_weights;

pub(super) fn mean(all: &All<'_>, j: usize, value: f64) -> Result<RowGroup, ConstraintError> {
    let mut form = total(all, j);
    let share = 1.0 / all.grid.duration();
    form.entries.iter_mut().for_each(|(_, a)| *a *= share);
    form.constant *= share;
    let name = format!("mean of {} = {value}", all.name(j));
    group(name, &[form], |_| [value, value])
}

pub(super) fn integral(all: &All<'_>, j: usize, value: f64) -> Result<RowGroup, ConstraintError> {
    let name = format!("integral of {} = {value}", all.name(j));
    group(name, &[total(all, j)], |_| [value, value])
}

/// `integral p dt` over the record, exactly.
fn total(all: &All<'_>, j: usize) -> LinearForm {
    let function = all.list[j];
    let first = all.functions.ranges()[j].start;
    let weights = trapezoid_weights(all.grid.nodes(), all.grid.step());
    let of_offset = weights
        .iter()
        .zip(function.offset.iter())
        .map(|(w, p)| w * p);
    let ends = all.ends();
    let mut form = LinearForm {
        entries: Vec::new(),
        constant: of_offset.sum(),
        time: ends[0],
        span: ends,
    };
    match &function.basis {
        None => {}
        Some(Basis::Nodal) => {
            let entries = weights.iter().enumerate();
            form.entries = entries.map(|(i, w)| (first + i, *w)).collect();
        }
        // Legendre polynomials but the first have the integral zero.
        Some(Basis::Polynomial { .. }) => form.entries.push((first, all.grid.duration())),
        Some(basis) => {
            let (times, halves) = gauss_points(&basis.knot_times(all.grid));
            let rows = all.forms(j, 0, &times);
            for (row, half) in rows.iter().zip(halves) {
                let scaled = row.entries.iter().map(|(i, b)| (*i, half * b));
                form.entries.extend(scaled);
            }
        }
    }
    form
}

/// Two Gauss points per cell, exact for cubic polynomials, and their weights (s).
fn gauss_points(knots: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let offset = 1.0 / 3f64.sqrt();
    let point = |cell: &[f64]| {
        let (middle, half) = (0.5 * (cell[0] + cell[1]), 0.5 * (cell[1] - cell[0]));
        [-offset, offset].map(|x| (middle + x * half, half))
    };
    knots.windows(2).flat_map(point).unzip()
}
