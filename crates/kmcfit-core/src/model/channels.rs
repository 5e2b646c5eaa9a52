//! Keys of the forces on a structure and of the channels that observe it.

use super::{
    ColumnRef, CorrelationName, CorrelationSpec, LossName, LossSpec, OneOrList, ScalarOr,
    ScalarSpec, SensorSpec, SigmaValue,
};
use crate::record::ChannelKind;
use crate::signal::Interpolation;
use schemars::JsonSchema;
use serde::Deserialize;

/// A force on a coordinate of a structure.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "force_at", extend("expecting" = "a map such as {column: f_N, at: floor_3}"))]
pub struct ForceAtSpec {
    /// Column of the force.
    #[schemars(extend("example" = "f_N"))]
    pub column: ColumnRef,
    /// Coordinate on which it acts.
    #[schemars(extend("example" = "floor_3"))]
    pub at: String,
    /// Unit of the column.
    #[schemars(extend("example" = "kN", "default" = "as stated in the file, else N"))]
    pub unit: Option<String>,
    /// Interpolation between samples.
    #[schemars(extend("example" = "cubic", "default" = "linear"))]
    pub interpolation: Option<Interpolation>,
}

/// A channel that observes a structure: one of `displacement`, `velocity`, `acceleration`, each of a coordinate or of the second of two ends
/// less the first, or the `elongation` of an element.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "channel", extend("expecting" = "a map such as {column: a1_g, acceleration: floor_1, sigma: estimate}"))]
pub struct StructureChannelSpec {
    /// Column of the samples.
    #[schemars(extend("example" = "a1_g"))]
    pub column: ColumnRef,
    /// Coordinate, or two ends, whose displacement is measured.
    #[schemars(extend("example" = "[floor_1, floor_2]", "needs" = "no other quantity in the same channel"))]
    pub displacement: Option<OneOrList<String>>,
    /// Coordinate, or two ends, whose velocity is measured.
    #[schemars(extend("example" = "floor_1", "needs" = "no other quantity in the same channel"))]
    pub velocity: Option<OneOrList<String>>,
    /// Coordinate, or two ends, whose acceleration is measured.
    #[schemars(extend("example" = "floor_1", "needs" = "no other quantity in the same channel"))]
    pub acceleration: Option<OneOrList<String>>,
    /// Element whose elongation is measured.
    #[schemars(extend("example" = "storey_1", "needs" = "no other quantity in the same channel"))]
    pub elongation: Option<String>,
    /// Unit of the column.
    #[schemars(extend("example" = "g", "default" = "as stated in the file, else SI"))]
    pub unit: Option<String>,
    /// Standard deviation of the samples.
    #[schemars(extend("example" = "estimate", "range" = "greater than 0"))]
    pub sigma: Option<SigmaValue>,
    /// Loss of the residuals.
    #[schemars(extend("example" = "huber", "default" = "squares", "needs" = "`sigma`"))]
    pub loss: Option<ScalarOr<LossName, LossSpec>>,
    /// Correlation of the noise in time.
    #[schemars(extend("example" = "white", "default" = "auto", "needs" = "`sigma`"))]
    pub noise: Option<ScalarOr<CorrelationName, CorrelationSpec>>,
    /// Gain.
    #[schemars(extend("example" = "1.0", "default" = "1", "range" = "not 0"))]
    pub gain: Option<ScalarSpec>,
    /// Offset.
    #[schemars(extend("example" = "estimate", "unit" = "SI unit of the channel", "default" = "0"))]
    pub offset: Option<ScalarSpec>,
    /// Drift: rate of change of the offset.
    #[schemars(extend("example" = "estimate", "unit" = "SI unit of the channel per s", "default" = "0"))]
    pub drift: Option<ScalarSpec>,
    /// True for a sensor that measures absolute motion, false for motion relative to the base.
    #[schemars(extend(
        "example" = "true",
        "default" = "true for the acceleration of a coordinate, false for the others",
        "needs" = "a motion of the base"
    ))]
    pub absolute: Option<bool>,
}

impl StructureChannelSpec {
    /// The measured quantities with what they observe; a valid channel has one.
    pub fn observed(&self) -> Vec<(ChannelKind, Vec<String>)> {
        let names = |given: &Option<OneOrList<String>>| Some(given.as_ref()?.values().to_vec());
        let elongation = self
            .elongation
            .as_ref()
            .map(|element| vec![element.clone()]);
        let all = [
            (ChannelKind::Displacement, names(&self.displacement)),
            (ChannelKind::Velocity, names(&self.velocity)),
            (ChannelKind::Acceleration, names(&self.acceleration)),
            (ChannelKind::Displacement, elongation),
        ];
        all.into_iter()
            .filter_map(|(kind, names)| Some((kind, names?)))
            .collect()
    }

    /// Its sensor.
    pub fn sensor(&self) -> SensorSpec {
        SensorSpec {
            gain: self.gain,
            offset: self.offset,
            drift: self.drift,
            delay: None,
            absolute: self.absolute,
        }
    }
}
