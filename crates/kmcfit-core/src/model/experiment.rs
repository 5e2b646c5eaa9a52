//! Keys of an experiment: data file, channels, sensors, input and initial state.

use super::{
    ByCoefficient, ColumnId, EstimateWord, InputSigmaSpec, NoisesSpec, OneOrList, Own, RangeSpec,
    ScalarOr, SigmaValue, words,
};
use crate::functions::Prior;
use crate::signal::Interpolation;
use schemars::JsonSchema;
use serde::Deserialize;

/// An experiment: one record and its input.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "experiment", extend("expecting" = "a map such as {name: free decay, data: file.csv, initial: {displacement: 3.3, velocity: 1.0}}"))]
pub struct ExperimentSpec {
    /// Name for reports.
    #[schemars(extend("example" = "free decay", "default" = "experiment 1, experiment 2, …"))]
    pub name: Option<String>,
    /// Data file, relative to the model file: a text table, or a file of NumPy, MATLAB, HDF5, TDMS, WAV or UFF; a simulation needs none.
    #[schemars(extend("example" = "record.csv"))]
    pub data: Option<String>,
    /// Format of a text table, where automatic detection fails.
    #[schemars(extend(
        "example" = "{delimiter: semicolon, decimal: comma}",
        "default" = "detected",
        "needs" = "`data`"
    ))]
    pub format: Option<FileFormatSpec>,
    /// Columns of the data file.
    #[schemars(extend(
        "example" = "{time: t_s, displacement: y_m}",
        "default" = "{time: t_s, displacement: y_m}",
        "needs" = "`data`"
    ))]
    pub columns: Option<ColumnsSpec>,
    /// Sampling rate, in place of a column of times or of the rate that the file states.
    #[schemars(extend(
        "example" = "1000.0",
        "unit" = "Hz",
        "range" = "1e-12 to 1e12",
        "needs" = "`data`; excludes `columns.time`"
    ))]
    pub sample_rate: Option<f64>,
    /// Units of the columns, converted to SI; `50 g` for samples in multiples of 50 g, such as fractions of full scale.
    #[schemars(extend(
        "example" = "{displacement: mm}",
        "default" = "as stated in the file, else SI",
        "needs" = "`data`"
    ))]
    pub units: Option<UnitsSpec>,
    /// First and last time used, on the time axis of the file.
    #[schemars(extend(
        "example" = "{min: 0.1, max: 2.9}",
        "unit" = "s",
        "default" = "all",
        "range" = "min less than max",
        "needs" = "`data`"
    ))]
    pub window: Option<RangeSpec>,
    /// Time of the file that becomes 0.
    #[schemars(extend("example" = "0.1", "unit" = "s", "default" = "0", "needs" = "`data`"))]
    pub time_zero: Option<f64>,
    /// Rows that repeat a time with other values; equal rows are merged.
    #[schemars(extend("example" = "first", "default" = "error", "needs" = "a column of times"))]
    pub duplicates: Option<Duplicates>,
    /// Values in the file that stand for missing samples, in the unit of the file.
    #[schemars(extend("example" = "[-9999.0]", "default" = "none", "needs" = "`data`"))]
    pub missing: Option<OneOrList<f64>>,
    /// Faulty samples that are left out of the fit, as missing samples.
    #[schemars(extend("example" = "[dropouts, spikes]", "default" = "none", "needs" = "`data`"))]
    pub exclude: Option<OneOrList<FaultName>>,
    /// Decimation factor; a low-pass filter is applied before.
    #[schemars(extend(
        "example" = "4",
        "default" = "1",
        "range" = "1 or more",
        "needs" = "equally spaced samples without gaps"
    ))]
    pub decimate: Option<usize>,
    /// Frequency band to which samples and simulated response are filtered, for equation-error each term of the equation of motion.
    #[schemars(extend(
        "example" = "{min: 5.0, max: 50.0}",
        "unit" = "Hz",
        "default" = "all",
        "range" = "0 < min < max < half the sampling rate",
        "needs" = "equally spaced samples without gaps"
    ))]
    pub band: Option<RangeSpec>,
    /// Standard deviation of the samples; without it J is the paper's integral.
    #[schemars(extend("example" = "{displacement: 0.1}"))]
    pub sigma: Option<SigmaSpec>,
    /// Loss of the residuals; for equation-error of those of the equation of motion.
    #[schemars(extend("example" = "{displacement: huber}", "default" = "squares", "needs" = "`sigma`"))]
    pub loss: Option<LossesSpec>,
    /// Correlation of the noise in time.
    #[schemars(extend("example" = "{displacement: white}", "default" = "auto", "needs" = "`sigma`"))]
    pub noise: Option<NoisesSpec>,
    /// Sensor model: sample = gain * response(t - delay) + offset + drift * time.
    #[schemars(extend("example" = "{acceleration: {offset: estimate}}", "default" = "gain 1, offset 0, delay 0"))]
    pub sensors: Option<SensorsSpec>,
    /// Force on the mass: interpolation of the column `force`, or a waveform in its place.
    #[schemars(extend("example" = "{interpolation: cubic}", "default" = "none, or the column `force`"))]
    pub force: Option<ForceSpec>,
    /// Interpolation of the base motion.
    #[schemars(extend(
        "example" = "{interpolation: cubic}",
        "needs" = "`columns.base_acceleration` or `columns.base_displacement`"
    ))]
    pub base: Option<BaseSpec>,
    /// Initial state, or `estimate` for displacement and velocity.
    #[schemars(extend("example" = "{displacement: 3.3, velocity: 1.0}"))]
    pub initial: InitialSpec,
    /// Coefficient functions of this experiment alone.
    #[schemars(extend(
        "example" = "{damping: {basis: constant, start: 1.0}}",
        "default" = "none",
        "needs" = "the same function in the shared `functions`"
    ))]
    pub functions: Option<ByCoefficient<Own>>,
    /// Validation record: predicted and scored, not fitted.
    #[schemars(extend(
        "example" = "true",
        "default" = "false",
        "needs" = "another experiment without it; no `functions` of its own"
    ))]
    pub validation: Option<bool>,
}

words! {
    /// Faulty samples of a response.
    pub enum FaultName {
        /// Five or more samples held at one value while the response moves.
        Dropouts = "dropouts",
        /// Single samples far from their neighbours.
        Spikes = "spikes",
        /// Samples at an end of the range of the sensor.
        Saturation = "saturation",
    }
}

/// Treatment of rows that repeat a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Duplicates {
    /// An error, unless the rows are equal.
    #[default]
    Error,
    /// The first row of each time.
    First,
    /// The mean of the rows of each time.
    Mean,
}

impl FaultName {
    /// Reason for samples that are not used.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Dropouts => "dropouts",
            Self::Spikes => "spikes",
            Self::Saturation => "saturated",
        }
    }
}

/// Format of a data file.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "file_format", extend("expecting" = "a map such as {delimiter: semicolon, decimal: comma, skip: 3}"))]
pub struct FileFormatSpec {
    /// Separator of fields.
    #[schemars(extend("example" = "semicolon", "default" = "detected"))]
    pub delimiter: Option<Delimiter>,
    /// Decimal separator.
    #[schemars(extend("example" = "comma", "default" = "detected"))]
    pub decimal: Option<DecimalSign>,
    /// Number of lines before the row of column names.
    #[schemars(extend("example" = "4", "default" = "detected"))]
    pub skip: Option<usize>,
    /// Row of column names.
    #[schemars(extend("example" = "true", "default" = "detected"))]
    pub header: Option<bool>,
    /// Row of units below the column names.
    #[schemars(extend("example" = "true", "default" = "detected"))]
    pub units_row: Option<bool>,
}

words! {
    /// Separator of fields.
    pub enum Delimiter {
        /// `,`
        Comma = "comma",
        /// `;`
        Semicolon = "semicolon",
        /// Tab.
        Tab = "tab",
    }
}

words! {
    /// Decimal separator.
    pub enum DecimalSign {
        /// `.`
        Point = "point",
        /// `,`
        Comma = "comma",
    }
}

/// A column by name or number, or with its own file and times.
pub type ColumnRef = ScalarOr<ColumnId, SourceSpec>;

/// Columns of a data file, by name or by number from 1.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "columns", extend("expecting" = "a map such as {time: t_s, displacement: y_m}"))]
pub struct ColumnsSpec {
    /// Times.
    #[schemars(extend("example" = "t_s", "default" = "t_s"))]
    pub time: Option<ColumnId>,
    /// Displacement.
    #[schemars(extend("example" = "y_m", "default" = "y_m, if no other channel is named"))]
    pub displacement: Option<ColumnRef>,
    /// Velocity.
    #[schemars(extend("example" = "v_m_per_s"))]
    pub velocity: Option<ColumnRef>,
    /// Acceleration.
    #[schemars(extend("example" = "a_m_per_s2"))]
    pub acceleration: Option<ColumnRef>,
    /// Force on the mass.
    #[schemars(extend("example" = "f_N"))]
    pub force: Option<ColumnRef>,
    /// Acceleration of the base; y is then relative to the base.
    #[schemars(extend("example" = "table_g"))]
    pub base_acceleration: Option<ColumnRef>,
    /// Displacement of the base; y is then relative to the base.
    #[schemars(extend("example" = "table_mm"))]
    pub base_displacement: Option<ColumnRef>,
}

/// A column with its own file or times.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "source", extend("expecting" = "a map such as {data: other.csv, column: y_m, time: t_s}"))]
pub struct SourceSpec {
    /// Data file, relative to the model file.
    #[schemars(extend("example" = "other.csv", "default" = "that of the experiment"))]
    pub data: Option<String>,
    /// Column of the values.
    #[schemars(extend("example" = "y_m"))]
    pub column: ColumnId,
    /// Column of the times.
    #[schemars(extend("example" = "t_s", "default" = "that of the experiment"))]
    pub time: Option<ColumnId>,
    /// Sampling rate, in place of a column of times or of the rate that the file states.
    #[schemars(extend("example" = "1000.0", "unit" = "Hz", "range" = "1e-12 to 1e12", "needs" = "no `time`"))]
    pub sample_rate: Option<f64>,
}

/// Units of the columns: mm, deg, g, kN, ms, …
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "units", extend("expecting" = "a map such as {displacement: mm, acceleration: g}"))]
pub struct UnitsSpec {
    /// Unit of the times.
    #[schemars(extend("example" = "ms", "default" = "s"))]
    pub time: Option<String>,
    /// Unit of the displacement.
    #[schemars(extend("example" = "mm", "default" = "m"))]
    pub displacement: Option<String>,
    /// Unit of the velocity.
    #[schemars(extend("example" = "mm/s", "default" = "m/s"))]
    pub velocity: Option<String>,
    /// Unit of the acceleration.
    #[schemars(extend("example" = "g", "default" = "m/s^2"))]
    pub acceleration: Option<String>,
    /// Unit of the force.
    #[schemars(extend("example" = "kN", "default" = "N"))]
    pub force: Option<String>,
    /// Unit of the base acceleration.
    #[schemars(extend("example" = "g", "default" = "m/s^2"))]
    pub base_acceleration: Option<String>,
    /// Unit of the base displacement.
    #[schemars(extend("example" = "mm", "default" = "m"))]
    pub base_displacement: Option<String>,
}

/// Standard deviation of a sample: a number, a column of the file, or `estimate`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "sigma", extend("expecting" = "a map such as {displacement: 0.1}"))]
pub struct SigmaSpec {
    /// Standard deviation of the displacement.
    #[schemars(extend("example" = "0.1", "unit" = "m", "range" = "greater than 0", "needs" = "the channel"))]
    pub displacement: Option<SigmaValue>,
    /// Standard deviation of the velocity.
    #[schemars(extend("example" = "0.1", "unit" = "m/s", "range" = "greater than 0", "needs" = "the channel"))]
    pub velocity: Option<SigmaValue>,
    /// Standard deviation of the acceleration.
    #[schemars(extend("example" = "estimate", "unit" = "m/s^2", "range" = "greater than 0", "needs" = "the channel"))]
    pub acceleration: Option<SigmaValue>,
    /// Independent errors of the samples of the force.
    #[schemars(extend(
        "example" = "{value: 0.5, kind: sensor}",
        "needs" = "`columns.force`, one channel with one sigma, at most 64 parameters"
    ))]
    pub force: Option<InputSigmaSpec>,
    /// Independent errors of the samples of the acceleration of the base.
    #[schemars(extend(
        "example" = "{value: 0.02, kind: sensor}",
        "needs" = "`columns.base_acceleration`, one channel with one sigma, at most 64 parameters"
    ))]
    pub base_acceleration: Option<InputSigmaSpec>,
}

/// Loss of the residuals of each channel; for equation-error the loss of a channel is that of the residuals of the equation of motion.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "losses", extend("expecting" = "a map such as {displacement: huber}"))]
pub struct LossesSpec {
    /// Loss of the displacement.
    #[schemars(extend("example" = "huber", "default" = "squares"))]
    pub displacement: Option<ScalarOr<LossName, LossSpec>>,
    /// Loss of the velocity.
    #[schemars(extend("example" = "student-t", "default" = "squares"))]
    pub velocity: Option<ScalarOr<LossName, LossSpec>>,
    /// Loss of the acceleration.
    #[schemars(extend("example" = "{name: huber, threshold: 1.345}", "default" = "squares"))]
    pub acceleration: Option<ScalarOr<LossName, LossSpec>>,
}

/// A loss with its parameters.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "loss", extend("expecting" = "a map such as {name: huber, threshold: 1.345}"))]
pub struct LossSpec {
    /// Kind of loss.
    #[schemars(extend("example" = "huber"))]
    pub name: LossName,
    /// For `huber`: residual at which the loss becomes linear.
    #[schemars(extend(
        "example" = "1.345",
        "unit" = "standard deviations",
        "default" = "1.345",
        "range" = "greater than 0",
        "needs" = "`name: huber`"
    ))]
    pub threshold: Option<f64>,
    /// For `student-t`: degrees of freedom.
    #[schemars(extend("example" = "4.0", "default" = "4", "range" = "greater than 0", "needs" = "`name: student-t`"))]
    pub degrees: Option<f64>,
}

words! {
    /// Loss of a residual.
    pub enum LossName {
        /// Square.
        Squares = "squares",
        /// Huber: square up to a threshold, linear beyond it.
        Huber = "huber",
        /// Negative log-likelihood of Student's t distribution.
        StudentT = "student-t",
    }
}

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
    /// Interpolation of the base column.
    #[schemars(extend("example" = "cubic", "default" = "linear"))]
    pub interpolation: Option<Interpolation>,
}

/// Initial state: `estimate`, or displacement and velocity.
pub type InitialSpec = ScalarOr<EstimateWord, InitialStateSpec>;

/// Initial state: each component a number, `estimate`, or an estimate with a start value or a prior.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "initial", extend("expecting" = "a map such as {displacement: 3.3, velocity: 1.0}"))]
pub struct InitialStateSpec {
    /// Initial displacement.
    #[schemars(extend("example" = "3.3", "unit" = "m"))]
    pub displacement: ScalarSpec,
    /// Initial velocity.
    #[schemars(extend("example" = "1.0", "unit" = "m/s"))]
    pub velocity: ScalarSpec,
}
