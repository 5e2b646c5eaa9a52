//! Noise of a channel: model and estimated correlation.

use crate::noise::Correlation;
use nalgebra::DMatrix;

/// Model of the correlation of a channel's noise in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseModel {
    /// Uncorrelated.
    White,
    /// Autoregressive, with the order chosen by the Bayesian information criterion from 0 to
    /// [`HIGHEST_ORDER`](crate::noise::HIGHEST_ORDER); for samples that are not equally spaced an exponential
    /// correlation, or none.
    #[default]
    Auto,
    /// Autoregressive of this order, for equally spaced samples with or without gaps.
    Autoregressive {
        /// Order, from 1 to [`HIGHEST_ORDER`](crate::noise::HIGHEST_ORDER).
        order: usize,
    },
}

/// Covariance of the scores of a channel, the derivatives of its misfit by the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScoreCovariance {
    /// That of the noise model: independent innovations of equal variance.
    #[default]
    Model,
    /// Consistent under heteroscedasticity and autocorrelation, by a kernel
    /// ([`KernelCovariance`](crate::noise::KernelCovariance)): for innovations that are not white.
    Kernel,
}

/// Estimated noise of a channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseEstimate {
    /// Correlation; `None` for white noise.
    pub correlation: Option<Correlation>,
    /// Covariance of the estimated noise parameters: the logarithm of sigma where it is estimated, then the coordinates of
    /// the correlation ([`Correlation::coordinates`]). Without rows where the
    /// noise counts as known.
    pub covariance: DMatrix<f64>,
    /// Covariance of the scores.
    pub scores: ScoreCovariance,
}
