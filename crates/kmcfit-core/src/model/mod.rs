//! What a user states: the types of a model file, with the documentation of every key on its field.
//!
//! YAML and JSON are read into them by serde, Rust programs write them, the Python package lowers its classes to them; the schema of
//! schemars has the documentation for `kmcfit explain` and for editors. A new key is a new field; an optional one is an `Option`. Beside
//! the meaning of a key stand an `example`, and where it has them its `unit`, `default`, `range`, and the keys it `needs`. Conditions that
//! concern several keys are checked where the model is lowered to a problem.

mod by_coefficient;
mod channels;
mod experiment;
mod fit;
mod functions;
mod input;
mod noise;
mod parts;
mod sensors;
mod structure;
mod study;
mod values;

pub use by_coefficient::{ByCoefficient, Shared};
pub(crate) use by_coefficient::{Own, TruthColumns};
pub use channels::{ForceAtSpec, StructureChannelSpec};
pub use experiment::{
    ColumnRef, DecimalSign, Delimiter, Duplicates, ExperimentSpec, FaultName, InitialSpec,
    LossName, LossSpec, SourceSpec,
};
pub(crate) use fit::FitSpec;
pub use fit::{FitMethod, StopSpec};
pub use functions::{BasisName, CoefficientSpec, PenaltyKind, PenaltySpec};
pub use input::BaseSpec;
pub use input::{ForceShape, ForceSpec};
pub(crate) use noise::NoisesSpec;
pub use noise::{CorrelationName, CorrelationSpec, InputErrorName, InputSigmaSpec};
pub use parts::{ConstraintSpec, StateSpec};
pub(crate) use parts::{GridSpec, RangeSpec, TruthSpec};
pub use sensors::{DelayValue, InputSensorSpec, ScalarSpec, SensorSpec};
pub(crate) use sensors::{EstimateSpec, SensorsSpec};
pub use structure::{CoordinateSpec, ElementSpec, Named, StructureSpec};
pub use study::{CandidateSpec, EquivalentSpec, ProfileSpec, StudySpec};
pub use values::{
    AutoWord, Bound, ColumnId, ColumnSpec, KnotSpec, KnownValue, KnownValueMap, Nodes,
    NumberOrColumn, OneOrList, ScalarOr, SigmaValue, StartSpec, WeightChoice,
};
pub(crate) use values::{EstimateWord, FormatVersion, words};

use schemars::JsonSchema;
use serde::Deserialize;

/// A model: records of one system, its coefficient functions, and the settings of the fit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "model", extend("expecting" = "a map with the keys format, experiments, functions, fit, …"))]
pub struct ModelSpec {
    /// Version of the file format.
    #[schemars(extend("example" = "1"))]
    pub format: FormatVersion,
    /// Title for reports.
    #[schemars(extend("example" = "A decaying mass", "default" = "file name"))]
    pub title: Option<String>,
    /// Records of one system on a common time axis, measured or to be simulated.
    #[schemars(extend("example" = "[{initial: {displacement: 3.3, velocity: 1.0}}]"))]
    pub experiments: Vec<ExperimentSpec>,
    /// Time grid and stepper.
    #[schemars(extend("example" = "{nodes: 2000, method: midpoint}", "default" = "one node per sample, rk4"))]
    pub grid: Option<GridSpec>,
    /// Coefficient functions of the equation of motion of one coordinate.
    #[schemars(extend(
        "example" = "{mass: {fixed: 1.0}, damping: {basis: constant, start: 0.0}, stiffness: {basis: constant, start: 1.0}}"
    ))]
    pub functions: Option<ByCoefficient<Shared>>,
    /// A system of several coordinates, in place of `functions`.
    #[schemars(extend(
        "example" = "{coordinates: {floor_1: {mass: {fixed: 1.0}}}, elements: {storey_1: {spring: [ground, floor_1], start: 3000.0}}}",
        "default" = "one coordinate with `functions`",
        "needs" = "no `functions`, `constraints`, `truth`, `predict` or `study`"
    ))]
    pub structure: Option<StructureSpec>,
    /// Constraints on the functions beyond their own `min` and `max`; one map for each.
    #[schemars(extend("example" = "[{function: mass, shape: non-increasing}]", "default" = "none"))]
    pub constraints: Option<Vec<ConstraintSpec>>,
    /// Method, start and stopping tests of the fit.
    #[schemars(extend(
        "example" = "{method: gauss-newton, initial: data}",
        "default" = "Gauss-Newton from the start values"
    ))]
    pub fit: Option<FitSpec>,
    /// True functions, for reports only.
    #[schemars(extend("example" = "{data: truth.csv}", "default" = "unknown"))]
    pub truth: Option<TruthSpec>,
    /// Initial states for which the free response is predicted.
    #[schemars(extend("example" = "[{displacement: -3.3, velocity: 1.0}]", "default" = "none"))]
    pub predict: Option<Vec<StateSpec>>,
    /// Analyses of `kmcfit study`.
    #[schemars(extend("example" = "{starts: 20, seed: 1}"))]
    pub study: Option<StudySpec>,
}
