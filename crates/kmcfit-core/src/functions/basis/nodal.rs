//! One value per node, linear in between: the paper's choice.

use super::knots::Knots;
use super::piecewise_linear::PiecewiseLinear;
use crate::dynamics::Grid;

/// Piecewise linear functions with the nodes as knots.
pub(super) fn on(grid: &Grid) -> PiecewiseLinear {
    PiecewiseLinear::on(Knots::nodes(grid))
}
