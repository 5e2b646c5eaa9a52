//! Keys of an experiment: data file, channels, noise and initial state.

use super::{
    BaseSpec, ByCoefficient, ColumnId, EstimateWord, ForceAtSpec, ForceSpec, InputSigmaSpec,
    NoisesSpec, OneOrList, Own, RangeSpec, ScalarOr, ScalarSpec, SensorsSpec, SigmaValue,
    StructureChannelSpec, words,
};
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
    /// Forces on coordinates of a structure; at most one.
    #[schemars(extend("example" = "[{column: f_N, at: floor_3}]", "default" = "none", "needs" = "`structure`"))]
    pub forces: Option<Vec<ForceAtSpec>>,
    /// Channels that observe a structure.
    #[schemars(extend(
        "example" = "[{column: a1_g, acceleration: floor_1, sigma: estimate}]",
        "default" = "none",
        "needs" = "`structure`; no `sigma`, `loss`, `noise` or `sensors` of the experiment"
    ))]
    pub channels: Option<Vec<StructureChannelSpec>>,
    /// Interpolation of the base motion, or its column.
    #[schemars(extend(
        "example" = "{interpolation: cubic}",
        "needs" = "`column`, `columns.base_acceleration` or `columns.base_displacement`"
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
