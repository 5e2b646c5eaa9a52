//! Keys of an experiment: its file, channels, sensors, what drives it, and its beginning.

use crate::config::map::keys;

use super::{OwnFunctionsSpec, RangeSpec};
use crate::config::choice::choice;
use crate::config::scalar::{ColumnId, Count, Estimate, Number, NumberOrEstimate, ScalarOr};
use crate::config::scalar::{Sigma, Text};

keys! {
    /// One record.
    pub struct ExperimentSpec = "experiment", expecting "a map such as {name: free decay, data: file.csv, initial: {displacement: 3.3, velocity: 1.0}}" {
        /// What reports call it.
        name: Option<Text>, example "free decay", default "experiment 1, experiment 2, …";
        /// File of the readings, relative to the model file; a simulation needs none.
        data: Option<Text>, example "readings.csv";
        /// How the file is written, where that is not to be found out from it.
        format: Option<FileFormatSpec>,
            example "{delimiter: semicolon, decimal: comma}",
            default "found out from the file";
        /// Which columns of the file are what.
        columns: Option<ColumnsSpec>,
            example "{time: t_s, displacement: y_m}",
            default "{time: t_s, displacement: y_m}";
        /// Readings per second, in place of a column of times.
        sample_rate: Option<Number>, example "1000.0", unit "Hz";
        /// Units of the columns, which are converted to SI.
        units: Option<UnitsSpec>, example "{displacement: mm}", default "what the file states, else SI";
        /// First and last time that is used, as the file counts.
        window: Option<RangeSpec>, example "{min: 0.1, max: 2.9}", unit "s", default "all";
        /// Time, as the file counts, that becomes 0.
        time_zero: Option<Number>, example "0.1", unit "s", default "0";
        /// Keep every so manyth reading after a low-pass filter.
        decimate: Option<Count>, example "4", default "1";
        /// Frequencies outside which readings and model are filtered alike.
        band: Option<RangeSpec>, example "{min: 5.0, max: 50.0}", unit "Hz", default "all";
        /// Standard deviation of the readings; without it J is the paper's integral.
        sigma: Option<SigmaSpec>, example "{displacement: 0.1}";
        /// What residuals cost; needs `sigma`.
        loss: Option<LossesSpec>, example "{displacement: huber}", default "squares";
        /// reading = gain * motion + offset + drift * time.
        sensors: Option<SensorsSpec>, example "{acceleration: {offset: estimate}}", default "perfect ones";
        /// Force on the mass: how the column `force` is read between its samples, or a shape in its place.
        force: Option<ForceSpec>, example "{interpolation: cubic}", default "none, or the column `force`";
        /// How the motion of the base is read between its samples.
        base: Option<BaseSpec>, example "{interpolation: cubic}";
        /// State at the beginning, or `estimate` for both of its numbers.
        initial: InitialSpec, example "{displacement: 3.3, velocity: 1.0}";
        /// Functions that this experiment does not share with the others.
        functions: Option<OwnFunctionsSpec>,
            example "{damping: {basis: constant, start: 1.0}}",
            default "all are shared";
        /// Whether it is a validation record: kept out of the fit, predicted and scored.
        validation: Option<bool>, example "true", default "false";
    }
}

keys! {
    /// How a file of readings is written.
    pub struct FileFormatSpec = "file_format", expecting "a map such as {delimiter: semicolon, decimal: comma, skip: 3}" {
        /// What separates fields.
        delimiter: Option<Delimiter>, example "semicolon", default "found out";
        /// What separates the decimals of a number.
        decimal: Option<DecimalSign>, example "comma", default "found out";
        /// Lines before the row of column names.
        skip: Option<Count>, example "4", default "found out";
        /// Whether there is a row of column names.
        header: Option<bool>, example "true", default "found out";
        /// Whether a row of units follows it.
        units_row: Option<bool>, example "true", default "found out";
    }
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

keys! {
    /// Which columns of a file are what, by name or by number from 1.
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
        /// Acceleration of the base; y is relative to the base then.
        base_acceleration: Option<ColumnRef>, example "table_g";
        /// Displacement of the base; y is relative to the base then.
        base_displacement: Option<ColumnRef>, example "table_mm";
    }
}

keys! {
    /// A column with a file or times of its own.
    pub struct SourceSpec = "source", expecting "a map such as {data: other.csv, column: y_m, time: t_s}" {
        /// File, relative to the model file.
        data: Option<Text>, example "other.csv", default "that of the experiment";
        /// Column of the values.
        column: ColumnId, example "y_m";
        /// Column of the times.
        time: Option<ColumnId>, example "t_s", default "that of the experiment";
        /// Readings per second, in place of a column of times.
        sample_rate: Option<Number>, example "1000.0", unit "Hz";
    }
}

keys! {
    /// Units of the columns: mm, deg, g, kN, ms, …
    pub struct UnitsSpec (Default) = "units", expecting "a map such as {displacement: mm, acceleration: g}" {
        /// Of the times.
        time: Option<Text>, example "ms", default "s";
        /// Of the displacement.
        displacement: Option<Text>, example "mm", default "m";
        /// Of the velocity.
        velocity: Option<Text>, example "mm/s", default "m/s";
        /// Of the acceleration.
        acceleration: Option<Text>, example "g", default "m/s^2";
        /// Of the force.
        force: Option<Text>, example "kN", default "N";
        /// Of the acceleration of the base.
        base_acceleration: Option<Text>, example "g", default "m/s^2";
        /// Of the displacement of the base.
        base_displacement: Option<Text>, example "mm", default "m";
    }
}

keys! {
    /// Standard deviation of a reading: a number, a column of the file, or `estimate`.
    pub struct SigmaSpec (Default) = "sigma", expecting "a map such as {displacement: 0.1}" {
        /// Of the displacement.
        displacement: Option<Sigma>, example "0.1", unit "m";
        /// Of the velocity.
        velocity: Option<Sigma>, example "0.1", unit "m/s";
        /// Of the acceleration.
        acceleration: Option<Sigma>, example "estimate", unit "m/s^2";
    }
}

keys! {
    /// What the residuals of each channel cost.
    pub struct LossesSpec (Default) = "losses", expecting "a map such as {displacement: huber}" {
        /// Of the displacement.
        displacement: Option<ScalarOr<LossName, LossSpec>>, example "huber", default "squares";
        /// Of the velocity.
        velocity: Option<ScalarOr<LossName, LossSpec>>, example "student-t", default "squares";
        /// Of the acceleration.
        acceleration: Option<ScalarOr<LossName, LossSpec>>,
            example "{name: huber, threshold: 1.345}",
            default "squares";
    }
}

keys! {
    /// A loss with its settings.
    pub struct LossSpec = "loss", expecting "a map such as {name: huber, threshold: 1.345}" {
        /// Which loss.
        name: LossName, example "huber";
        /// Of `huber`: where squares end.
        threshold: Option<Number>, example "1.345", unit "standard deviations", default "1.345";
        /// Of `student-t`: degrees of freedom.
        degrees: Option<Number>, example "4.0", default "4";
    }
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

keys! {
    /// Sensors, per channel: reading = gain * motion + offset + drift * time.
    pub struct SensorsSpec (Default) = "sensors", expecting "a map such as {acceleration: {offset: estimate}}" {
        /// Of the displacement.
        displacement: Option<SensorSpec>, example "{drift: estimate}";
        /// Of the velocity.
        velocity: Option<SensorSpec>, example "{gain: estimate}";
        /// Of the acceleration.
        acceleration: Option<SensorSpec>, example "{offset: estimate}";
    }
}

keys! {
    /// What a sensor makes of the motion.
    pub struct SensorSpec (Default) = "sensor", expecting "a map such as {gain: 1.0, offset: estimate}" {
        /// Factor.
        gain: Option<EstimateValue>, example "1.0", default "1";
        /// Reading at rest.
        offset: Option<EstimateValue>, example "estimate", unit "SI unit of the channel", default "0";
        /// Change of the offset with time.
        drift: Option<EstimateValue>, example "estimate", unit "SI unit of the channel per s", default "0";
        /// Whether it measures the motion in space and not relative to the base.
        absolute: Option<bool>, example "true", default "true for accelerations, false for the others";
    }
}

/// A number, `estimate`, or an estimate with a start or a prior.
pub type EstimateValue = ScalarOr<NumberOrEstimate, EstimateSpec>;

keys! {
    /// A number that is sought with the functions.
    pub struct EstimateSpec = "estimate", expecting "a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}" {
        /// Where the search starts.
        start: Option<Number>, example "1.0", default "what the readings say";
        /// What is known of it: adds ((x - mean)/sigma)^2 to J.
        prior: Option<PriorSpec>, example "{mean: 1.0, sigma: 0.1}", default "nothing";
    }
}

keys! {
    /// What is known of a number before the fit.
    pub struct PriorSpec = "prior", expecting "a map such as {mean: 1.0, sigma: 0.1}" {
        /// Expected value.
        mean: Number, example "1.0";
        /// Standard deviation.
        sigma: Number, example "0.1";
    }
}

keys! {
    /// Force on the mass: a column with its interpolation, or a shape.
    pub struct ForceSpec (Default) = "force", expecting "a map such as {interpolation: hold} or {shape: sine, amplitude: 2.0, frequency: 1.5}" {
        /// Between the samples of the column `force`.
        interpolation: Option<InterpolationName>, example "cubic", default "linear";
        /// A shape in place of a column.
        shape: Option<ForceShape>, example "sine";
        /// Largest value of a shape.
        amplitude: Option<Number>, example "1.0", unit "N";
        /// Of a sine.
        frequency: Option<Number>, example "1.5", unit "Hz";
        /// Of a sine at time 0.
        phase: Option<Number>, example "0.7", unit "rad", default "0";
        /// First frequency of a sweep.
        from: Option<Number>, example "0.5", unit "Hz";
        /// Last frequency of a sweep.
        to: Option<Number>, example "5.0", unit "Hz";
        /// Where a step, a half-sine or a sweep begins.
        at: Option<Number>, example "1.0", unit "s", default "0";
        /// How long a half-sine or a sweep lasts.
        duration: Option<Number>, example "0.1", unit "s";
    }
}

choice! {
    /// How values between samples are found.
    pub type InterpolationName = kmcfit_core::internals::signal::Interpolation {
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

keys! {
    /// Motion of the base.
    pub struct BaseSpec = "base", expecting "a map such as {interpolation: cubic}" {
        /// Between the samples of the column of the base.
        interpolation: Option<InterpolationName>, example "cubic", default "linear";
    }
}

/// State at the beginning: `estimate`, or displacement and velocity.
pub type InitialSpec = ScalarOr<Estimate, InitialStateSpec>;

keys! {
    /// State at the beginning: each number known, `estimate`, or an estimate with a start or a prior.
    pub struct InitialStateSpec = "initial", expecting "a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`" {
        /// Displacement at the beginning.
        displacement: EstimateValue, example "3.3", unit "m";
        /// Velocity at the beginning.
        velocity: EstimateValue, example "1.0", unit "m/s";
    }
}
