//! Keys of a study.

use serde::Deserialize;
use serde::de::{Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

use super::{ForceSpec, FunctionName, StateSpec};
use crate::config::scalar::{Count, Number, NumberOrColumn, OneOrList, Scalar, Text};
use crate::config::scalar::{choice, deserialize_scalar, scalar_visits};

/// What `study` looks into, besides what it always does.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {profiles: [{function: mass, at: 0.0}], starts: 20}"
)]
pub struct StudySpec {
    /// Confidence of bands and intervals; 0.95 unless given.
    pub confidence: Option<Number>,
    /// Seed of everything random; 1 unless given.
    pub seed: Option<Count>,
    /// Numbers whose profile is drawn.
    pub profiles: Option<Vec<ProfileSpec>>,
    /// Times at which the widest tubes are sought, in s.
    pub tubes: Option<OneOrList<Number>>,
    /// Largest J of a device in the tubes; unless given, what the confidence allows.
    pub level: Option<Number>,
    /// Number of starts of the search for other optima.
    pub starts: Option<Count>,
    /// The starts lie between the start values divided and multiplied by this, within the bounds.
    pub spread: Option<Number>,
    /// Optima whose k/m, c/m and motions agree to this are one.
    pub same: Option<Number>,
    /// Number of replicates of the bootstrap.
    pub bootstrap: Option<Count>,
    /// Where the noise of the replicates comes from.
    pub noise: Option<NoiseName>,
    /// Masses for which devices with the same motion are sought.
    pub equivalents: Option<Vec<EquivalentSpec>>,
    /// Whether each function is held against a constant.
    pub varies: Option<bool>,
    /// Experiments that might be made next.
    pub candidates: Option<Vec<CandidateSpec>>,
}

/// A number: a function's value at a time or its mean, or a scalar by its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {function: mass, at: 0.0}"
)]
pub struct ProfileSpec {
    /// Which function.
    pub function: Option<FunctionName>,
    /// At which time, in s.
    pub at: Option<Number>,
    /// Or its mean.
    pub mean: Option<bool>,
    /// Name of an estimated number, as the report calls it.
    pub scalar: Option<Text>,
}

choice! {
    /// Noise of the replicates of a bootstrap.
    pub enum NoiseName {
        /// Gaussian, of the readings' sigma.
        Parametric = "parametric",
        /// The residuals of the fit, drawn with replacement.
        Residual = "residual",
    }
}

/// A device to be sought with the motion of the fit.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {name: constant mass, mass: 1.0}"
)]
pub struct EquivalentSpec {
    /// What the report calls it.
    pub name: Text,
    /// Its mass, in kg.
    pub mass: NumberOrColumn,
    /// The damping that it should be near to, in N s/m; that of the fit unless given.
    pub damping: Option<NumberOrColumn>,
}

/// An experiment that might be made.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {name: second release, initial: {displacement: 0.0, velocity: 3.0}}"
)]
pub struct CandidateSpec {
    /// What the report calls it.
    pub name: Text,
    /// State at its beginning.
    pub initial: StateSpec,
    /// Force on the mass, as a shape.
    pub force: Option<ForceSpec>,
    /// What is measured, at every node; the displacement unless given.
    pub channel: Option<ChannelName>,
    /// Standard deviation of a reading; that of the first channel of the model unless given.
    pub sigma: Option<Number>,
}

choice! {
    /// Kind of a channel.
    pub enum ChannelName {
        /// Displacement.
        Displacement = "displacement",
        /// Velocity.
        Velocity = "velocity",
        /// Acceleration.
        Acceleration = "acceleration",
    }
}
