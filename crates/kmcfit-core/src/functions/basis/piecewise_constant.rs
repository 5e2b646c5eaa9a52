//! Piecewise constant basis: one value per cell.

use super::differences;
use super::knots::KnotSpans;
use super::space::{BasisFunctions, square_integral};
use crate::functions::LocalRows;
use crate::rows::Rows;
use crate::system::Grid;

/// Share of a half step by which a knot at its end may differ from it by rounding.
const ROUNDING: f64 = 1e-9;

/// The indicator functions of the cells.
pub(super) struct PiecewiseConstant {
    knots: KnotSpans,
}

impl PiecewiseConstant {
    /// The basis with cells between `knots` (s).
    pub fn new(knots: &[f64]) -> Self {
        Self {
            knots: KnotSpans::new(knots),
        }
    }

    /// Means over the half steps beside each node: a coefficient that is linear between the nodes has the integral of the function, wherever it
    /// jumps between them, on every grid.
    pub fn at_nodes(&self, grid: &Grid) -> LocalRows {
        let half = 0.5 * grid.step();
        let last = grid.nodes() - 1;
        let window = |i: usize| {
            let from = if i == 0 {
                grid.start()
            } else {
                grid.time(i) - half
            };
            let to = if i == last {
                grid.time(last)
            } else {
                grid.time(i) + half
            };
            let inside = [from + ROUNDING * half, to - ROUNDING * half];
            let [first, last] = inside.map(|t| self.knots.locate(t).0);
            (from, to, first..last + 1)
        };
        let span = (0..=last).map(|i| window(i).2.len()).max().unwrap_or(1);
        let mut rows = LocalRows::new(self.parameters(), span);
        rows.reserve(grid.nodes());
        let times = self.knots.times();
        for i in 0..=last {
            let (from, to, cells) = window(i);
            match cells.len() {
                1 => rows.push(std::iter::once((cells.start, 1.0))),
                _ => rows.push(cells.map(|cell| {
                    let [begins, ends] = [times[cell].max(from), times[cell + 1].min(to)];
                    (cell, (ends - begins).max(0.0) / (to - from))
                })),
            }
        }
        rows
    }

    /// Distances between the centres of neighbouring cells, in s.
    fn centre_distances(&self) -> Vec<f64> {
        let pairs = self.knots.widths().windows(2);
        pairs.map(|w| 0.5 * (w[0] + w[1])).collect()
    }
}

impl BasisFunctions for PiecewiseConstant {
    fn parameters(&self) -> usize {
        self.knots.cells()
    }

    fn degree(&self) -> usize {
        0
    }

    fn breaks(&self) -> Vec<f64> {
        self.knots.times().to_vec()
    }

    fn row(&self, t: f64, derivative: usize, entries: &mut Vec<(usize, f64)>) {
        if derivative == 0 {
            entries.push((self.knots.locate(t).0, 1.0));
        }
    }

    fn roughness(&self, order: usize) -> Rows {
        match order {
            1 => differences::first(&self.centre_distances()),
            2 => differences::second(&self.centre_distances()),
            _ => square_integral(self, order),
        }
    }
}
