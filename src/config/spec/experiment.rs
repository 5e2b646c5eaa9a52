//! Keys of an experiment: its file, channels, sensors, what drives it, and its beginning.

use serde::Deserialize;
use serde::de::{Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

use super::{OwnFunctionsSpec, RangeSpec};
use crate::config::scalar::{
    ColumnId, Count, Estimate, Number, NumberOrEstimate, Scalar, ScalarOr,
};
use crate::config::scalar::{Sigma, Text};
use crate::config::scalar::{choice, deserialize_scalar, scalar_visits};

/// One measured motion.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {name: free decay, data: file.csv, initial: {displacement: 3.3, velocity: 1.0}}"
)]
pub struct ExperimentSpec {
    /// What reports call it.
    pub name: Option<Text>,
    /// File of the readings, relative to the model file; a simulation needs none.
    pub data: Option<Text>,
    /// How the file is written, where that is not to be found out from it.
    pub format: Option<FileFormatSpec>,
    /// Which columns of `data` are what.
    pub columns: Option<ColumnsSpec>,
    /// Readings per s, in place of a column of times.
    pub sample_rate: Option<Number>,
    /// Units of the columns, which are converted to SI.
    pub units: Option<UnitsSpec>,
    /// First and last time that is used, in s, as the file counts.
    pub window: Option<RangeSpec>,
    /// Time, as the file counts, that becomes 0 s.
    pub time_zero: Option<Number>,
    /// Every how manyth reading is kept, after a low-pass filter against aliasing.
    pub decimate: Option<Count>,
    /// Frequencies, in Hz, outside which readings and model are filtered alike before they are
    /// compared.
    pub band: Option<RangeSpec>,
    /// Standard deviation of the readings.
    pub sigma: Option<SigmaSpec>,
    /// What residuals cost.
    pub loss: Option<LossesSpec>,
    /// Gains, offsets and drifts of the sensors.
    pub sensors: Option<SensorsSpec>,
    /// Force on the mass.
    pub force: Option<ForceSpec>,
    /// Motion of the base.
    pub base: Option<BaseSpec>,
    /// State at the beginning.
    pub initial: InitialSpec,
    /// Functions that this experiment does not share.
    pub functions: Option<OwnFunctionsSpec>,
    /// Whether it is kept out of the fit, to be predicted and scored.
    pub hold_out: Option<bool>,
}

/// How a file of readings is written; what is not given is found out from the file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {delimiter: semicolon, decimal: comma, skip: 3}"
)]
pub struct FileFormatSpec {
    /// What separates fields.
    pub delimiter: Option<Delimiter>,
    /// What separates the decimals of a number.
    pub decimal: Option<DecimalSign>,
    /// Lines before the row of column names.
    pub skip: Option<Count>,
    /// Whether there is a row of column names.
    pub header: Option<bool>,
    /// Whether a row of units follows it.
    pub units_row: Option<bool>,
}

choice! {
    /// What separates fields.
    pub enum Delimiter {
        /// `,`
        Comma = "comma",
        /// `;`
        Semicolon = "semicolon",
        /// Tab.
        Tab = "tab",
    }
}

choice! {
    /// What separates the decimals of a number.
    pub enum DecimalSign {
        /// `.`
        Point = "point",
        /// `,`
        Comma = "comma",
    }
}

/// A column by name or number, or with a file and times of its own.
pub type ColumnRef = ScalarOr<ColumnId, SourceSpec>;

/// Which columns of a file are what.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {time: t_s, displacement: y_m}"
)]
pub struct ColumnsSpec {
    /// Times.
    pub time: Option<ColumnId>,
    /// Displacement.
    pub displacement: Option<ColumnRef>,
    /// Velocity.
    pub velocity: Option<ColumnRef>,
    /// Acceleration.
    pub acceleration: Option<ColumnRef>,
    /// Force.
    pub force: Option<ColumnRef>,
    /// Acceleration of the base.
    pub base_acceleration: Option<ColumnRef>,
    /// Displacement of the base.
    pub base_displacement: Option<ColumnRef>,
}

/// A column with a file or times of its own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {data: other.csv, column: y_m, time: t_s}"
)]
pub struct SourceSpec {
    /// File, relative to the model file; that of the experiment unless given.
    pub data: Option<Text>,
    /// Column of the values.
    pub column: ColumnId,
    /// Column of the times; that of the experiment unless given.
    pub time: Option<ColumnId>,
    /// Readings per s, in place of a column of times.
    pub sample_rate: Option<Number>,
}

/// Units of the columns.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {displacement: mm, acceleration: g}"
)]
pub struct UnitsSpec {
    /// Of the times.
    pub time: Option<Text>,
    /// Of the displacement.
    pub displacement: Option<Text>,
    /// Of the velocity.
    pub velocity: Option<Text>,
    /// Of the acceleration.
    pub acceleration: Option<Text>,
    /// Of the force.
    pub force: Option<Text>,
    /// Of the acceleration of the base.
    pub base_acceleration: Option<Text>,
    /// Of the displacement of the base.
    pub base_displacement: Option<Text>,
}

/// Standard deviation of the readings, per channel.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a map such as {displacement: 0.1}")]
pub struct SigmaSpec {
    /// Of the displacement, in m.
    pub displacement: Option<Sigma>,
    /// Of the velocity, in m/s.
    pub velocity: Option<Sigma>,
    /// Of the acceleration, in m/s^2.
    pub acceleration: Option<Sigma>,
}

/// What residuals cost, per channel.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a map such as {displacement: huber}")]
pub struct LossesSpec {
    /// Of the displacement.
    pub displacement: Option<ScalarOr<LossName, LossSpec>>,
    /// Of the velocity.
    pub velocity: Option<ScalarOr<LossName, LossSpec>>,
    /// Of the acceleration.
    pub acceleration: Option<ScalarOr<LossName, LossSpec>>,
}

/// A loss with its settings.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {name: huber, threshold: 1.345}"
)]
pub struct LossSpec {
    /// Which.
    pub name: LossName,
    /// Of `huber`: where squares end, in standard deviations.
    pub threshold: Option<Number>,
    /// Of `student-t`: degrees of freedom.
    pub degrees: Option<Number>,
}

choice! {
    /// What a residual costs.
    pub enum LossName {
        /// Its square.
        Squares = "squares",
        /// Its square up to a threshold, and linearly more beyond.
        Huber = "huber",
        /// Minus the logarithm of Student's t.
        StudentT = "student-t",
    }
}

/// Sensors, per channel.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {acceleration: {offset: estimate}}"
)]
pub struct SensorsSpec {
    /// Of the displacement.
    pub displacement: Option<SensorSpec>,
    /// Of the velocity.
    pub velocity: Option<SensorSpec>,
    /// Of the acceleration.
    pub acceleration: Option<SensorSpec>,
}

/// What a sensor makes of the motion.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {gain: 1.0, offset: estimate}"
)]
pub struct SensorSpec {
    /// Factor; 1 unless given.
    pub gain: Option<EstimateValue>,
    /// Reading at rest, in the SI unit of the channel; 0 unless given.
    pub offset: Option<EstimateValue>,
    /// Change of the offset per s; 0 unless given.
    pub drift: Option<EstimateValue>,
    /// Whether it measures the motion in space and not relative to the base; unless given,
    /// accelerations do and the others do not.
    pub absolute: Option<bool>,
}

/// A number, `estimate`, or an estimate with a start or a prior.
pub type EstimateValue = ScalarOr<NumberOrEstimate, EstimateSpec>;

/// A number to be estimated.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}"
)]
pub struct EstimateSpec {
    /// Where the search starts.
    pub start: Option<Number>,
    /// What is known of it.
    pub prior: Option<PriorSpec>,
}

/// What is known of a number before the fit.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {mean: 1.0, sigma: 0.1}"
)]
pub struct PriorSpec {
    /// Expected value.
    pub mean: Number,
    /// Standard deviation.
    pub sigma: Number,
}

/// Force on the mass: a column (see `columns`) with its interpolation, or a shape.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {interpolation: hold} or {shape: sine, amplitude: 2.0, frequency: 1.5}"
)]
pub struct ForceSpec {
    /// Between the samples of the column `force`.
    pub interpolation: Option<InterpolationName>,
    /// A shape in place of a column.
    pub shape: Option<ForceShape>,
    /// Largest value, in N.
    pub amplitude: Option<Number>,
    /// Of a sine, in Hz.
    pub frequency: Option<Number>,
    /// Of a sine or a sweep at its beginning, in rad.
    pub phase: Option<Number>,
    /// First frequency of a sweep, in Hz.
    pub from: Option<Number>,
    /// Last frequency of a sweep, in Hz.
    pub to: Option<Number>,
    /// Where a step, a half-sine or a sweep begins, in s; 0 unless given.
    pub at: Option<Number>,
    /// How long a half-sine or a sweep lasts, in s.
    pub duration: Option<Number>,
}

choice! {
    /// How values between samples are found.
    pub enum InterpolationName {
        /// The last sample holds.
        Hold = "hold",
        /// Linear between samples.
        Linear = "linear",
        /// A cubic spline through the samples.
        Cubic = "cubic",
    }
}

choice! {
    /// Shape of a force.
    pub enum ForceShape {
        /// The same at all times.
        Constant = "constant",
        /// A sine.
        Sine = "sine",
        /// A sine whose frequency rises in proportion to time.
        Sweep = "sweep",
        /// Nothing, then constant.
        Step = "step",
        /// One half of a sine: a blow.
        HalfSine = "half-sine",
    }
}

/// Motion of the base: a column `base_acceleration` or `base_displacement` and its interpolation.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {interpolation: cubic}"
)]
pub struct BaseSpec {
    /// Between the samples of the base's column.
    pub interpolation: Option<InterpolationName>,
}

/// State at the beginning: `estimate`, or displacement and velocity.
pub type InitialSpec = ScalarOr<Estimate, InitialStateSpec>;

/// Displacement and velocity at the beginning, known or to be estimated.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`"
)]
pub struct InitialStateSpec {
    /// Displacement, in m.
    pub displacement: EstimateValue,
    /// Velocity, in m/s.
    pub velocity: EstimateValue,
}
