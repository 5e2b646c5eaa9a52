//! Piecewise linear basis: one value per knot, linear in between.

use super::differences;
use super::knots::KnotSpans;
use super::space::{BasisFunctions, square_integral};
use crate::rows::Rows;
use crate::system::Grid;

/// Hat functions: 1 at their own knot, 0 at all others.
pub(super) struct PiecewiseLinear {
    knots: KnotSpans,
}

impl PiecewiseLinear {
    /// The basis with the knots `knots` (s).
    pub fn new(knots: &[f64]) -> Self {
        Self {
            knots: KnotSpans::new(knots),
        }
    }

    /// The basis with the nodes of `grid` as knots.
    pub fn on_nodes(grid: &Grid) -> Self {
        Self {
            knots: KnotSpans::nodes(grid),
        }
    }
}

impl BasisFunctions for PiecewiseLinear {
    fn parameters(&self) -> usize {
        self.knots.times().len()
    }

    fn degree(&self) -> usize {
        1
    }

    fn breaks(&self) -> Vec<f64> {
        self.knots.times().to_vec()
    }

    fn row(&self, t: f64, derivative: usize, entries: &mut Vec<(usize, f64)>) {
        let (cell, t) = self.knots.locate(t);
        let width = self.knots.widths()[cell];
        let (before, after) = (self.knots.times()[cell], self.knots.times()[cell + 1]);
        match derivative {
            0 => {
                // Exactly 1 at the next knot, for every rounding of the width.
                let share = match t < after {
                    true => ((t - before) / width).min(1.0),
                    false => 1.0,
                };
                entries.extend([(cell, 1.0 - share), (cell + 1, share)]);
            }
            1 => entries.extend([(cell, -1.0 / width), (cell + 1, 1.0 / width)]),
            _ => {}
        }
    }

    fn roughness(&self, order: usize) -> Rows {
        match order {
            2 => differences::second(self.knots.widths()),
            _ => square_integral(self, order),
        }
    }
}
