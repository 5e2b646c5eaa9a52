//! Parts of the document about channels and scalars.

use kmcfit_core::internals::assessment::ResidualPattern;
use kmcfit_core::internals::solvers::number_or_nan;
use serde::{Deserialize, Serialize};

/// One channel of an experiment at the best point, in its own unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelSummary {
    /// `displacement`, `velocity` or `acceleration`.
    pub kind: String,
    /// Unit of the numbers here: that of the file.
    pub unit: String,
    /// Number of readings that are used.
    pub readings: usize,
    /// Readings that are not used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignored: Vec<IgnoredSummary>,
    /// Number of samples rejected as outliers under a robust loss ([`kmcfit_core::internals::diagnostics::far_off`]);
    /// rms, fit and whiteness are those of the other samples.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub outliers: usize,
    /// Root-mean-square residual.
    #[serde(deserialize_with = "number_or_nan")]
    pub rms_residual: f64,
    /// `100 (1 - |residual| / |reading - mean|)`.
    #[serde(deserialize_with = "number_or_nan")]
    pub fit_percent: f64,
    /// Standard deviation of a reading, where there is one for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// Whether that was estimated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub sigma_estimated: bool,
    /// Whether the loss is a robust one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub robust: bool,
    /// What the residuals have that is neither noise nor motion, if there is anything of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<ResidualPattern>,
    /// What the channel adds to J.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost: f64,
    /// Whether the residuals look white, in words.
    pub whiteness: String,
    /// p-value of the Ljung-Box test of whiteness; `null` where it could not be made.
    pub whiteness_p_value: Option<f64>,
    /// Autocorrelation of the residuals at lags 0, 1, ...
    pub autocorrelation: Vec<f64>,
    /// That of white noise lies below this in 95 of 100 lags.
    #[serde(deserialize_with = "number_or_nan")]
    pub autocorrelation_band: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Readings that are not used, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IgnoredSummary {
    /// How many.
    pub readings: usize,
    /// Why.
    pub reason: String,
}

/// A number that was fitted beside the functions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NuisanceParameter {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Value found.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Standard error from the linearised fit, without constraints, penalties and priors; `null`
    /// where the readings do not determine all parameters.
    pub standard_error: Option<f64>,
}

/// An experiment that took no part in the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidationSummary {
    /// Name.
    pub name: String,
    /// Fit of each channel.
    pub channels: Vec<ChannelSummary>,
    /// What was found from its own readings: its initial state, its sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nuisance_parameters: Vec<NuisanceParameter>,
    /// Why there is no prediction, if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl ValidationSummary {
    /// Its name in tables.
    pub(in crate::report) fn title(&self) -> String {
        format!("{} (validation)", self.name)
    }
}
