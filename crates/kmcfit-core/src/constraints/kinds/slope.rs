//! Bounds of slopes.

use super::linear_form::{LinearForm, group};
use super::sampling::slope;
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use crate::functions::Basis;

pub(super) fn build(
    all: &All<'_>,
    j: usize,
    min: Option<f64>,
    max: Option<f64>,
) -> Result<Vec<RowGroup>, ConstraintError> {
    let name = all.name(j);
    let forms = slopes(all, j);
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    let both = [
        (">=", min, min.map(|min| [min, high])),
        ("<=", max, max.map(|max| [low, max])),
    ];
    let given = both
        .iter()
        .filter_map(|(sign, value, bounds)| Some((sign, (*value)?, (*bounds)?)));
    given
        .map(|(sign, value, bounds)| {
            group(format!("slope of {name} {sign} {value}"), &forms, |_| {
                bounds
            })
        })
        .collect()
}

/// Slopes of a function: of every cell, at every node for smooth bases, and between the centres of neighbouring cells for
/// functions with jumps.
pub(super) fn slopes(all: &All<'_>, j: usize) -> Vec<LinearForm> {
    let Some(Basis::PiecewiseConstant { knots }) = &all.list[j].basis else {
        return all.sum(&[slope(j, 1.0)], &[]);
    };
    let first = all.functions.ranges()[j].start;
    let difference = |(i, knots): (usize, &[f64])| {
        let distance = 0.5 * (knots[2] - knots[0]);
        LinearForm {
            entries: vec![
                (first + i, -1.0 / distance),
                (first + i + 1, 1.0 / distance),
            ],
            constant: 0.0,
            time: knots[1],
            span: [knots[1], knots[1]],
        }
    };
    knots.windows(3).enumerate().map(difference).collect()
}
