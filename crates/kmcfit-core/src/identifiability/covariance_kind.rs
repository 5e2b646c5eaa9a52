//! Kinds of covariances of estimates.

use serde::{Deserialize, Serialize};

/// Kind of the covariance of estimates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CovarianceKind {
    /// Inverse of the information of the samples, `(J^T W J)^-1`.
    #[default]
    Information,
    /// Sandwich of penalised estimates, which excludes the smoothing bias.
    Penalised,
    /// Inverse Hessian with the penalties as prior, which includes the smoothing bias on average.
    Bayesian,
    /// Heteroscedasticity- and autocorrelation-consistent: sandwich with the kernel covariance of the scores
    /// ([`crate::noise::KernelCovariance`]).
    Kernel,
}

impl CovarianceKind {
    /// True for the inverse of the information of the samples.
    pub fn is_information(&self) -> bool {
        *self == Self::Information
    }
}
