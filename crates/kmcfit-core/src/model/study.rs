//! Keys of a study.

use super::{ForceSpec, NumberOrColumn, OneOrList, StateSpec};
use crate::functions::CoefficientKind;
use crate::record::ChannelKind;
use schemars::JsonSchema;
use serde::Deserialize;

/// Analyses of `kmcfit study`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "study", extend("expecting" = "a map such as {profiles: [{function: mass, at: 0.0}], starts: 20}"))]
pub struct StudySpec {
    /// Confidence level of bands, profiles and extremes.
    #[schemars(extend("example" = "0.95", "default" = "0.95", "range" = "between 0 and 1"))]
    pub confidence: Option<f64>,
    /// Seed of all random numbers.
    #[schemars(extend("example" = "1", "default" = "1"))]
    pub seed: Option<usize>,
    /// Quantities for which a likelihood profile is computed.
    #[schemars(extend("example" = "[{function: mass, at: 0.0}]", "default" = "none"))]
    pub profiles: Option<Vec<ProfileSpec>>,
    /// Times at which the data-consistent extremes are computed.
    #[schemars(extend(
        "example" = "[0.0, 12.5, 25.0]",
        "unit" = "s",
        "default" = "five over the record",
        "range" = "within the record"
    ))]
    pub extremes: Option<OneOrList<f64>>,
    /// Largest misfit (J without penalties) of a system that is consistent with the data.
    #[schemars(extend(
        "example" = "2010.0",
        "unit" = "that of J",
        "default" = "from the confidence level",
        "range" = "greater than 0"
    ))]
    pub misfit_limit: Option<f64>,
    /// Number of fits from random starting points.
    #[schemars(extend("example" = "20", "default" = "none", "range" = "1 to 100000"))]
    pub starts: Option<usize>,
    /// Range of the random starting points: factor by which they differ from the start values.
    #[schemars(extend(
        "example" = "3.0",
        "default" = "3",
        "range" = "greater than 1, at most 1e6",
        "needs" = "`starts`"
    ))]
    pub spread: Option<f64>,
    /// Relative difference of k/m, c/m and response below which two minima count as one.
    #[schemars(extend("example" = "1e-3", "default" = "1e-3", "range" = "greater than 0", "needs" = "`starts`"))]
    pub merge_tolerance: Option<f64>,
    /// Masses for which equivalent systems, with the same response, are computed.
    #[schemars(extend(
        "example" = "[{name: constant mass, mass: 1.0}]",
        "default" = "increasing, decreasing and oscillating masses"
    ))]
    pub equivalent_systems: Option<Vec<EquivalentSpec>>,
    /// Candidate experiments, ranked by their information.
    #[schemars(extend("example" = "[{name: again, initial: {displacement: 3.3, velocity: 1.0}}]", "default" = "none"))]
    pub candidates: Option<Vec<CandidateSpec>>,
}

/// A quantity: value or mean of a function, a constant, or a nuisance parameter.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "profile", extend("expecting" = "a map such as {function: mass, at: 0.0}"))]
pub struct ProfileSpec {
    /// Function.
    #[schemars(extend("example" = "mass", "needs" = "an estimated function; excludes `scalar`"))]
    pub function: Option<CoefficientKind>,
    /// Time of the value.
    #[schemars(extend("example" = "0.0", "unit" = "s", "range" = "within the record", "needs" = "`function`"))]
    pub at: Option<f64>,
    /// Mean over the record in place of a value.
    #[schemars(extend("example" = "true", "needs" = "`function`"))]
    pub mean: Option<bool>,
    /// Name of a nuisance parameter, in place of a function.
    #[schemars(extend("example" = "initial velocity", "needs" = "an estimated nuisance parameter of this name"))]
    pub parameter: Option<String>,
}

/// An equivalent system with a given mass.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "equivalent", extend("expecting" = "a map such as {name: constant mass, mass: 1.0}"))]
pub struct EquivalentSpec {
    /// Name for reports.
    #[schemars(extend("example" = "constant mass"))]
    pub name: String,
    /// Mass.
    #[schemars(extend("example" = "1.0", "unit" = "kg", "range" = "greater than 0"))]
    pub mass: NumberOrColumn,
    /// Damping to which the system is as close as possible.
    #[schemars(extend("example" = "0.0", "unit" = "N s/m", "default" = "that of the fit"))]
    pub damping: Option<NumberOrColumn>,
}

/// A candidate experiment.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "candidate", extend("expecting" = "a map such as {name: second release, initial: {displacement: 0.0, velocity: 3.0}}"))]
pub struct CandidateSpec {
    /// Name for reports.
    #[schemars(extend("example" = "a blow"))]
    pub name: String,
    /// Initial state.
    #[schemars(extend("example" = "{displacement: 0.0, velocity: 3.0}"))]
    pub initial: StateSpec,
    /// Waveform of the force.
    #[schemars(extend("example" = "{shape: sine, amplitude: 1.0, frequency: 0.2}", "default" = "none"))]
    pub force: Option<ForceSpec>,
    /// Measured channel, sampled at every node.
    #[schemars(extend("example" = "acceleration", "default" = "displacement"))]
    pub channel: Option<ChannelKind>,
    /// Standard deviation of a sample.
    #[schemars(extend(
        "example" = "0.1",
        "unit" = "SI unit of the channel",
        "default" = "that of the first channel of the model",
        "range" = "greater than 0"
    ))]
    pub sigma: Option<f64>,
}
