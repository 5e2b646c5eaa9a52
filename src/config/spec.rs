//! What a model file says, key by key: these structs mirror the YAML one to one.
//!
//! A new key is a new field; an optional one is an `Option`. What the keys mean together is decided
//! where the problem is built, not here.

use serde::Deserialize;
use serde::de::{Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

use super::scalar::Weight;
use super::scalar::{ColumnId, Count, Estimate, Format, Knots, Nodes, Number, NumberOrColumn};
use super::scalar::{NumberOrEstimate, OneOrList, OneOrMany, Scalar, ScalarOr, Sigma, Start, Text};
use super::scalar::{choice, deserialize_scalar, scalar_visits};

/// A whole model file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map with the keys format, experiments, functions, fit, …"
)]
pub struct ModelSpec {
    /// Version of the file format.
    pub format: Format,
    /// What reports call the run.
    pub title: Option<Text>,
    /// Measured (or to be simulated) motions; at least one.
    pub experiments: Vec<ExperimentSpec>,
    /// Time grid and stepper.
    pub grid: Option<GridSpec>,
    /// Mass, damping and stiffness over time.
    pub functions: FunctionsSpec,
    /// What the functions must satisfy, besides their own `min` and `max`.
    pub constraints: Option<Vec<ConstraintSpec>>,
    /// How to fit.
    pub fit: Option<FitSpec>,
    /// True functions, where they are known; used for reporting only.
    pub truth: Option<TruthSpec>,
    /// Initial states to predict the motion from.
    pub predict: Option<Vec<StateSpec>>,
    /// What `study` looks into.
    pub study: Option<StudySpec>,
}

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

/// A state of the oscillator.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {displacement: 3.3, velocity: 1.0}"
)]
pub struct StateSpec {
    /// Displacement, in m.
    pub displacement: Number,
    /// Velocity, in m/s.
    pub velocity: Number,
}

/// Time grid and stepper.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {nodes: 2000, method: midpoint}"
)]
pub struct GridSpec {
    /// Number of nodes N, or `auto`; the step is T/(N-1).
    pub nodes: Option<Nodes>,
    /// Stepper.
    pub method: Option<StepMethod>,
    /// Duration T, in s.
    pub duration: Option<Number>,
}

choice! {
    /// How the motion is stepped through time.
    pub enum StepMethod {
        /// The midpoint rule of the paper.
        Midpoint = "midpoint",
        /// The classical Runge-Kutta method of order four.
        Rk4 = "rk4",
    }
}

/// The coefficient functions of the device.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map with the keys mass, damping, stiffness"
)]
pub struct FunctionsSpec {
    /// Mass m(t), in kg.
    pub mass: FunctionSpec,
    /// Damping c(t), in N s/m.
    pub damping: FunctionSpec,
    /// Stiffness k(t), in N/m.
    pub stiffness: FunctionSpec,
    /// Cubic stiffness, in N/m^3: a force on y^3.
    pub cubic_stiffness: Option<FunctionSpec>,
    /// Quadratic damping, in N s^2/m^2: a force on |v| v.
    pub quadratic_damping: Option<FunctionSpec>,
    /// Coulomb friction, in N: a force on the sign of v, smoothed over `width`.
    pub coulomb_friction: Option<FunctionSpec>,
    /// Constant offset of the force, in N.
    pub offset: Option<FunctionSpec>,
}

/// Functions that one experiment has for itself.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {damping: {basis: constant, start: 1.0}}"
)]
pub struct OwnFunctionsSpec {
    /// Mass m(t), in kg.
    pub mass: Option<FunctionSpec>,
    /// Damping c(t), in N s/m.
    pub damping: Option<FunctionSpec>,
    /// Stiffness k(t), in N/m.
    pub stiffness: Option<FunctionSpec>,
    /// Cubic stiffness, in N/m^3.
    pub cubic_stiffness: Option<FunctionSpec>,
    /// Quadratic damping, in N s^2/m^2.
    pub quadratic_damping: Option<FunctionSpec>,
    /// Coulomb friction, in N.
    pub coulomb_friction: Option<FunctionSpec>,
    /// Constant offset of the force, in N.
    pub offset: Option<FunctionSpec>,
}

/// One coefficient function.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {basis: nodal, start: 2.0}"
)]
pub struct FunctionSpec {
    /// Shape of the function.
    pub basis: Option<Basis>,
    /// Break points of a piecewise function or a spline, in s: how many, or a list.
    pub knots: Option<Knots>,
    /// Degree of a polynomial.
    pub degree: Option<Count>,
    /// Values to start the fit from.
    pub start: Option<Start>,
    /// Values that are known and not fitted.
    pub fixed: Option<NumberOrColumn>,
    /// Smallest value allowed.
    pub min: Option<NumberOrColumn>,
    /// Largest value allowed.
    pub max: Option<NumberOrColumn>,
    /// Penalties on squared derivatives.
    pub smooth: Option<OneOrMany<SmoothSpec>>,
    /// Penalty on the total variation.
    pub variation: Option<VariationSpec>,
    /// Speed over which the sign of Coulomb friction is smoothed, in m/s.
    pub width: Option<Number>,
}

choice! {
    /// Shape of a coefficient function.
    pub enum Basis {
        /// A free value at every node of the grid.
        Nodal = "nodal",
        /// One value for all times.
        Constant = "constant",
        /// One value per cell between knots.
        PiecewiseConstant = "piecewise-constant",
        /// One value per knot, linear in between.
        PiecewiseLinear = "piecewise-linear",
        /// A polynomial over the whole record.
        Polynomial = "polynomial",
        /// A cubic spline.
        BSpline = "b-spline",
    }
}

/// A penalty `weight * integral (d^order p / dt^order)^2 dt`; with order 0 of `p - reference`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {order: 2, weight: 0.1}"
)]
pub struct SmoothSpec {
    /// Which derivative: 0, 1 or 2.
    pub order: Count,
    /// Factor of the penalty, or the rule that chooses it.
    pub weight: Weight,
    /// What a penalty of order 0 pulls towards, in the unit of the function.
    pub reference: Option<NumberOrColumn>,
}

choice! {
    /// How the weight of a penalty follows from the data.
    pub enum WeightRule {
        /// The largest weight that still fits the readings within their noise.
        Discrepancy = "discrepancy",
        /// The corner of misfit against roughness.
        LCurve = "l-curve",
        /// Generalised cross-validation.
        Gcv = "gcv",
        /// So that the function follows the readings within a dominant period of the motion.
        Period = "period",
    }
}

/// A penalty `weight * total variation of p`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a map such as {weight: 0.1}")]
pub struct VariationSpec {
    /// Factor of the penalty.
    pub weight: Number,
}

choice! {
    /// Name of a coefficient function.
    pub enum FunctionName {
        /// Mass m(t).
        Mass = "mass",
        /// Damping c(t).
        Damping = "damping",
        /// Stiffness k(t).
        Stiffness = "stiffness",
        /// Cubic stiffness.
        CubicStiffness = "cubic_stiffness",
        /// Quadratic damping.
        QuadraticDamping = "quadratic_damping",
        /// Coulomb friction.
        CoulombFriction = "coulomb_friction",
        /// Constant offset of the force.
        Offset = "offset",
    }
}

/// One constraint: which keys belong together is checked when the problem is built.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {function: mass, shape: non-increasing}"
)]
pub struct ConstraintSpec {
    /// Which function it is about.
    pub function: Option<FunctionName>,
    /// Smallest value allowed.
    pub min: Option<NumberOrColumn>,
    /// Largest value allowed.
    pub max: Option<NumberOrColumn>,
    /// Smallest and largest slope, in the unit of the function per s.
    pub slope: Option<RangeSpec>,
    /// Monotone or curved in one direction.
    pub shape: Option<OneOrList<ShapeName>>,
    /// Times at which the value is held, in s.
    pub at: Option<OneOrList<Number>>,
    /// Values there, one for all times or one each.
    pub value: Option<OneOrList<Number>>,
    /// Mean over the record, in the unit of the function.
    pub mean: Option<Number>,
    /// Integral over the record, in the unit of the function times s.
    pub integral: Option<Number>,
    /// Two functions: the first is `ratio` times the second.
    pub equal: Option<Vec<FunctionName>>,
    /// Factor of the second function of `equal`; 1 unless given.
    pub ratio: Option<Number>,
    /// Whether the stored energy must never grow.
    pub passive: Option<bool>,
    /// Band of the natural frequency, in Hz.
    pub frequency: Option<RangeSpec>,
    /// Cap on the damping ratio.
    pub damping_ratio: Option<RangeSpec>,
    /// The price of breaking it: a weight. Without it the constraint holds.
    pub soft: Option<Number>,
}

choice! {
    /// Shape that a function must have.
    pub enum ShapeName {
        /// It never rises.
        NonIncreasing = "non-increasing",
        /// It never falls.
        NonDecreasing = "non-decreasing",
        /// Its slope never falls.
        Convex = "convex",
        /// Its slope never rises.
        Concave = "concave",
    }
}

/// A range of numbers, open where an end is missing.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a map such as {min: 0.1, max: 0.5}")]
pub struct RangeSpec {
    /// Smallest value allowed.
    pub min: Option<Number>,
    /// Largest value allowed.
    pub max: Option<Number>,
}

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {data: file.csv, column: mass_kg}"
)]
pub struct ColumnSpec {
    /// CSV file, relative to the model file.
    pub data: Text,
    /// Name of the column.
    pub column: Text,
}

/// How to fit.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {method: gauss-newton, initial: data}"
)]
pub struct FitSpec {
    /// Solver.
    pub method: Option<FitMethod>,
    /// Where the fit starts.
    pub initial: Option<InitialName>,
    /// Which gradient the solver follows.
    pub gradient: Option<Gradient>,
    /// Number of steps that L-BFGS remembers.
    pub memory: Option<Count>,
    /// When to stop.
    pub stop: Option<StopSpec>,
}

choice! {
    /// Solver.
    pub enum FitMethod {
        /// Along the negative gradient.
        SteepestDescent = "steepest-descent",
        /// Limited-memory BFGS.
        Lbfgs = "lbfgs",
        /// Along the projected negative gradient, under constraints.
        ProjectedGradient = "projected-gradient",
        /// Gauss-Newton steps, under constraints.
        GaussNewton = "gauss-newton",
        /// The minimum of the equation error, under constraints: nothing is simulated.
        EquationError = "equation-error",
    }
}

choice! {
    /// Where a fit starts.
    pub enum InitialName {
        /// From the start values of the functions.
        Functions = "functions",
        /// From the smoothed readings, put into the equation of motion.
        Data = "data",
    }
}

choice! {
    /// How the gradient is computed.
    pub enum Gradient {
        /// The exact gradient of the discretised cost.
        Discrete = "discrete",
        /// The adjoint differential equation, discretised afterwards.
        Continuous = "continuous",
    }
}

/// When to stop; whichever comes first.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {iterations: 1000, cost_ratio: 1e-4}"
)]
pub struct StopSpec {
    /// After this many iterations.
    pub iterations: Option<Count>,
    /// When the cost has fallen to this part of its first value.
    pub cost_ratio: Option<Number>,
    /// When the squared norm of the gradient has fallen to this part of its first value.
    pub gradient_ratio: Option<Number>,
    /// When an iteration lowers the cost by at most this part of it and changes no function by more
    /// than the square root of this, relative to the function's size; or when it changes none by more
    /// than this.
    pub tolerance: Option<Number>,
    /// When an iteration changes no function by more than this part of its size.
    pub step: Option<Number>,
    /// After this time, in s.
    pub seconds: Option<Number>,
}

/// True functions, used for reporting only.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a map such as {data: truth.csv}")]
pub struct TruthSpec {
    /// CSV file, relative to the model file.
    pub data: Text,
    /// Names of its columns.
    pub columns: Option<TruthColumnsSpec>,
}

/// Names of the columns of a file of true functions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a map such as {mass: mass_kg, damping: damping_N_s_per_m, stiffness: stiffness_N_per_m}"
)]
pub struct TruthColumnsSpec {
    /// Column of the mass, in kg.
    pub mass: Option<Text>,
    /// Column of the damping, in N s/m.
    pub damping: Option<Text>,
    /// Column of the stiffness, in N/m.
    pub stiffness: Option<Text>,
    /// Column of the cubic stiffness, in N/m^3.
    pub cubic_stiffness: Option<Text>,
    /// Column of the quadratic damping, in N s^2/m^2.
    pub quadratic_damping: Option<Text>,
    /// Column of the Coulomb friction, in N.
    pub coulomb_friction: Option<Text>,
    /// Column of the offset, in N.
    pub offset: Option<Text>,
}
