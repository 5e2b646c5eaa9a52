//! Correlation of measurement noise in time: autoregressive models, their estimation from residuals, and the whitening of
//! residuals and Jacobians.
//!
//! The noise `u_i` of a channel has the standard deviation `sigma_i` and the correlation matrix `R` of
//!
//! ```text
//! u_i/sigma_i = a_1 u_(i-1)/sigma_(i-1) + ... + a_p u_(i-p)/sigma_(i-p) + e_i      equally spaced samples, AR(p)
//! R_ij = exp(-|t_i - t_j| / tau)                                                  other samples, AR(1) in continuous time
//! ```
//!
//! With a lower triangular `W`, `W R W^T = I` ([`Correlation::whiten`]), minus twice the logarithm of the likelihood is
//! `|W (r/sigma)|^2 + log |R| + sum log(2 pi sigma_i^2)`. All functions here are functions of numbers, independent of problems.

mod autoregression;
mod burg;
mod correlation;
mod exponential;
mod gaps;
mod input_errors;
mod kernel_covariance;
mod order;
mod penalty_moments;
mod restricted_likelihood;

pub(crate) use autoregression::Autoregression;
pub(crate) use burg::burg;
pub(crate) use correlation::uninterrupted_runs;
pub use correlation::{Correlation, CorrelationLaw};
pub(crate) use exponential::select_exponential;
pub(crate) use input_errors::{InputErrors, InputRow, InputStep};
pub(crate) use kernel_covariance::KernelCovariance;
pub use kernel_covariance::automatic_bandwidth;
pub(crate) use order::{HIGHEST_ORDER, select_order};
pub(crate) use penalty_moments::PenaltyMoments;
pub(crate) use restricted_likelihood::{
    ChannelMoments, NoiseCoordinates, RestrictedLikelihood, STEP,
};
