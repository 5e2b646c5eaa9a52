//! Losses of residuals in units of their standard deviation.

/// Loss `rho(u)` of a residual `u = r / sigma`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// Least squares, `u^2`.
    #[default]
    Squares,
    /// Huber loss: `u^2` up to the threshold, `2 threshold |u| - threshold^2` beyond (Huber 1964).
    Huber {
        /// Threshold in standard deviations; 1.345 keeps 95 % of the efficiency of least squares.
        threshold: f64,
    },
    /// Student's t: `(nu + 1) ln(1 + u^2 / nu)`, twice the negative log-likelihood.
    StudentT {
        /// Degrees of freedom `nu`.
        degrees: f64,
    },
}

impl Loss {
    /// Value `rho(u)`.
    #[inline]
    pub fn cost(self, u: f64) -> f64 {
        match self {
            Self::Squares => u * u,
            Self::Huber { threshold } if u.abs() > threshold => {
                threshold * (2.0 * u.abs() - threshold)
            }
            Self::Huber { .. } => u * u,
            Self::StudentT { degrees } => (degrees + 1.0) * (u * u / degrees).ln_1p(),
        }
    }

    /// Weight `rho'(u) / (2 u)` of `u` in the least-squares problem with the same gradient. `rho` is concave in `u^2`, so that problem is
    /// a majorant that touches it at `u`.
    #[inline]
    pub fn weight(self, u: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber { threshold } if u.abs() > threshold => threshold / u.abs(),
            Self::Huber { .. } => 1.0,
            Self::StudentT { degrees } => (degrees + 1.0) / (degrees + u * u),
        }
    }

    /// Derivative of the score `psi(u) = rho'(u) / 2 = weight(u) u`.
    fn score_slope(self, u: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber { threshold } => f64::from(u.abs() <= threshold),
            Self::StudentT { degrees } => {
                (degrees + 1.0) * (degrees - u * u) / (degrees + u * u).powi(2)
            }
        }
    }

    /// Ratio of the information of samples with the normalised residuals `u` to that of the majorant, whose weights are
    /// `weight(u)`: an M-estimator has the variance `E psi^2 / (E psi')^2` of the mean in place of `1 / E weight` (Huber 1964). With
    /// scores of a known covariance the ratio is that of the curvatures, squared. 1 for least squares.
    pub(crate) fn information_ratio(self, u: &[f64], has_score_covariance: bool) -> f64 {
        let mean = |of: &dyn Fn(f64) -> f64| u.iter().map(|u| of(*u)).sum::<f64>() / u.len() as f64;
        let weight = mean(&|u| self.weight(u));
        let slope = mean(&|u| self.score_slope(u)).max(0.0);
        let ratio = match has_score_covariance {
            true => (slope / weight).powi(2),
            false => slope * slope / (mean(&|u| (self.weight(u) * u).powi(2)) * weight),
        };
        if self == Self::Squares || !ratio.is_finite() {
            return 1.0;
        }
        ratio
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    /// Residuals of Student's t distribution under its own loss: the weights have the mean 1, the Fisher information of a sample is
    /// `(nu + 1) / (nu + 3)`. Quantiles at 20,000 equal steps of the probability leave an error of some thousandths.
    #[test]
    fn the_information_of_students_t_is_that_of_fisher() {
        let count = 20_000;
        for degrees in [3.0, 5.0, 10.0] {
            let law = StudentsT::new(0.0, 1.0, degrees).expect("a distribution");
            let quantile = |i: usize| law.inverse_cdf((i as f64 + 0.5) / count as f64);
            let u: Vec<f64> = (0..count).map(quantile).collect();
            let ratio = Loss::StudentT { degrees }.information_ratio(&u, false);
            let expected = (degrees + 1.0) / (degrees + 3.0);
            assert!(
                (ratio - expected).abs() < 0.005,
                "{degrees}: {ratio} {expected}"
            );
        }
        assert_eq!(Loss::Squares.information_ratio(&[1.0, 2.0], false), 1.0);
    }

    #[test]
    fn the_weight_is_the_slope_over_twice_the_residual() {
        let losses = [
            Loss::Squares,
            Loss::Huber { threshold: 1.345 },
            Loss::StudentT { degrees: 4.0 },
        ];
        for loss in losses {
            for u in [-30.0, -1.4, -1.3, 0.2, 0.9, 2.0, 11.0] {
                let h = 1e-5;
                let slope = (loss.cost(u + h) - loss.cost(u - h)) / (2.0 * h);
                let expected = 2.0 * u * loss.weight(u);
                // Central differences: h^2 and rounding / h.
                assert!((slope - expected).abs() < 1e-7, "{loss:?} at {u}");
            }
        }
    }
}
