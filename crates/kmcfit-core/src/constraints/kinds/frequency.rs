//! Bounds of the natural frequency.

use super::linear_form::group;
use super::sampling::value;
use super::shape::{DOWN, UP};
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use std::f64::consts::TAU;

pub(super) fn build(
    all: &All<'_>,
    [m, k]: [usize; 2],
    min: Option<f64>,
    max: Option<f64>,
) -> Result<Vec<RowGroup>, ConstraintError> {
    let one = |frequency: f64, sign: &str, bounds: [f64; 2]| {
        let omega = TAU * frequency;
        let forms = all.sum(&[value(k, 1.0), value(m, -omega * omega)], &[]);
        group(format!("frequency {sign} {frequency} Hz"), &forms, |_| {
            bounds
        })
    };
    let min = min.map(|f| one(f, ">=", UP));
    let max = max.map(|f| one(f, "<=", DOWN));
    min.into_iter().chain(max).collect()
}
