//! What a model file says, key by key: these structs mirror the YAML one to one.
//!
//! A new key is a new field; an optional one is an `Option`. What the keys mean together is decided
//! where the problem is built, not here.

mod experiment;
mod study;

pub use experiment::*;
pub use study::*;

use crate::config::map::keys;

use super::choice::choice;
pub use super::scalar::{ColumnSpec, WeightRule};
use super::scalar::{Count, Format, Knots, Nodes, Number, NumberOrColumn, OneOrList};
use super::scalar::{Start, Text, Weight};

keys! {
    /// A model: records of one device, what is sought, and how.
    pub struct ModelSpec = "model", expecting "a map with the keys format, experiments, functions, fit, …" {
        /// Version of the file format.
        format: Format, example "1";
        /// What reports call the run.
        title: Option<Text>, example "A decaying mass", default "the name of the file";
        /// Measured (or to be simulated) motions of the same device, over the same time.
        experiments: Vec<ExperimentSpec>, example "[{initial: {displacement: 3.3, velocity: 1.0}}]";
        /// Time nodes and stepper.
        grid: Option<GridSpec>, example "{nodes: 2000, method: midpoint}", default "one node per reading, rk4";
        /// Mass, damping, stiffness and further terms over time.
        functions: FunctionsSpec,
            example "{mass: {fixed: 1.0}, damping: {basis: constant, start: 0.0}, stiffness: {basis: constant, start: 1.0}}";
        /// What the functions must satisfy besides their own `min` and `max`; each map demands one thing.
        constraints: Option<Vec<ConstraintSpec>>, example "[{function: mass, shape: non-increasing}]", default "none";
        /// How to fit.
        fit: Option<FitSpec>,
            example "{method: gauss-newton, initial: data}",
            default "Gauss-Newton from the start values";
        /// The true functions, where they are known; for reports only.
        truth: Option<TruthSpec>, example "{data: truth.csv}", default "unknown";
        /// Other initial states to predict the motion from.
        predict: Option<Vec<StateSpec>>, example "[{displacement: -3.3, velocity: 1.0}]", default "none";
        /// What `kmcfit study` looks into besides what it always does.
        study: Option<StudySpec>, example "{starts: 20, constancy_test: true}";
    }
}

keys! {
    /// A state of the oscillator.
    pub struct StateSpec = "state", expecting "a map such as {displacement: 3.3, velocity: 1.0}" {
        /// Displacement.
        displacement: Number, example "3.3", unit "m";
        /// Velocity.
        velocity: Number, example "1.0", unit "m/s";
    }
}

keys! {
    /// Time nodes and stepper.
    pub struct GridSpec = "grid", expecting "a map such as {nodes: 2000, method: midpoint}" {
        /// Number of time nodes, the step is duration/(nodes - 1); or `auto`, from the frequencies in the readings.
        nodes: Option<Nodes>, example "2000", default "one per reading";
        /// How the motion is stepped through time.
        method: Option<StepMethod>, example "midpoint", default "rk4";
        /// Length of the time axis.
        duration: Option<Number>, example "25.0", unit "s", default "that of the readings";
    }
}

choice! {
    /// How the motion is stepped through time.
    pub type StepMethod = kmcfit_core::internals::system::Method {
        /// The midpoint rule of the paper.
        Midpoint = "midpoint",
        /// The classical Runge-Kutta method of order four.
        Rk4 = "rk4",
    }
}

keys! {
    /// The functions of the device; mass, damping and stiffness must be there.
    pub struct FunctionsSpec = "functions", expecting "a map with the keys mass, damping, stiffness" {
        /// Mass m(t).
        mass: FunctionSpec, example "{basis: nodal, start: 2.0}", unit "kg";
        /// Damping c(t): a force on v.
        damping: FunctionSpec, example "{basis: constant, start: 1.0}", unit "N s/m";
        /// Stiffness k(t): a force on y.
        stiffness: FunctionSpec, example "{fixed: 1.0}", unit "N/m";
        /// Cubic stiffness: a force on y^3.
        cubic_stiffness: Option<FunctionSpec>,
            example "{basis: constant, start: 0.0}",
            unit "N/m^3",
            default "no such force";
        /// Quadratic damping: a force on |v| v.
        quadratic_damping: Option<FunctionSpec>,
            example "{basis: constant, start: 0.0}",
            unit "N s^2/m^2",
            default "no such force";
        /// Coulomb friction: a force on v/sqrt(v^2 + width^2).
        coulomb_friction: Option<FunctionSpec>,
            example "{basis: constant, start: 0.5, width: 0.01}",
            unit "N",
            default "no such force";
        /// Static force against the direction of y.
        static_force: Option<FunctionSpec>, example "{fixed: 0.0}", unit "N", default "no such force";
    }
}

keys! {
    /// Functions that one experiment does not share with the others.
    pub struct OwnFunctionsSpec (Default) = "own_functions", expecting "a map such as {damping: {basis: constant, start: 1.0}}" {
        /// Mass m(t) of this experiment.
        mass: Option<FunctionSpec>, example "{basis: constant, start: 2.0}", unit "kg";
        /// Damping c(t) of this experiment.
        damping: Option<FunctionSpec>, example "{basis: constant, start: 1.0}", unit "N s/m";
        /// Stiffness k(t) of this experiment.
        stiffness: Option<FunctionSpec>, example "{basis: constant, start: 1.0}", unit "N/m";
        /// Cubic stiffness: a force on y^3.
        cubic_stiffness: Option<FunctionSpec>, example "{basis: constant, start: 0.0}", unit "N/m^3";
        /// Quadratic damping: a force on |v| v.
        quadratic_damping: Option<FunctionSpec>, example "{basis: constant, start: 0.0}", unit "N s^2/m^2";
        /// Coulomb friction: a force on v/sqrt(v^2 + width^2).
        coulomb_friction: Option<FunctionSpec>, example "{basis: constant, start: 0.5, width: 0.01}", unit "N";
        /// Static force against the direction of y.
        static_force: Option<FunctionSpec>, example "{fixed: 0.0}", unit "N";
    }
}

keys! {
    /// One function: sought, with a basis and a start, or fixed.
    pub struct FunctionSpec = "function", expecting "a map such as {basis: nodal, start: 2.0}" {
        /// Shape of the function over time, and so what its free values are.
        basis: Option<Basis>, example "piecewise-linear";
        /// Break points of a piecewise function or a spline: how many, equally spaced with both ends, or their times.
        knots: Option<Knots>, example "11", unit "s, of times";
        /// Degree of a polynomial.
        degree: Option<Count>, example "2";
        /// Where the search starts: one number, one value per node, cell or knot, the factors of a polynomial, or a
        /// column of a file.
        start: Option<Start>, example "2.0", unit "that of the function";
        /// Known values, which are not fitted; in place of `basis`.
        fixed: Option<NumberOrColumn>, example "1.0", unit "that of the function";
        /// Smallest value allowed.
        min: Option<NumberOrColumn>, example "0.05", unit "that of the function", default "none";
        /// Largest value allowed.
        max: Option<NumberOrColumn>, example "10.0", unit "that of the function", default "none";
        /// Penalty on roughness, added to J; or a list of such.
        penalty: Option<OneOrList<PenaltySpec>>,
            example "{kind: tikhonov, order: 2, weight: 0.1}",
            default "none";
        /// Of Coulomb friction: speed over which the sign of the velocity is smoothed, well below the speeds of the
        /// motion.
        width: Option<Number>, example "0.01", unit "m/s";
    }
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

keys! {
    /// A penalty on the roughness of a coefficient function p: `tikhonov`, weight times the integral of the squared derivative, or
    /// `tv`, weight times the total variation, for which a jump costs no more than a slow change.
    pub struct PenaltySpec = "penalty", expecting "a map such as {kind: tikhonov, order: 2, weight: 0.1}" {
        /// Which measure of roughness.
        kind: PenaltyKind, example "tikhonov";
        /// Of `tikhonov`: which derivative, 0 (distance from `reference`), 1 (slope) or 2 (curvature).
        order: Option<Count>, example "2";
        /// Factor of the penalty in J, or for `tikhonov` the rule that chooses it from the data.
        weight: Weight, example "0.1", unit "of J per unit of the measure";
        /// Of `tikhonov` with order 0: what the penalty pulls towards.
        reference: Option<NumberOrColumn>, example "1.0", unit "that of the function", default "0";
    }
}

choice! {
    /// Measure of roughness.
    pub enum PenaltyKind {
        /// Integral of the squared derivative of some order.
        Tikhonov = "tikhonov",
        /// Total variation.
        TotalVariation = "tv",
    }
}

impl FunctionSpec {
    /// Whether its total variation is penalised.
    pub fn has_total_variation(&self) -> bool {
        let mut penalties = self.penalty.iter().flat_map(|list| list.values());
        penalties.any(|penalty| penalty.kind == PenaltyKind::TotalVariation)
    }
}

choice! {
    /// Name of a coefficient function.
    pub type FunctionName = kmcfit_core::internals::functions::CoefficientKind {
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
        /// Static force.
        Offset = "static_force",
    }
}

keys! {
    /// One demand on the functions.
    pub struct ConstraintSpec (Default) = "constraint", expecting "a map such as {function: mass, shape: non-increasing}" {
        /// Which function it is about.
        function: Option<FunctionName>, example "mass";
        /// Smallest value allowed, at all times.
        min: Option<NumberOrColumn>, example "0.05", unit "that of the function";
        /// Largest value allowed, at all times.
        max: Option<NumberOrColumn>, example "10.0", unit "that of the function";
        /// Smallest and largest slope.
        slope: Option<RangeSpec>, example "{min: -0.2, max: 0.0}", unit "that of the function per s";
        /// Monotone, or curved in one direction; or a list of such.
        shape: Option<OneOrList<ShapeName>>, example "non-increasing";
        /// Times at which the value is held.
        at: Option<OneOrList<Number>>, example "0.0", unit "s";
        /// Values at these times, one for all or one each.
        value: Option<OneOrList<Number>>, example "1.0", unit "that of the function";
        /// Mean over the record.
        mean: Option<Number>, example "0.75", unit "that of the function";
        /// Integral over the record.
        integral: Option<Number>, example "18.75", unit "that of the function times s";
        /// Two functions: the first is `ratio` times the second.
        equal: Option<Vec<FunctionName>>, example "[damping, stiffness]";
        /// Factor of the second function of `equal`.
        ratio: Option<Number>, example "0.1", default "1";
        /// The stored energy never grows: c - m'/2 >= 0 and k' <= 0.
        passive: Option<bool>, example "true";
        /// Band of the natural frequency sqrt(k/m)/2π, at every instant.
        frequency: Option<RangeSpec>, example "{min: 0.1, max: 0.3}", unit "Hz";
        /// Cap on the size of c/(2 sqrt(k m)).
        damping_ratio: Option<RangeSpec>, example "{max: 0.2}";
        /// The price of breaking it: a weight on the mean squared excess.
        soft: Option<Number>, example "10.0", default "it holds";
    }
}

choice! {
    /// Shape that a function must have.
    pub type ShapeName = kmcfit_core::internals::constraints::Shape {
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

keys! {
    /// A range; either end may be missing.
    pub struct RangeSpec = "range", expecting "a map such as {min: 0.1, max: 0.5}" {
        /// Lower end.
        min: Option<Number>, example "0.1", default "open";
        /// Upper end.
        max: Option<Number>, example "0.5", default "open";
    }
}

keys! {
    /// How to fit.
    pub struct FitSpec = "fit", expecting "a map such as {method: gauss-newton, initial: data}" {
        /// Solver.
        method: Option<FitMethod>, example "lbfgs", default "gauss-newton";
        /// Where the fit starts.
        initial: Option<InitialName>, example "data", default "functions";
        /// Which gradient the solver follows.
        gradient: Option<Gradient>, example "continuous", default "discrete";
        /// Pairs of steps that L-BFGS remembers.
        memory: Option<Count>, example "20", default "20";
        /// When to stop; whichever comes first.
        stop: Option<StopSpec>,
            example "{iterations: 200, cost_ratio: 1e-4}",
            default "{iterations: 1000, tolerance: 1e-10}";
    }
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
    pub type InitialName = kmcfit_core::internals::solvers::Initial {
        /// From the start values of the functions.
        Functions = "functions",
        /// From the smoothed readings, put into the equation of motion.
        Data = "data",
    }
}

choice! {
    /// How the gradient is computed.
    pub type Gradient = kmcfit_core::internals::objective::GradientKind {
        /// The exact gradient of the discretised cost.
        Discrete = "discrete",
        /// The adjoint differential equation, discretised afterwards.
        Continuous = "continuous",
    }
}

keys! {
    /// When to stop; whichever comes first.
    pub struct StopSpec = "stop", expecting "a map such as {iterations: 1000, cost_ratio: 1e-4}" {
        /// After so many iterations; exactly so many if nothing else is asked for.
        iterations: Option<Count>, example "200", default "1000";
        /// Converged when J/J0 is at most this (and so is the gradient, if asked for).
        cost_ratio: Option<Number>, example "1e-4", unit "part of the first J";
        /// Converged when the squared norm of the gradient is at most this part of its first value.
        gradient_ratio: Option<Number>, example "1e-4", unit "part of the first G^2";
        /// Converged when an iteration changes J and the functions by less than this part.
        tolerance: Option<Number>, example "1e-10", default "1e-10, if no other rule is given";
        /// Converged when an iteration changes no function by more than this part of its size.
        step: Option<Number>, example "1e-12";
        /// Wall-clock limit.
        seconds: Option<Number>, example "60", unit "s";
    }
}

keys! {
    /// The true functions, for reports only.
    pub struct TruthSpec = "truth", expecting "a map such as {data: truth.csv}" {
        /// File of the true functions with times in `t_s`, relative to the model file.
        data: Text, example "truth.csv";
        /// Names of its columns.
        columns: Option<TruthColumnsSpec>,
            example "{mass: m}",
            default "mass_kg, damping_N_s_per_m, stiffness_N_per_m, …";
    }
}

keys! {
    /// Names of the columns of the true functions.
    pub struct TruthColumnsSpec = "truth_columns", expecting "a map such as {mass: mass_kg, damping: damping_N_s_per_m, stiffness: stiffness_N_per_m}" {
        /// Column of the mass.
        mass: Option<Text>, example "my_column", unit "kg", default "mass_kg";
        /// Column of the damping.
        damping: Option<Text>, example "my_column", unit "N s/m", default "damping_N_s_per_m";
        /// Column of the stiffness.
        stiffness: Option<Text>, example "my_column", unit "N/m", default "stiffness_N_per_m";
        /// Column of the cubic stiffness.
        cubic_stiffness: Option<Text>, example "my_column", unit "N/m^3";
        /// Column of the quadratic damping.
        quadratic_damping: Option<Text>, example "my_column", unit "N s^2/m^2";
        /// Column of the Coulomb friction.
        coulomb_friction: Option<Text>, example "my_column", unit "N";
        /// Column of the static force.
        static_force: Option<Text>, example "my_column", unit "N";
    }
}
