//! What a model file says, key by key: these structs mirror the YAML one to one.
//!
//! A new key is a new field; an optional one is an `Option`. What the keys mean together is decided
//! where the problem is built, not here.

mod experiment;
mod study;

pub use experiment::*;
pub use study::*;

use serde::Deserialize;
use serde::de::{Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

pub use super::scalar::{ColumnSpec, WeightRule};
use super::scalar::{Count, Format, Knots, Nodes, Number, NumberOrColumn, OneOrList, OneOrMany};
use super::scalar::{Scalar, Start, Text, Weight};
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
