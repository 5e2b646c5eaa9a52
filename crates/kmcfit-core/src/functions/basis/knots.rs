//! Knots and the cells between them.

use crate::system::Grid;

/// Largest distance of a time from a knot, relative to the record, to be taken as the knot: far above rounding errors of node
/// times, far below a step.
const SAME_TIME: f64 = 1e-12;

/// `count` equally spaced knots over the record, both ends included, in s.
///
/// # Panics
/// If there are fewer than two.
pub fn uniform_knots(grid: &Grid, count: usize) -> Vec<f64> {
    assert!(count >= 2, "at least two knots");
    let (start, end) = (grid.start(), grid.time(grid.nodes() - 1));
    let last = count - 1;
    let knot = |j: usize| match j {
        _ if j == last => end,
        _ => start + (end - start) * (j as f64 / last as f64),
    };
    (0..count).map(knot).collect()
}

/// Increasing times and the cells between them.
#[derive(Debug, Clone)]
pub(super) struct KnotSpans {
    times: Vec<f64>,
    widths: Vec<f64>,
    slack: f64,
}

impl KnotSpans {
    /// Cells between `times` (s).
    pub fn new(times: &[f64]) -> Self {
        let widths = times.windows(2).map(|w| w[1] - w[0]).collect();
        Self::with_widths(times.to_vec(), widths)
    }

    /// Steps of the grid as cells of exactly equal width.
    pub fn nodes(grid: &Grid) -> Self {
        Self::with_widths(grid.times(), vec![grid.step(); grid.nodes() - 1])
    }

    fn with_widths(times: Vec<f64>, widths: Vec<f64>) -> Self {
        let (first, last) = (times[0], times[times.len() - 1]);
        let rounding = 4.0 * f64::EPSILON * first.abs().max(last.abs());
        Self {
            slack: SAME_TIME * (last - first) + rounding,
            times,
            widths,
        }
    }

    /// Times of the knots, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Widths of the cells, s.
    pub fn widths(&self) -> &[f64] {
        &self.widths
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.widths.len()
    }

    /// Cell of a time, at a knot the one after it; and the time clipped to the cell.
    pub fn locate(&self, t: f64) -> (usize, f64) {
        let passed = self.times.partition_point(|knot| *knot <= t + self.slack);
        let cell = passed.clamp(1, self.cells()) - 1;
        (cell, t.clamp(self.times[cell], self.times[cell + 1]))
    }
}
