//! Piecewise constant basis: one value per cell.

use super::differences;
use super::knots::KnotSpans;
use super::space::{BasisFunctions, square_integral};
use crate::rows::Rows;

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
