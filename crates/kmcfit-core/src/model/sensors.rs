//! Keys of sensors, and scalars that are known or estimated.

use super::EstimateWord;
use crate::functions::Prior;
use schemars::JsonSchema;
use serde::Deserialize;

/// Sensor of each channel: sample = gain * response(t - delay) + offset + drift * time; delay of the force or of the base motion.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "sensors", extend("expecting" = "a map such as {acceleration: {offset: estimate}}"))]
pub struct SensorsSpec {
    /// Sensor of the displacement.
    #[schemars(extend("example" = "{drift: estimate}"))]
    pub displacement: Option<SensorSpec>,
    /// Sensor of the velocity.
    #[schemars(extend("example" = "{gain: estimate}"))]
    pub velocity: Option<SensorSpec>,
    /// Sensor of the acceleration.
    #[schemars(extend("example" = "{offset: estimate}"))]
    pub acceleration: Option<SensorSpec>,
    /// Sensor of the force.
    #[schemars(extend("example" = "{delay: estimate}", "needs" = "`columns.force`, no motion of the base"))]
    pub force: Option<InputSensorSpec>,
    /// Sensor of the acceleration of the base.
    #[schemars(extend("example" = "{delay: 0.002}", "needs" = "`columns.base_acceleration`, no force"))]
    pub base_acceleration: Option<InputSensorSpec>,
    /// Sensor of the displacement of the base.
    #[schemars(extend("example" = "{delay: 0.002}", "needs" = "`columns.base_displacement`, no force"))]
    pub base_displacement: Option<InputSensorSpec>,
}

/// Sensor of an input.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "input-sensor", extend("expecting" = "a map such as {delay: estimate}"))]
pub struct InputSensorSpec {
    /// Delay of its samples against the response: positive where they are late. Coefficients are then functions of the time of the input.
    #[schemars(extend("example" = "estimate", "unit" = "s", "default" = "0"))]
    pub delay: Option<DelayValue>,
}

/// A delay: a number, `estimate`, or an estimate with limits.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum DelayValue {
    /// Known, s.
    Known(f64),
    /// Estimated, from 0.
    Estimate(EstimateWord),
    /// Estimated within limits.
    Estimated(DelaySpec),
}

impl DelayValue {
    /// Estimated from a start value, in s.
    pub fn starting_at(start: f64) -> Self {
        Self::Estimated(DelaySpec {
            start: Some(start),
            ..DelaySpec::default()
        })
    }
}

/// An estimated delay. Samples that a delay within the limits moves out of the record are left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "delay", extend("expecting" = "a map such as {start: 0.0, min: -0.01, max: 0.01}"))]
pub struct DelaySpec {
    /// Start value of the search.
    #[schemars(extend("example" = "0.0", "unit" = "s", "default" = "0, or the middle of the limits"))]
    pub start: Option<f64>,
    /// Smallest delay.
    #[schemars(extend("example" = "-0.01", "unit" = "s", "default" = "10 samples before the start"))]
    pub min: Option<f64>,
    /// Largest delay.
    #[schemars(extend("example" = "0.01", "unit" = "s", "default" = "10 samples after the start"))]
    pub max: Option<f64>,
}

/// Parameters of a sensor.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "sensor", extend("expecting" = "a map such as {gain: 1.0, offset: estimate}"))]
pub struct SensorSpec {
    /// Gain.
    #[schemars(extend("example" = "1.0", "default" = "1", "range" = "not 0"))]
    pub gain: Option<ScalarSpec>,
    /// Offset.
    #[schemars(extend("example" = "estimate", "unit" = "SI unit of the channel", "default" = "0"))]
    pub offset: Option<ScalarSpec>,
    /// Drift: rate of change of the offset.
    #[schemars(extend("example" = "estimate", "unit" = "SI unit of the channel per s", "default" = "0"))]
    pub drift: Option<ScalarSpec>,
    /// Delay of the samples against the input or the other channels: positive where they are late.
    #[schemars(extend("example" = "estimate", "unit" = "s", "default" = "0", "needs" = "an input, or another channel"))]
    pub delay: Option<DelayValue>,
    /// True for a sensor that measures absolute motion, false for motion relative to the base.
    #[schemars(extend(
        "example" = "true",
        "default" = "true for accelerations, false for the others",
        "needs" = "a motion of the base"
    ))]
    pub absolute: Option<bool>,
}

/// A scalar that is known, or estimated together with the functions: a number, `estimate`, or an estimate with a start value or a prior.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum ScalarSpec {
    /// Known.
    Known(f64),
    /// Estimated, from a start that the samples give.
    Estimate(EstimateWord),
    /// Estimated, with a start value or a prior.
    Estimated(EstimateSpec),
}

impl ScalarSpec {
    /// Estimated without a start or a prior.
    pub const ESTIMATED: Self = Self::Estimate(EstimateWord);

    /// Estimated from a start value.
    pub fn starting_at(start: f64) -> Self {
        Self::Estimated(EstimateSpec {
            start: Some(start),
            prior: None,
        })
    }

    /// True if the start is to be estimated from the samples.
    pub fn is_open(self) -> bool {
        match self {
            Self::Known(_) => false,
            Self::Estimate(_) => true,
            Self::Estimated(spec) => spec == EstimateSpec::default(),
        }
    }
}

/// A nuisance parameter, estimated with the functions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "estimate", extend("expecting" = "a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}"))]
pub struct EstimateSpec {
    /// Start value of the search.
    #[schemars(extend("example" = "1.0", "default" = "from the record"))]
    pub start: Option<f64>,
    /// Gaussian prior, which adds ((x - mean)/sigma)^2 to J.
    #[schemars(extend("example" = "{mean: 1.0, sigma: 0.1}", "default" = "nothing"))]
    pub prior: Option<Prior>,
}
