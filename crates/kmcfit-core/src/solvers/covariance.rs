//! How well the readings determine the parameters, at one point.

use super::linearization::weighted_jacobian;
use crate::objective::Evaluation;
use crate::problem::Problem;
use nalgebra::DMatrix;

/// Up to so many parameters the covariance is formed.
const MOST_PARAMETERS: usize = 64;
/// A singular value of the scaled Jacobian below this share of the largest is a direction that the
/// readings do not see.
const UNSEEN: f64 = 1e-10;

impl Problem {
    /// Covariance of the parameters at an evaluated point, from the linearised predictions:
    /// `(J^T W J)^-1` with `W = 1/sigma^2` where the readings have a sigma (the Cramer-Rao bound for
    /// Gaussian noise), else times the residuals' mean square. Penalties, constraints and priors do
    /// not count. `None` where some direction is not seen, there are too many parameters, or
    /// noise is neither given nor left by the fit.
    pub fn covariance(&self, evaluation: &Evaluation) -> Option<DMatrix<f64>> {
        let n = self.parameters();
        let readings = self.reading_count();
        if n == 0 || n > MOST_PARAMETERS || readings <= n {
            return None;
        }
        let (mut jacobian, residuals) = weighted_jacobian(self, evaluation);
        // Parameters have units: only a Jacobian with columns of one size has singular values.
        let sizes: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
        // A decomposition of numbers that are not finite would not end.
        if sizes.iter().any(|s| !s.is_finite() || *s <= 0.0) {
            return None;
        }
        for (mut column, size) in jacobian.column_iter_mut().zip(&sizes) {
            column /= *size;
        }
        // The triangular factor has the same singular values and right vectors, and n rows.
        let svd = jacobian.qr().r().svd(false, true);
        let largest = svd.singular_values.max();
        let v = svd.v_t?.transpose();
        if svd.singular_values.min() <= UNSEEN * largest {
            return None;
        }
        let known = self.channels().all(|c| c.weighting().is_sigma());
        let scale = match known {
            true => 1.0,
            false => residuals.norm_squared() / (readings - n) as f64,
        };
        let mut covariance = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                let terms = svd.singular_values.iter().enumerate();
                let sum: f64 = terms.map(|(k, s)| v[(i, k)] * v[(j, k)] / (s * s)).sum();
                covariance[(i, j)] = scale * sum / (sizes[i] * sizes[j]);
            }
        }
        // A fit that leaves nothing says nothing of the noise.
        (scale > 0.0).then_some(covariance)
    }
}
