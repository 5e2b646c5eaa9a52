//! Constant basis: one value for all times.

use super::knots::uniform_knots;
use super::space::BasisFunctions;
use crate::system::Grid;

/// The function 1.
pub(super) struct Constant {
    ends: Vec<f64>,
}

impl Constant {
    /// The basis on the record.
    pub fn on(grid: &Grid) -> Self {
        Self {
            ends: uniform_knots(grid, 2),
        }
    }
}

impl BasisFunctions for Constant {
    fn parameters(&self) -> usize {
        1
    }

    fn degree(&self) -> usize {
        0
    }

    fn breaks(&self) -> Vec<f64> {
        self.ends.clone()
    }

    fn row(&self, _: f64, derivative: usize, entries: &mut Vec<(usize, f64)>) {
        if derivative == 0 {
            entries.push((0, 1.0));
        }
    }
}
