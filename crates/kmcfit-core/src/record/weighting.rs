//! Weights of residuals.

/// Weights of the residuals of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum Weighting {
    /// `J = integral r^2 dt` by the trapezoid rule over equally spaced samples (Eq. 1), in m^2 s.
    Integral {
        /// Spacing of the samples, s.
        spacing: f64,
    },
    /// The same integral over samples at arbitrary times.
    Trapezoid(
        /// One weight per sample, s.
        Vec<f64>,
    ),
    /// Chi-square `J = sum (r / sigma)^2`, without a factor 1/2 and without `dt`.
    Sigma(
        /// Standard deviation of a sample, in the unit of the channel.
        f64,
    ),
    /// Chi-square with an estimated standard deviation, at its present value.
    Estimated {
        /// Standard deviation, in the unit of the channel.
        sigma: f64,
    },
    /// Chi-square with a standard deviation for each sample.
    Sigmas(
        /// One standard deviation per sample.
        Vec<f64>,
    ),
}

impl Weighting {
    /// True if samples have a standard deviation, so that J is a chi-square.
    pub fn is_sigma(&self) -> bool {
        !matches!(self, Self::Integral { .. } | Self::Trapezoid(_))
    }

    /// Standard deviation of sample `i`; `None` for the integral cost.
    #[inline]
    pub fn sigma(&self, i: usize) -> Option<f64> {
        match self {
            Self::Sigma(sigma) | Self::Estimated { sigma } => Some(*sigma),
            Self::Sigmas(sigmas) => sigmas.get(i).copied(),
            Self::Integral { .. } | Self::Trapezoid(_) => None,
        }
    }

    /// Weight `w_i` of sample `i` of `count`, so that `J = sum w_i r_i^2`.
    #[inline]
    pub fn weight(&self, i: usize, count: usize) -> f64 {
        match self {
            Self::Integral { spacing } if i == 0 || i + 1 == count => 0.5 * spacing,
            Self::Integral { spacing } => *spacing,
            Self::Trapezoid(weights) => weights[i],
            Self::Sigma(sigma) | Self::Estimated { sigma } => 1.0 / (sigma * sigma),
            Self::Sigmas(sigmas) => 1.0 / (sigmas[i] * sigmas[i]),
        }
    }

    /// Keeps the first `count` samples.
    pub(super) fn truncate(&mut self, count: usize) {
        match self {
            Self::Trapezoid(list) | Self::Sigmas(list) => list.truncate(count),
            Self::Integral { .. } | Self::Sigma(_) | Self::Estimated { .. } => {}
        }
    }
}
