//! Soft constraints: penalties on violations.

use super::RowGroup;

/// Smallest violation reported as slack, relative to the row's scale.
const SLACK: f64 = 1e-9;

impl RowGroup {
    /// Signed violation of row `i`: positive above the upper bound, negative below the lower one, 0 inside.
    pub fn excess(&self, i: usize, theta: &[f64]) -> f64 {
        let value: f64 = self.rows.row(i).map(|(j, a)| a * theta[j]).sum();
        let [lower, upper] = self.bounds(i);
        (value - upper).max(0.0) - (lower - value).max(0.0)
    }

    /// Penalty of the group at `theta`, `weight * mean over its rows of excess^2`; 0 for a group that is not soft.
    pub fn price(&self, theta: &[f64]) -> f64 {
        let squares: f64 = (0..self.rows.len())
            .map(|i| self.excess(i, theta).powi(2))
            .sum();
        self.row_weight() * squares
    }

    /// Weight of the squared excess of one row.
    pub fn row_weight(&self) -> f64 {
        self.soft.unwrap_or(0.0) / (self.rows.len().max(1) as f64)
    }

    /// Adds the gradient of [`RowGroup::price`].
    pub fn add_price_gradient(&self, theta: &[f64], gradient: &mut [f64]) {
        for i in 0..self.rows.len() {
            let push = 2.0 * self.row_weight() * self.excess(i, theta);
            if push != 0.0 {
                self.rows.row(i).for_each(|(j, a)| gradient[j] += push * a);
            }
        }
    }

    /// Rows violated at `theta`, and the largest violation.
    pub fn slack(&self, theta: &[f64]) -> (Vec<usize>, f64) {
        let broken = |&i: &usize| self.relative_violation(i, theta) > SLACK;
        let rows: Vec<usize> = (0..self.rows.len()).filter(broken).collect();
        let most = rows
            .iter()
            .map(|&i| self.excess(i, theta).abs())
            .fold(0.0, f64::max);
        (rows, most)
    }
}
