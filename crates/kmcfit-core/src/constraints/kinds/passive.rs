//! Passivity: the stored energy `m v^2/2 + k y^2/2` of a free system never grows.

use super::linear_form::group;
use super::sampling::{slope, value};
use super::shape::DOWN;
use super::slope::slopes;
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use crate::functions::Basis;

pub(super) fn build(
    all: &All<'_>,
    [m, c, k]: [usize; 3],
) -> Result<Vec<RowGroup>, ConstraintError> {
    let mut groups = Vec::new();
    let mut parts = vec![value(c, 1.0)];
    if let Some(Basis::PiecewiseConstant { .. }) = all.list[m].basis {
        // Within cells m' is zero; an upward jump of m is an unbounded slope.
        let jumps = slopes(all, m);
        groups.push(group("passive: m does not jump up", &jumps, |_| DOWN)?);
    } else {
        parts.push(slope(m, -0.5));
    }
    let damping = all.sum(&parts, &[]);
    groups.push(group("passive: c >= m'/2", &damping, |_| {
        [0.0, f64::INFINITY]
    })?);
    groups.push(group("passive: k' <= 0", &slopes(all, k), |_| DOWN)?);
    Ok(groups)
}
