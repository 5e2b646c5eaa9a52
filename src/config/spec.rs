//! Keys of a model file: structs that mirror the YAML, with the documentation of every key.
//!
//! A new key is a new field; an optional one is an `Option`. Conditions that concern several keys are checked in
//! `config/lowering/`, where the problem is built.

mod by_coefficient;
mod experiment;
mod functions;
mod noise;
mod study;

pub use by_coefficient::*;
pub use experiment::*;
pub use functions::*;
pub use noise::*;
pub use study::*;

use crate::config::map::keys;

use super::alternatives::OneOrList;
use super::choice::choice;
pub use super::values::{ColumnSpec, WeightRuleName};
use super::values::{Count, FormatVersion, Nodes, Number, NumberOrColumn, Text};
use kmcfit_core::internals::functions::CoefficientKind;

keys! {
    /// A model: records of one system, its coefficient functions, and the settings of the fit.
    pub struct ModelSpec = "model", expecting "a map with the keys format, experiments, functions, fit, …" {
        /// Version of the file format.
        format: FormatVersion, example "1";
        /// Title for reports.
        title: Option<Text>, example "A decaying mass", default "file name";
        /// Records of one system on a common time axis, measured or to be simulated.
        experiments: Vec<ExperimentSpec>, example "[{initial: {displacement: 3.3, velocity: 1.0}}]";
        /// Time grid and stepper.
        grid: Option<GridSpec>, example "{nodes: 2000, method: midpoint}", default "one node per sample, rk4";
        /// Coefficient functions of the equation of motion.
        functions: ByCoefficient<Shared>,
            example "{mass: {fixed: 1.0}, damping: {basis: constant, start: 0.0}, stiffness: {basis: constant, start: 1.0}}";
        /// Constraints on the functions beyond their own `min` and `max`; one map for each.
        constraints: Option<Vec<ConstraintSpec>>, example "[{function: mass, shape: non-increasing}]", default "none";
        /// Method, start and stopping tests of the fit.
        fit: Option<FitSpec>,
            example "{method: gauss-newton, initial: data}",
            default "Gauss-Newton from the start values";
        /// True functions, for reports only.
        truth: Option<TruthSpec>, example "{data: truth.csv}", default "unknown";
        /// Initial states for which the free response is predicted.
        predict: Option<Vec<StateSpec>>, example "[{displacement: -3.3, velocity: 1.0}]", default "none";
        /// Analyses of `kmcfit study`.
        study: Option<StudySpec>, example "{starts: 20, seed: 1}";
    }
}

keys! {
    /// Displacement and velocity at one time.
    pub struct StateSpec = "state", expecting "a map such as {displacement: 3.3, velocity: 1.0}" {
        /// Displacement.
        displacement: Number, example "3.3", unit "m";
        /// Velocity.
        velocity: Number, example "1.0", unit "m/s";
    }
}

keys! {
    /// Time grid and stepper.
    pub struct GridSpec = "grid", expecting "a map such as {nodes: 2000, method: midpoint}" {
        /// Number of nodes, with the step duration/(nodes - 1); `auto` chooses it from the spectrum of the records, and a fit
        /// refines it until the discretisation error is below a tenth of the standard errors.
        nodes: Option<Nodes>,
            example "2000",
            default "auto with `sigma` and no `method`, for gauss-newton and projected-gradient; otherwise one per sample",
            range "3 to 1e8";
        /// Time integration method.
        method: Option<StepMethod>, example "midpoint", default "rk4";
        /// Length of the time axis.
        duration: Option<Number>,
            example "25.0",
            unit "s",
            default "that of the records",
            range "greater than 0",
            needs "a grid without records; with records their span is used";
    }
}

choice! {
    /// Time integration method.
    pub type StepMethod = kmcfit_core::internals::system::Method {
        /// Midpoint rule, of order 2.
        Midpoint = "midpoint",
        /// Classical Runge-Kutta method, of order 4.
        Rk4 = "rk4",
    }
}

keys! {
    /// A constraint on coefficient functions.
    pub struct ConstraintSpec (Default) = "constraint", expecting "a map such as {function: mass, shape: non-increasing}" {
        /// Constrained function.
        function: Option<CoefficientKind>,
            example "mass",
            needs "one of min, max, slope, shape, at, mean and integral";
        /// Lower bound at all times.
        min: Option<NumberOrColumn>,
            example "0.05",
            unit "that of the function",
            range "at most `max`",
            needs "`function`";
        /// Upper bound at all times.
        max: Option<NumberOrColumn>,
            example "10.0",
            unit "that of the function",
            range "at least `min`",
            needs "`function`";
        /// Lower and upper bound of the slope.
        slope: Option<RangeSpec>,
            example "{min: -0.2, max: 0.0}",
            unit "that of the function per s",
            range "min at most max",
            needs "`function`";
        /// Monotonicity or sign of the curvature; or a list of both.
        shape: Option<OneOrList<ShapeName>>,
            example "non-increasing",
            needs "`function`";
        /// Times at which the value is prescribed.
        at: Option<OneOrList<Number>>,
            example "0.0",
            unit "s",
            range "within the record",
            needs "`function`, `value`";
        /// Prescribed values, one for all times or one each.
        value: Option<OneOrList<Number>>,
            example "1.0",
            unit "that of the function",
            needs "`function`, `at`";
        /// Mean over the record.
        mean: Option<Number>,
            example "0.75",
            unit "that of the function",
            needs "`function`";
        /// Integral over the record.
        integral: Option<Number>,
            example "18.75",
            unit "that of the function times s",
            needs "`function`";
        /// Two functions; the first equals `ratio` times the second.
        equal: Option<Vec<CoefficientKind>>,
            example "[damping, stiffness]",
            range "two functions";
        /// Ratio of the two functions of `equal`.
        ratio: Option<Number>,
            example "0.1",
            default "1",
            range "not 0",
            needs "`equal`";
        /// Passivity, c - m'/2 >= 0 and k' <= 0: the stored energy never grows.
        passive: Option<bool>, example "true";
        /// Bounds of the natural frequency sqrt(k/m)/2π at every time.
        frequency: Option<RangeSpec>,
            example "{min: 0.1, max: 0.3}",
            unit "Hz",
            range "greater than 0";
        /// Upper bound of the damping ratio |c|/(2 sqrt(k m)).
        damping_ratio: Option<RangeSpec>,
            example "{max: 0.2}",
            range "`max` alone, greater than 0";
        /// Soft constraint: weight of the mean squared violation in J.
        soft: Option<Number>,
            example "10.0",
            default "hard constraint",
            range "greater than 0",
            needs "a constraint other than damping_ratio";
    }
}

choice! {
    /// Monotonicity or sign of the curvature.
    pub type ShapeName = kmcfit_core::internals::constraints::Shape {
        /// Monotonically non-increasing.
        NonIncreasing = "non-increasing",
        /// Monotonically non-decreasing.
        NonDecreasing = "non-decreasing",
        /// Convex.
        Convex = "convex",
        /// Concave.
        Concave = "concave",
    }
}

keys! {
    /// A range; either end may be left out.
    pub struct RangeSpec = "range", expecting "a map such as {min: 0.1, max: 0.5}" {
        /// Lower end.
        min: Option<Number>,
            example "0.1",
            default "unbounded",
            range "at most `max`";
        /// Upper end.
        max: Option<Number>,
            example "0.5",
            default "unbounded",
            range "at least `min`";
    }
}

keys! {
    /// Method, start and stopping tests of the fit.
    pub struct FitSpec = "fit", expecting "a map such as {method: gauss-newton, initial: data}" {
        /// Fit method.
        method: Option<FitMethod>,
            example "lbfgs",
            default "gauss-newton",
            needs "bounds and constraints: gauss-newton, projected-gradient or equation-error; total variation and rules for a weight: gauss-newton or equation-error";
        /// Starting point.
        initial: Option<InitialName>,
            example "data",
            default "functions",
            needs "a method other than equation-error";
        /// Gradient of the cost.
        gradient: Option<GradientName>,
            example "continuous",
            default "discrete",
            needs "a method other than equation-error; continuous: no `sigma` and a sample at every node";
        /// Solver of the quadratic programs of constrained steps (gauss-newton and projected-gradient).
        qp: Option<QpName>,
            example "clarabel",
            default "auto",
            needs "method gauss-newton or projected-gradient";
        /// Test of the bases at the optimum against finer ones: twice as many knots, two halves for a constant.
        refinement: Option<bool>,
            example "false",
            default "true",
            needs "`sigma` in every experiment; a method other than equation-error";
        /// Number of step pairs that L-BFGS stores.
        memory: Option<Count>,
            example "20",
            default "20",
            range "1 or more",
            needs "`method: lbfgs`";
        /// Stopping tests; the first one met ends the fit.
        stop: Option<StopSpec>,
            example "{iterations: 200, cost_ratio: 1e-4}",
            default "{iterations: 1000, tolerance: 1e-10}",
            needs "a method other than equation-error";
    }
}

choice! {
    /// Fit method.
    pub enum FitMethod {
        /// Steepest descent.
        SteepestDescent = "steepest-descent",
        /// Limited-memory BFGS.
        Lbfgs = "lbfgs",
        /// Projected gradient, with constraints.
        ProjectedGradient = "projected-gradient",
        /// Gauss-Newton, with constraints.
        GaussNewton = "gauss-newton",
        /// Minimum of the equation error, with constraints; no response is simulated.
        EquationError = "equation-error",
    }
}

choice! {
    /// Starting point of a fit.
    pub type InitialName = kmcfit_core::internals::solvers::Initial {
        /// The start values of the functions.
        Functions = "functions",
        /// The minimum of the equation error of the smoothed record.
        Data = "data",
    }
}

choice! {
    /// Gradient of the cost.
    pub type GradientName = kmcfit_core::internals::objective::GradientKind {
        /// Exact gradient of the discretised cost (discrete adjoint).
        Discrete = "discrete",
        /// Discretised adjoint differential equation (continuous adjoint).
        Continuous = "continuous",
    }
}

choice! {
    /// Solver of quadratic programs.
    pub type QpName = kmcfit_core::QpSolver {
        /// Clipping, elimination or an interior-point method along time where they apply, Clarabel otherwise.
        Auto = "auto",
        /// Clarabel for every constrained step.
        Clarabel = "clarabel",
    }
}

keys! {
    /// Stopping tests; the first one met ends the fit.
    pub struct StopSpec = "stop", expecting "a map such as {iterations: 1000, cost_ratio: 1e-4}" {
        /// Iteration limit; without another test exactly this number of iterations.
        iterations: Option<Count>, example "200", default "1000";
        /// Limit of J/J0 for convergence (with the gradient's limit, if given).
        cost_ratio: Option<Number>,
            example "1e-4",
            unit "part of the first J",
            range "greater than 0";
        /// Limit of the squared gradient norm relative to its initial value, for convergence.
        gradient_ratio: Option<Number>,
            example "1e-4",
            unit "part of the first G^2",
            range "greater than 0";
        /// Relative change of J and of the functions in one iteration, for convergence.
        tolerance: Option<Number>,
            example "1e-10",
            default "1e-10, if no other rule is given",
            range "greater than 0";
        /// Relative change of the functions in one iteration, for convergence.
        step: Option<Number>,
            example "1e-12",
            range "greater than 0";
        /// Time limit.
        seconds: Option<Number>,
            example "60",
            unit "s",
            range "greater than 0";
    }
}

keys! {
    /// True functions, for reports only.
    pub struct TruthSpec = "truth", expecting "a map such as {data: truth.csv}" {
        /// Table of the true functions with times in `t_s`, relative to the model file.
        data: Text, example "truth.csv";
        /// Names of its columns.
        columns: Option<ByCoefficient<TruthColumns>>,
            example "{mass: m}",
            default "mass_kg, damping_N_s_per_m, stiffness_N_per_m, …";
    }
}
