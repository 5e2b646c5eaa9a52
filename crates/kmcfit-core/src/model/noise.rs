//! Keys of the correlation of noise and of the errors of inputs.

use super::{ScalarOr, words};
use schemars::JsonSchema;
use serde::Deserialize;

/// Correlation of the noise of each channel.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "noises", extend("expecting" = "a map such as {displacement: auto}"))]
pub struct NoisesSpec {
    /// Noise of the displacement.
    #[schemars(extend("example" = "white", "default" = "auto"))]
    pub displacement: Option<ScalarOr<CorrelationName, CorrelationSpec>>,
    /// Noise of the velocity.
    #[schemars(extend("example" = "auto", "default" = "auto"))]
    pub velocity: Option<ScalarOr<CorrelationName, CorrelationSpec>>,
    /// Noise of the acceleration.
    #[schemars(extend("example" = "{ar: 2}", "default" = "auto"))]
    pub acceleration: Option<ScalarOr<CorrelationName, CorrelationSpec>>,
}

/// Autoregressive noise of a given order.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "correlation", extend("expecting" = "a map such as {ar: 2}"))]
pub struct CorrelationSpec {
    /// Order of the autoregressive process.
    #[schemars(extend("example" = "2", "range" = "1 to 12", "needs" = "equally spaced samples, with or without gaps"))]
    pub ar: usize,
}

words! {
    /// Correlation of noise in time.
    pub enum CorrelationName {
        /// Autoregressive, of the order that the residuals show.
        Auto = "auto",
        /// Uncorrelated.
        White = "white",
    }
}

/// Independent errors of the samples of an input.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "input-sigma", extend("expecting" = "a map such as {value: 0.5, kind: sensor}"))]
pub struct InputSigmaSpec {
    /// Standard deviation, in N or m/s^2.
    #[schemars(extend("example" = "0.5", "range" = "greater than 0"))]
    pub value: f64,
    /// What the errors are errors of.
    #[schemars(extend("example" = "sensor"))]
    pub kind: InputErrorName,
}

words! {
    /// What the errors of an input are errors of.
    pub enum InputErrorName {
        /// Noise of the sensor of the input: the system received the true input, which differs from the samples.
        Sensor = "sensor",
        /// Unmeasured part of the drive: the system received the samples and further, independent input.
        Drive = "drive",
    }
}
