//! Keys of the force and of the motion of the base.

use super::{ColumnRef, words};
use crate::signal::Interpolation;
use schemars::JsonSchema;
use serde::Deserialize;

/// Force on the mass: a column with its interpolation, or a waveform.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "force", extend("expecting" = "a map such as {interpolation: hold} or {shape: sine, amplitude: 2.0, frequency: 1.5}"))]
pub struct ForceSpec {
    /// Interpolation of the column `force`.
    #[schemars(extend("example" = "cubic", "default" = "linear", "needs" = "`columns.force`"))]
    pub interpolation: Option<Interpolation>,
    /// Waveform, in place of a column.
    #[schemars(extend("example" = "sine", "needs" = "no `columns.force`; `amplitude`"))]
    pub shape: Option<ForceShape>,
    /// Amplitude of the waveform.
    #[schemars(extend("example" = "1.0", "unit" = "N", "needs" = "`shape`"))]
    pub amplitude: Option<f64>,
    /// Frequency of a sine.
    #[schemars(extend("example" = "1.5", "unit" = "Hz", "range" = "greater than 0", "needs" = "`shape: sine`"))]
    pub frequency: Option<f64>,
    /// Phase of a sine at time 0.
    #[schemars(extend("example" = "0.7", "unit" = "rad", "default" = "0", "needs" = "`shape: sine`"))]
    pub phase: Option<f64>,
    /// Initial frequency of a sweep.
    #[schemars(extend("example" = "0.5", "unit" = "Hz", "needs" = "`shape: sweep`"))]
    pub from: Option<f64>,
    /// Final frequency of a sweep.
    #[schemars(extend("example" = "5.0", "unit" = "Hz", "needs" = "`shape: sweep`"))]
    pub to: Option<f64>,
    /// Start of a step, half-sine or sweep.
    #[schemars(extend("example" = "1.0", "unit" = "s", "default" = "0", "needs" = "`shape`: step, half-sine or sweep"))]
    pub at: Option<f64>,
    /// Duration of a half-sine or sweep.
    #[schemars(extend(
        "example" = "0.1",
        "unit" = "s",
        "range" = "greater than 0",
        "needs" = "`shape`: half-sine or sweep"
    ))]
    pub duration: Option<f64>,
}

words! {
    /// Waveform of a force.
    pub enum ForceShape {
        /// Constant.
        Constant = "constant",
        /// Sine.
        Sine = "sine",
        /// Sine sweep of linearly increasing frequency.
        Sweep = "sweep",
        /// Step from zero to a constant.
        Step = "step",
        /// Half-sine pulse, as of an impact.
        HalfSine = "half-sine",
    }
}

/// Base motion.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "base", extend("expecting" = "a map such as {interpolation: cubic}"))]
pub struct BaseSpec {
    /// Column of the motion, in place of `columns.base_acceleration` or `columns.base_displacement`.
    #[schemars(extend("example" = "table_g"))]
    pub column: Option<ColumnRef>,
    /// True for a column of displacements, false for accelerations.
    #[schemars(extend("example" = "true", "default" = "false", "needs" = "`column`"))]
    pub displacement: Option<bool>,
    /// Unit of `column`.
    #[schemars(extend("example" = "g", "default" = "as stated in the file, else SI", "needs" = "`column`"))]
    pub unit: Option<String>,
    /// Interpolation of the base column.
    #[schemars(extend("example" = "cubic", "default" = "linear"))]
    pub interpolation: Option<Interpolation>,
}
