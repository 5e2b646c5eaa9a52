//! Diagnostics of residuals: size, autocorrelation, whiteness, outliers, and information criteria.
//!
//! All functions are pure functions of numbers, independent of problems and files.

mod autocorrelation;
mod information;
#[cfg(test)]
pub(crate) mod noise;
mod pattern;
mod quantiles;
mod record;
mod residuals;
mod whiteness;
mod words;

pub(crate) use autocorrelation::{Autocorrelation, NORMAL_975, autocorrelation, default_lags};
pub(crate) use information::{InformationCriteria, with_estimated_sigma, with_known_sigma};
pub(crate) use pattern::median_size;
pub use pattern::{offset_and_drift, outlier_indices};
pub use quantiles::{chi_square_one, normal_half_width, student_half_width};
pub use record::ResidualDiagnostics;
pub(crate) use record::ResidualRecord;
pub(crate) use residuals::fit_percent;
pub use residuals::rms;
pub use residuals::{detrended, standard_deviation};
pub(crate) use whiteness::{FEWEST_SAMPLES, UntestedReason, WhitenessResult, whiteness};
pub use whiteness::{SIGNIFICANCE, Whiteness};
