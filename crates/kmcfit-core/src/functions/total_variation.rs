//! Total-variation penalties.

use crate::rows::Rows;

/// Penalty `weight * sum_i |(D theta_j)_i|` on one function `j`; the rows of `D` are the changes between neighbouring knots,
/// cells or nodes. Unlike a Tikhonov penalty it is equal for a jump and a slow change of the same height.
#[derive(Debug, Clone)]
pub struct TotalVariation {
    /// Index of the function, mass 0.
    pub function: usize,
    /// Weight, in the unit of J per unit of the function.
    pub weight: f64,
    /// `D`, rows x parameters of the function.
    pub rows: Rows,
}

impl TotalVariation {
    /// Changes `D theta`.
    pub fn changes(&self, theta: &[f64]) -> Vec<f64> {
        self.rows.multiply(theta)
    }

    /// Total variation `sum_i |(D theta)_i|`, without the weight.
    pub fn total(&self, theta: &[f64]) -> f64 {
        self.changes(theta).iter().map(|c| c.abs()).sum()
    }

    /// Adds a subgradient, `weight D^T sign(D theta)`.
    pub fn add_gradient(&self, theta: &[f64], gradient: &mut [f64]) {
        let sign = |c: &f64| {
            if *c == 0.0 {
                0.0
            } else {
                self.weight * c.signum()
            }
        };
        let signs: Vec<f64> = self.changes(theta).iter().map(sign).collect();
        self.rows.transpose_multiply_add(&signs, gradient);
    }
}
