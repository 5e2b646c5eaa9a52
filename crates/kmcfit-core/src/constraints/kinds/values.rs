//! Fixed value of a function at one time.

use super::linear_form::group;
use super::{All, ConstraintError};
use crate::constraints::RowGroup;

/// Largest distance from a knot, in steps, of a time that is taken as the knot.
const SAME_TIME: f64 = 1e-6;

pub(super) fn build(
    all: &All<'_>,
    j: usize,
    at: f64,
    value: f64,
) -> Result<RowGroup, ConstraintError> {
    let knots = (all.list[j].basis.as_ref()).map_or(Vec::new(), |b| b.knot_times(all.grid));
    let after = knots.partition_point(|knot| *knot < at);
    let around = knots[after.saturating_sub(1)..].iter().take(2);
    let near = around
        .copied()
        .find(|knot| (knot - at).abs() <= SAME_TIME * all.grid.step());
    let forms = all.forms(j, 0, &[near.unwrap_or(at)]);
    let name = format!("{}({at}) = {value}", all.name(j));
    group(name, &forms, |_| [value, value])
}
