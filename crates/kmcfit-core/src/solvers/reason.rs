//! Reasons for the end of a fit, and their sentences.

use crate::qp::ConicStatus;
use crate::step::SimulationError;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use thiserror::Error;

/// A value and its limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoundedValue {
    /// The value.
    pub value: f64,
    /// The limit.
    pub limit: f64,
}

/// Reason for the end of a fit; displayed as one sentence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Error)]
pub enum Reason {
    /// The ratios of cost and gradient to those at the start are within their limits.
    #[error("{}", ratios(cost.as_ref(), gradient.as_ref()))]
    Ratios {
        /// `J / J0`, if there is a limit.
        cost: Option<BoundedValue>,
        /// `G^2 / G0^2`, if there is a limit.
        gradient: Option<BoundedValue>,
    },
    /// Largest change of a coefficient in the last iteration, relative to its size, and its tolerance.
    #[error(
        "relative change of every coefficient in the last iteration at most {:.1e} (tolerance {:.0e})", .0.value, .0.limit
    )]
    SmallChange(BoundedValue),
    /// The last iteration lowered J by a small share.
    #[error(
        "relative decrease of J in the last iteration {decrease:.1e}, relative change of every coefficient at most {change:.1e}"
    )]
    SmallDecrease {
        /// Share of J.
        decrease: f64,
        /// Largest change of a function, relative to its size.
        change: f64,
    },
    /// The iteration limit was reached before a stopping test was met.
    #[error("no stopping test was met in {}", iterations(*.0))]
    IterationLimit(u64),
    /// All requested iterations were run without a stopping test.
    #[error("{}", all_iterations(*.0))]
    AllIterations(u64),
    /// The wall-clock limit was reached.
    #[error("reached the limit of {} s", .0.as_secs_f64())]
    TimeLimit(Duration),
    /// Interrupted by the user.
    #[error("interrupted; the result is the best point so far")]
    Interrupted,
    /// All functions are fixed.
    #[error("no parameters to estimate: every function is fixed")]
    NoParameters,
    /// The samples, or their squares, are zero.
    #[error("nothing to fit: the samples, or their squares, are zero")]
    ZeroSamples,
    /// The cost at the start is zero.
    #[error("the start values match the record exactly")]
    ExactStart,
    /// The squares of the samples overflow.
    #[error("the squares of the samples overflow: give the samples in a larger unit")]
    Overflow,
    /// The cost is zero to machine precision.
    #[error("the cost is zero to machine precision")]
    ZeroCost,
    /// The residuals are negligible beside the measurements.
    #[error("the residuals are below 1e-10 of the measurements")]
    NegligibleResiduals,
    /// The linearised cost cannot be lowered.
    #[error("the predicted decrease of the cost is below its tolerance")]
    NoPredictedDecrease,
    /// The step of the linearised problem changes every function by at most this share of its size.
    #[error("relative change of every coefficient in the predicted step at most {0:.1e}")]
    NoPredictedChange(f64),
    /// No Gauss-Newton step lowers the cost.
    #[error("no Gauss-Newton step lowers the cost")]
    NoLowerGaussNewtonStep,
    /// None of the trial steps, of the given number, lowers the cost.
    #[error("none of the {0} trial steps lowers the cost")]
    NoLowerTrial(u32),
    /// No step of the line search lowers the cost enough.
    #[error("no step along the gradient lowers the cost enough")]
    NoLowerLineStep,
    /// The projected gradient is zero to machine precision.
    #[error("the projected gradient is zero to machine precision")]
    ZeroProjectedGradient,
    /// The cost rises towards the projected gradient.
    #[error("the cost does not decrease along the projected gradient direction")]
    NoDescentToProjection,
    /// No step towards the projected gradient lowers the cost.
    #[error("no step towards the projected gradient lowers the cost")]
    NoLowerStepToProjection,
    /// Status of a quadratic program.
    #[error("{}", .0.sentence())]
    Program(ConicStatus),
    /// The minimum of the equation error.
    #[error("{}", equation_error(*program, *has_mass))]
    EquationError {
        /// Status of the quadratic program, if one was needed.
        program: Option<ConicStatus>,
        /// True if the mass is positive at all times.
        has_mass: bool,
    },
    /// The simulation at the start fails.
    #[serde(skip)]
    #[error("{0}")]
    NoResponse(SimulationError),
    /// The simulation fails at all feasible starting points.
    #[serde(skip)]
    #[error(
        "the simulation fails at all starting points within the constraints ({0}); nothing was estimated: the result holds the start values of the model, which violate the constraints"
    )]
    NoFeasibleResponse(SimulationError),
    /// A record has no equation error.
    #[serde(skip)]
    #[error("{0}")]
    UnsupportedRecord(UnsupportedRecord),
    /// A stopping test was met, but the first-order condition is violated.
    #[serde(skip)]
    #[error("{met}; {}", no_minimum(failure.as_ref()))]
    NoMinimum {
        /// Stopping test.
        met: Box<Reason>,
        /// Violated part of the condition; `None` where it could not be measured.
        failure: Option<ConditionFailure>,
    },
}

/// A violated part of the first-order condition.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ConditionFailure {
    /// Violation of a constraint, relative to its scale.
    #[error("a constraint is violated by {0:.1e} of its scale")]
    Violation(f64),
    /// Predicted decrease of J by moving to the bounds, as a share of J.
    #[error("moving parameters to their bounds is predicted to lower J by a fraction of {0:.1e}")]
    Complementarity(f64),
    /// Predicted decrease of J by the linearised problem, as a share of J.
    #[error("a step of the linearised problem is predicted to lower J by a fraction of {0:.1e}")]
    Stationarity(f64),
}

/// A record without an equation error.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{name}: {reason}")]
pub struct UnsupportedRecord {
    /// Index of the experiment.
    pub experiment: usize,
    /// Name of the experiment.
    pub name: String,
    /// Missing measurement.
    pub reason: MissingMeasurement,
}

/// Measurement that a record lacks for its equation error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum MissingMeasurement {
    /// Sensors with known gain and offset.
    #[error(
        "the equation error needs known sensors: state gain, offset and drift, or estimate them with `method: gauss-newton`"
    )]
    KnownSensors,
    /// An acceleration that oscillates long enough.
    #[error("the acceleration is too short or does not oscillate")]
    Oscillation,
    /// A displacement, or equally spaced accelerations alone, without a filter or with equally spaced samples at common times; force and
    /// base cannot be filtered consistently with other channels.
    #[error(
        "the force or base cannot be filtered like the response: this needs a displacement (with a `band`, equally spaced samples of \
         all channels at the same times), or equally spaced accelerations alone; otherwise use `method: gauss-newton`"
    )]
    FilteredDrive,
    /// Samples.
    #[error("too few samples")]
    Samples,
    /// A nonzero response.
    #[error("all samples are zero")]
    Motion,
    /// One coordinate.
    #[error("the equation error is that of one coordinate: use `method: gauss-newton`")]
    OneCoordinate,
}

fn iterations(count: u64) -> String {
    match count {
        1 => "1 iteration".into(),
        _ => format!("{count} iterations"),
    }
}

fn all_iterations(count: u64) -> String {
    match count {
        1 => "the iteration requested was run".into(),
        _ => format!("all {count} iterations requested were run"),
    }
}

fn ratios(cost: Option<&BoundedValue>, gradient: Option<&BoundedValue>) -> String {
    let named = [("J/J0", cost), ("G^2/G0^2", gradient)];
    let given = named.into_iter().filter_map(|(name, test)| {
        let BoundedValue { value, limit } = test?;
        Some(format!("{name} {value:.3e} <= {limit:.3e}"))
    });
    given.collect::<Vec<_>>().join(" and ")
}

fn no_minimum(failure: Option<&ConditionFailure>) -> String {
    match failure {
        Some(failure) => format!("however, the first-order condition is violated: {failure}"),
        None => "the first-order condition could not be evaluated: it needs more memory than there is, or its quadratic program could not be solved".to_owned(),
    }
}

fn equation_error(program: Option<ConicStatus>, has_mass: bool) -> String {
    let how = match program {
        None => "one sparse factorisation",
        Some(ConicStatus::Almost) => "a quadratic program, but to reduced accuracy only",
        Some(_) => "a quadratic program",
    };
    let but = match has_mass {
        true => "",
        false => {
            "; its mass is not positive at all times, so the equation of motion cannot be solved: give the mass a `min`"
        }
    };
    format!("the equation error is convex, and its minimum was found by {how}{but}")
}
