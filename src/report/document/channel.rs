//! Channels and validation records in the result document.

use super::{is_one, one};
use kmcfit_core::assessment::ResidualPattern;
use kmcfit_core::identifiability::Quantity;
use kmcfit_core::number_format::number_or_nan;
use serde::{Deserialize, Serialize};

/// One channel of an experiment at the best point, in its own unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelSummary {
    /// `displacement`, `velocity` or `acceleration`.
    pub kind: String,
    /// Unit of the values, that of the file.
    pub unit: String,
    /// Number of used samples.
    pub samples: usize,
    /// Samples between the rows of its table: 1, more in long records.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub samples_per_row: usize,
    /// Unused samples.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignored: Vec<IgnoredSummary>,
    /// Number of samples rejected as outliers under a robust loss ([`kmcfit_core::diagnostics::outlier_indices`]);
    /// rms, fit and whiteness are those of the other samples.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub outliers: usize,
    /// Root-mean-square residual.
    #[serde(deserialize_with = "number_or_nan")]
    pub rms_residual: f64,
    /// `100 (1 - |residual| / |sample - mean|)`.
    #[serde(deserialize_with = "number_or_nan")]
    pub fit_percent: f64,
    /// Standard deviation of a sample; `null` if it differs between samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// True if sigma was estimated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub sigma_estimated: bool,
    /// Correlation of the noise, where it is correlated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseSummary>,
    /// True for a robust loss.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub robust: bool,
    /// Pattern in the residuals beside noise and response, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<ResidualPattern>,
    /// Contribution to J.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost: f64,
    /// Result of the test of whiteness of the residuals, or of the innovations of correlated noise, as text.
    pub whiteness: String,
    /// p-value of the Ljung-Box test of whiteness; `null` if the test is not possible.
    pub whiteness_p_value: Option<f64>,
    /// Autocorrelation of the residuals, or of the innovations, at lags 0, 1, ...
    pub autocorrelation: Vec<f64>,
    /// Bound on the autocorrelation of white noise, exceeded at 5 % of the lags.
    #[serde(deserialize_with = "number_or_nan")]
    pub autocorrelation_band: f64,
}

/// Correlation of the noise of a channel in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseSummary {
    /// Coefficients `a_1, ..., a_p` of the autoregressive process `u_i = a_1 u_(i-1) + ... + a_p u_(i-p) + e_i`; empty for an
    /// exponential correlation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coefficients: Vec<f64>,
    /// Standard deviation of the innovations `e` relative to that of the noise.
    pub innovation_share: f64,
    /// Correlation time (s) of samples that are not equally spaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation_time: Option<f64>,
    /// True if the correlation is that of the response to stated errors of the input.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub input_errors: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Unused samples and the reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IgnoredSummary {
    /// Number of samples.
    pub samples: usize,
    /// Reason.
    pub reason: String,
}

/// A validation record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidationSummary {
    /// Name.
    pub name: String,
    /// Fit of each channel.
    pub channels: Vec<ChannelSummary>,
    /// Parameters estimated from its own samples: initial state, sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nuisance_parameters: Vec<Quantity>,
    /// Reason for a missing prediction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl ValidationSummary {
    /// Its name in tables.
    pub(in crate::report) fn title(&self) -> String {
        format!("{} (validation)", self.name)
    }
}
