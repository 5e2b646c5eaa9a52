//! Keys of an experiment: data file, channels, sensors, input and initial state.

use super::noise::{InputSigmaSpec, NoisesSpec};
use crate::config::map::keys;

use super::{ByCoefficient, Own, RangeSpec};
use crate::config::alternatives::{OneOrList, ScalarOr};
use crate::config::choice::choice;
use crate::config::values::{ColumnId, Count, EstimateWord, Number, NumberOrEstimate};
use crate::config::values::{Sigma, Text};

keys! {
    /// An experiment: one record and its input.
    pub struct ExperimentSpec = "experiment", expecting "a map such as {name: free decay, data: file.csv, initial: {displacement: 3.3, velocity: 1.0}}" {
        /// Name for reports.
        name: Option<Text>, example "free decay", default "experiment 1, experiment 2, …";
        /// Data file, relative to the model file: a text table, or a file of NumPy, MATLAB, HDF5, TDMS, WAV or UFF; a simulation needs none.
        data: Option<Text>, example "record.csv";
        /// Format of a text table, where automatic detection fails.
        format: Option<FileFormatSpec>,
            example "{delimiter: semicolon, decimal: comma}",
            default "detected",
            needs "`data`";
        /// Columns of the data file.
        columns: Option<ColumnsSpec>,
            example "{time: t_s, displacement: y_m}",
            default "{time: t_s, displacement: y_m}",
            needs "`data`";
        /// Sampling rate, in place of a column of times or of the rate that the file states.
        sample_rate: Option<Number>,
            example "1000.0",
            unit "Hz",
            range "1e-12 to 1e12",
            needs "`data`; excludes `columns.time`";
        /// Units of the columns, converted to SI; `50 g` for samples in multiples of 50 g, such as fractions of full scale.
        units: Option<UnitsSpec>,
            example "{displacement: mm}",
            default "as stated in the file, else SI",
            needs "`data`";
        /// First and last time used, on the time axis of the file.
        window: Option<RangeSpec>,
            example "{min: 0.1, max: 2.9}",
            unit "s",
            default "all",
            range "min less than max",
            needs "`data`";
        /// Time of the file that becomes 0.
        time_zero: Option<Number>,
            example "0.1",
            unit "s",
            default "0",
            needs "`data`";
        /// Rows that repeat a time with other values; equal rows are merged.
        duplicates: Option<DuplicatesName>,
            example "first",
            default "error",
            needs "a column of times";
        /// Values in the file that stand for missing samples, in the unit of the file.
        missing: Option<OneOrList<Number>>,
            example "[-9999.0]",
            default "none",
            needs "`data`";
        /// Faulty samples that are left out of the fit, as missing samples.
        exclude: Option<OneOrList<FaultName>>,
            example "[dropouts, spikes]",
            default "none",
            needs "`data`";
        /// Decimation factor; a low-pass filter is applied before.
        decimate: Option<Count>,
            example "4",
            default "1",
            range "1 or more",
            needs "equally spaced samples without gaps";
        /// Frequency band to which samples and simulated response are filtered, for equation-error each term of the equation of motion.
        band: Option<RangeSpec>,
            example "{min: 5.0, max: 50.0}",
            unit "Hz",
            default "all",
            range "0 < min < max < half the sampling rate",
            needs "equally spaced samples without gaps";
        /// Standard deviation of the samples; without it J is the paper's integral.
        sigma: Option<SigmaSpec>, example "{displacement: 0.1}";
        /// Loss of the residuals; for equation-error of those of the equation of motion.
        loss: Option<LossesSpec>,
            example "{displacement: huber}",
            default "squares",
            needs "`sigma`";
        /// Correlation of the noise in time.
        noise: Option<NoisesSpec>,
            example "{displacement: white}",
            default "auto",
            needs "`sigma`";
        /// Sensor model: sample = gain * response(t - delay) + offset + drift * time.
        sensors: Option<SensorsSpec>, example "{acceleration: {offset: estimate}}", default "gain 1, offset 0, delay 0";
        /// Force on the mass: interpolation of the column `force`, or a waveform in its place.
        force: Option<ForceSpec>, example "{interpolation: cubic}", default "none, or the column `force`";
        /// Interpolation of the base motion.
        base: Option<BaseSpec>,
            example "{interpolation: cubic}",
            needs "`columns.base_acceleration` or `columns.base_displacement`";
        /// Initial state, or `estimate` for displacement and velocity.
        initial: InitialSpec, example "{displacement: 3.3, velocity: 1.0}";
        /// Coefficient functions of this experiment alone.
        functions: Option<ByCoefficient<Own>>,
            example "{damping: {basis: constant, start: 1.0}}",
            default "none",
            needs "the same function in the shared `functions`";
        /// Validation record: predicted and scored, not fitted.
        validation: Option<bool>,
            example "true",
            default "false",
            needs "another experiment without it; no `functions` of its own";
    }
}

choice! {
    /// Treatment of rows that repeat a time.
    pub type DuplicatesName = crate::tables::Duplicates {
        /// An error, unless the rows are equal.
        Error = "error",
        /// The first row of each time.
        First = "first",
        /// The mean of the rows of each time.
        Mean = "mean",
    }
}

choice! {
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

keys! {
    /// Format of a data file.
    pub struct FileFormatSpec = "file_format", expecting "a map such as {delimiter: semicolon, decimal: comma, skip: 3}" {
        /// Separator of fields.
        delimiter: Option<Delimiter>, example "semicolon", default "detected";
        /// Decimal separator.
        decimal: Option<DecimalSign>, example "comma", default "detected";
        /// Number of lines before the row of column names.
        skip: Option<Count>, example "4", default "detected";
        /// Row of column names.
        header: Option<bool>, example "true", default "detected";
        /// Row of units below the column names.
        units_row: Option<bool>, example "true", default "detected";
    }
}

choice! {
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

choice! {
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

keys! {
    /// Columns of a data file, by name or by number from 1.
    pub struct ColumnsSpec (Default) = "columns", expecting "a map such as {time: t_s, displacement: y_m}" {
        /// Times.
        time: Option<ColumnId>, example "t_s", default "t_s";
        /// Displacement.
        displacement: Option<ColumnRef>, example "y_m", default "y_m, if no other channel is named";
        /// Velocity.
        velocity: Option<ColumnRef>, example "v_m_per_s";
        /// Acceleration.
        acceleration: Option<ColumnRef>, example "a_m_per_s2";
        /// Force on the mass.
        force: Option<ColumnRef>, example "f_N";
        /// Acceleration of the base; y is then relative to the base.
        base_acceleration: Option<ColumnRef>, example "table_g";
        /// Displacement of the base; y is then relative to the base.
        base_displacement: Option<ColumnRef>, example "table_mm";
    }
}

keys! {
    /// A column with its own file or times.
    pub struct SourceSpec = "source", expecting "a map such as {data: other.csv, column: y_m, time: t_s}" {
        /// Data file, relative to the model file.
        data: Option<Text>, example "other.csv", default "that of the experiment";
        /// Column of the values.
        column: ColumnId, example "y_m";
        /// Column of the times.
        time: Option<ColumnId>, example "t_s", default "that of the experiment";
        /// Sampling rate, in place of a column of times or of the rate that the file states.
        sample_rate: Option<Number>,
            example "1000.0",
            unit "Hz",
            range "1e-12 to 1e12",
            needs "no `time`";
    }
}

keys! {
    /// Units of the columns: mm, deg, g, kN, ms, …
    pub struct UnitsSpec (Default) = "units", expecting "a map such as {displacement: mm, acceleration: g}" {
        /// Unit of the times.
        time: Option<Text>, example "ms", default "s";
        /// Unit of the displacement.
        displacement: Option<Text>, example "mm", default "m";
        /// Unit of the velocity.
        velocity: Option<Text>, example "mm/s", default "m/s";
        /// Unit of the acceleration.
        acceleration: Option<Text>, example "g", default "m/s^2";
        /// Unit of the force.
        force: Option<Text>, example "kN", default "N";
        /// Unit of the base acceleration.
        base_acceleration: Option<Text>, example "g", default "m/s^2";
        /// Unit of the base displacement.
        base_displacement: Option<Text>, example "mm", default "m";
    }
}

keys! {
    /// Standard deviation of a sample: a number, a column of the file, or `estimate`.
    pub struct SigmaSpec (Default) = "sigma", expecting "a map such as {displacement: 0.1}" {
        /// Standard deviation of the displacement.
        displacement: Option<Sigma>,
            example "0.1",
            unit "m",
            range "greater than 0",
            needs "the channel";
        /// Standard deviation of the velocity.
        velocity: Option<Sigma>,
            example "0.1",
            unit "m/s",
            range "greater than 0",
            needs "the channel";
        /// Standard deviation of the acceleration.
        acceleration: Option<Sigma>,
            example "estimate",
            unit "m/s^2",
            range "greater than 0",
            needs "the channel";
        /// Independent errors of the samples of the force.
        force: Option<InputSigmaSpec>,
            example "{value: 0.5, kind: sensor}",
            needs "`columns.force`, one channel with one sigma, at most 64 parameters";
        /// Independent errors of the samples of the acceleration of the base.
        base_acceleration: Option<InputSigmaSpec>,
            example "{value: 0.02, kind: sensor}",
            needs "`columns.base_acceleration`, one channel with one sigma, at most 64 parameters";
    }
}

keys! {
    /// Loss of the residuals of each channel; for equation-error the loss of a channel is that of the residuals of the equation of motion.
    pub struct LossesSpec (Default) = "losses", expecting "a map such as {displacement: huber}" {
        /// Loss of the displacement.
        displacement: Option<ScalarOr<LossName, LossSpec>>, example "huber", default "squares";
        /// Loss of the velocity.
        velocity: Option<ScalarOr<LossName, LossSpec>>, example "student-t", default "squares";
        /// Loss of the acceleration.
        acceleration: Option<ScalarOr<LossName, LossSpec>>,
            example "{name: huber, threshold: 1.345}",
            default "squares";
    }
}

keys! {
    /// A loss with its parameters.
    pub struct LossSpec = "loss", expecting "a map such as {name: huber, threshold: 1.345}" {
        /// Kind of loss.
        name: LossName, example "huber";
        /// For `huber`: residual at which the loss becomes linear.
        threshold: Option<Number>,
            example "1.345",
            unit "standard deviations",
            default "1.345",
            range "greater than 0",
            needs "`name: huber`";
        /// For `student-t`: degrees of freedom.
        degrees: Option<Number>,
            example "4.0",
            default "4",
            range "greater than 0",
            needs "`name: student-t`";
    }
}

choice! {
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

keys! {
    /// Sensor of each channel: sample = gain * response(t - delay) + offset + drift * time; delay of the force or of the base motion.
    pub struct SensorsSpec (Default) = "sensors", expecting "a map such as {acceleration: {offset: estimate}}" {
        /// Sensor of the displacement.
        displacement: Option<SensorKeys>, example "{drift: estimate}";
        /// Sensor of the velocity.
        velocity: Option<SensorKeys>, example "{gain: estimate}";
        /// Sensor of the acceleration.
        acceleration: Option<SensorKeys>, example "{offset: estimate}";
        /// Sensor of the force.
        force: Option<InputSensorSpec>, example "{delay: estimate}", needs "`columns.force`, no motion of the base";
        /// Sensor of the acceleration of the base.
        base_acceleration: Option<InputSensorSpec>, example "{delay: 0.002}", needs "`columns.base_acceleration`, no force";
        /// Sensor of the displacement of the base.
        base_displacement: Option<InputSensorSpec>, example "{delay: 0.002}", needs "`columns.base_displacement`, no force";
    }
}

keys! {
    /// Sensor of an input.
    pub struct InputSensorSpec = "input-sensor", expecting "a map such as {delay: estimate}" {
        /// Delay of its samples against the response: positive where they are late. Coefficients are then functions of the time of the input.
        delay: Option<DelayValue>, example "estimate", unit "s", default "0";
    }
}

/// A delay: a number, `estimate`, or an estimate with limits.
pub type DelayValue = ScalarOr<NumberOrEstimate, DelaySpec>;

keys! {
    /// An estimated delay. Samples that a delay within the limits moves out of the record are left out.
    pub struct DelaySpec = "delay", expecting "a map such as {start: 0.0, min: -0.01, max: 0.01}" {
        /// Start value of the search.
        start: Option<Number>, example "0.0", unit "s", default "0, or the middle of the limits";
        /// Smallest delay.
        min: Option<Number>, example "-0.01", unit "s", default "10 samples before the start";
        /// Largest delay.
        max: Option<Number>, example "0.01", unit "s", default "10 samples after the start";
    }
}

keys! {
    /// Parameters of a sensor.
    pub struct SensorKeys (Default) = "sensor", expecting "a map such as {gain: 1.0, offset: estimate}" {
        /// Gain.
        gain: Option<EstimateValue>,
            example "1.0",
            default "1",
            range "not 0";
        /// Offset.
        offset: Option<EstimateValue>, example "estimate", unit "SI unit of the channel", default "0";
        /// Drift: rate of change of the offset.
        drift: Option<EstimateValue>, example "estimate", unit "SI unit of the channel per s", default "0";
        /// Delay of the samples against the input or the other channels: positive where they are late.
        delay: Option<DelayValue>, example "estimate", unit "s", default "0", needs "an input, or another channel";
        /// True for a sensor that measures absolute motion, false for motion relative to the base.
        absolute: Option<bool>,
            example "true",
            default "true for accelerations, false for the others",
            needs "a motion of the base";
    }
}

/// A number, `estimate`, or an estimate with a start value or a prior.
pub type EstimateValue = ScalarOr<NumberOrEstimate, EstimateSpec>;

keys! {
    /// A nuisance parameter, estimated with the functions.
    pub struct EstimateSpec = "estimate", expecting "a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}" {
        /// Start value of the search.
        start: Option<Number>, example "1.0", default "from the record";
        /// Gaussian prior, which adds ((x - mean)/sigma)^2 to J.
        prior: Option<PriorSpec>, example "{mean: 1.0, sigma: 0.1}", default "nothing";
    }
}

keys! {
    /// Gaussian prior of a nuisance parameter.
    pub struct PriorSpec = "prior", expecting "a map such as {mean: 1.0, sigma: 0.1}" {
        /// Mean.
        mean: Number, example "1.0";
        /// Standard deviation.
        sigma: Number,
            example "0.1",
            range "greater than 0";
    }
}

keys! {
    /// Force on the mass: a column with its interpolation, or a waveform.
    pub struct ForceSpec (Default) = "force", expecting "a map such as {interpolation: hold} or {shape: sine, amplitude: 2.0, frequency: 1.5}" {
        /// Interpolation of the column `force`.
        interpolation: Option<InterpolationName>,
            example "cubic",
            default "linear",
            needs "`columns.force`";
        /// Waveform, in place of a column.
        shape: Option<ForceShape>,
            example "sine",
            needs "no `columns.force`; `amplitude`";
        /// Amplitude of the waveform.
        amplitude: Option<Number>,
            example "1.0",
            unit "N",
            needs "`shape`";
        /// Frequency of a sine.
        frequency: Option<Number>,
            example "1.5",
            unit "Hz",
            range "greater than 0",
            needs "`shape: sine`";
        /// Phase of a sine at time 0.
        phase: Option<Number>,
            example "0.7",
            unit "rad",
            default "0",
            needs "`shape: sine`";
        /// Initial frequency of a sweep.
        from: Option<Number>,
            example "0.5",
            unit "Hz",
            needs "`shape: sweep`";
        /// Final frequency of a sweep.
        to: Option<Number>,
            example "5.0",
            unit "Hz",
            needs "`shape: sweep`";
        /// Start of a step, half-sine or sweep.
        at: Option<Number>,
            example "1.0",
            unit "s",
            default "0",
            needs "`shape`: step, half-sine or sweep";
        /// Duration of a half-sine or sweep.
        duration: Option<Number>,
            example "0.1",
            unit "s",
            range "greater than 0",
            needs "`shape`: half-sine or sweep";
    }
}

choice! {
    /// Interpolation between samples.
    pub type InterpolationName = kmcfit_core::internals::signal::Interpolation {
        /// Constant until the next sample.
        Hold = "hold",
        /// Linear.
        Linear = "linear",
        /// Cubic spline.
        Cubic = "cubic",
    }
}

choice! {
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

keys! {
    /// Base motion.
    pub struct BaseSpec = "base", expecting "a map such as {interpolation: cubic}" {
        /// Interpolation of the base column.
        interpolation: Option<InterpolationName>, example "cubic", default "linear";
    }
}

/// Initial state: `estimate`, or displacement and velocity.
pub type InitialSpec = ScalarOr<EstimateWord, InitialStateSpec>;

keys! {
    /// Initial state: each component a number, `estimate`, or an estimate with a start value or a prior.
    pub struct InitialStateSpec = "initial", expecting "a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`" {
        /// Initial displacement.
        displacement: EstimateValue, example "3.3", unit "m";
        /// Initial velocity.
        velocity: EstimateValue, example "1.0", unit "m/s";
    }
}
