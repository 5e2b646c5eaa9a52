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
}

#[cfg(test)]
mod tests {
    use super::*;

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
