//! The basis of a constant that jumps.

use crate::functions::Basis;
use crate::system::Grid;

/// Longest middle cell as a share of the record: that of a jump found on another grid.
const SHORT: f64 = 0.01;

/// The time of the node nearest to a time.
pub(super) fn node_time(grid: &Grid, time: f64) -> f64 {
    grid.start() + ((time - grid.start()) / grid.step()).round() * grid.step()
}

/// Cells before and after a jump, and that of the node at it: its value, between those before and after, states the time within the step.
pub(super) fn basis(grid: &Grid, time: f64) -> Option<Basis> {
    let (middle, half) = (node_time(grid, time), 0.5 * grid.step());
    let (start, end) = (grid.start(), grid.start() + grid.duration());
    let knots = vec![start, middle - half, middle + half, end];
    (knots.is_sorted_by(|a, b| a < b)).then_some(Basis::PiecewiseConstant { knots })
}

/// True for the basis of a jump.
pub(super) fn is_jump(grid: &Grid, basis: &Basis) -> bool {
    match basis {
        Basis::PiecewiseConstant { knots } => match knots.as_slice() {
            [_, a, b, _] => b - a < (1.5 * grid.step()).max(SHORT * grid.duration()),
            _ => false,
        },
        _ => false,
    }
}
