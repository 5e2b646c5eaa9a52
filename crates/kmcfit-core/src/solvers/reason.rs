//! Reasons for which a fit ended.

use crate::qp::ConicStatus;
use crate::simulate::SimulationError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;

/// A value and the limit that it is within.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// The value.
    pub value: f64,
    /// The limit.
    pub limit: f64,
}

/// Why a fit ended; as text, one sentence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Reason {
    /// The ratios of cost and gradient to those at the start are within their limits.
    Ratios {
        /// `J / J0`, if there is a limit.
        cost: Option<Within>,
        /// `G^2 / G0^2`, if there is a limit.
        gradient: Option<Within>,
    },
    /// The last iteration changed every function by at most this share of its size.
    SmallChange(f64),
    /// The last iteration lowered J by a small share.
    SmallDecrease {
        /// Share of J.
        decrease: f64,
        /// Largest change of a function, relative to its size.
        change: f64,
    },
    /// The iterations ran out before a stopping test was met.
    IterationLimit(u64),
    /// There is no stopping test, and all iterations were run.
    AllIterations(u64),
    /// The wall-clock limit was reached.
    TimeLimit(Duration),
    /// Ended from outside.
    Interrupted,
    /// All functions are fixed.
    NoParameters,
    /// The readings, or their squares, are zero.
    ZeroReadings,
    /// The cost at the start is zero.
    ExactStart,
    /// The squares of the readings overflow.
    Overflow,
    /// The cost is zero to machine precision.
    ZeroCost,
    /// The residuals are negligible beside the measurements.
    NegligibleResiduals,
    /// The linearised cost cannot be lowered.
    NoPredictedDecrease,
    /// The step of the linearised problem changes every function by at most this share of its size.
    NoPredictedChange(f64),
    /// No Gauss-Newton step lowers the cost.
    NoLowerGaussNewtonStep,
    /// None of so many trial steps lowers the cost.
    NoLowerTrial(u32),
    /// No step of the line search lowers the cost enough.
    NoLowerLineStep,
    /// The projected gradient is zero to machine precision.
    ZeroProjectedGradient,
    /// The cost rises towards the projected gradient.
    NoDescentToProjection,
    /// No step towards the projected gradient lowers the cost.
    NoLowerStepToProjection,
    /// How a quadratic program ended.
    Program(ConicStatus),
    /// The minimum of the equation error.
    EquationError {
        /// How the quadratic program ended, if one was needed.
        program: Option<ConicStatus>,
        /// Whether the mass is positive at all times.
        has_mass: bool,
    },
    /// The start has no response.
    #[serde(skip)]
    NoResponse(SimulationError),
    /// No start within the constraints has a response.
    #[serde(skip)]
    NoFeasibleResponse(SimulationError),
    /// A record has no equation error.
    #[serde(skip)]
    UnsupportedRecord(UnsupportedRecord),
    /// A stopping test was met where the first-order condition does not hold.
    #[serde(skip)]
    NoMinimum {
        /// The test.
        met: Box<Reason>,
        /// The part of the condition that fails; `None` where it could not be measured.
        failure: Option<ConditionFailure>,
    },
}

/// A part of the first-order condition that does not hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConditionFailure {
    /// A constraint is violated by this share of its scale.
    Violation(f64),
    /// Moving to the bounds promises to lower J by this share.
    Complementarity(f64),
    /// The linearised problem promises to lower J by this share.
    Stationarity(f64),
}

/// A record without an equation error.
#[derive(Debug, Clone, PartialEq)]
pub struct UnsupportedRecord {
    /// Index of the experiment.
    pub experiment: usize,
    /// Its name.
    pub name: String,
    /// What is missing.
    pub reason: MissingMeasurement,
}

/// What a record lacks for its equation error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingMeasurement {
    /// A quadratic loss.
    QuadraticLoss,
    /// Sensors with known gain and offset.
    KnownSensors,
    /// An acceleration that oscillates for long enough.
    Oscillation,
    /// A displacement, or accelerations of equal spacing alone: others leave no way to filter force and base alike.
    FilteredDrive,
    /// Readings.
    Readings,
    /// Anything that moves.
    Motion,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ratios { cost, gradient } => ratios(f, cost.as_ref(), gradient.as_ref()),
            Self::SmallChange(change) => write!(
                f,
                "the last iteration changed no function by more than {change:.1e} of its size"
            ),
            Self::SmallDecrease { decrease, change } => write!(
                f,
                "the last iteration lowered J by a fraction of {decrease:.1e} and changed no \
                 function by more than {change:.1e} of its size"
            ),
            Self::IterationLimit(iterations) => {
                write!(f, "no stopping test was met in {iterations} iterations")
            }
            Self::AllIterations(iterations) => {
                write!(f, "ran the {iterations} iterations asked for")
            }
            Self::TimeLimit(limit) => {
                write!(f, "the limit of {} s is reached", limit.as_secs_f64())
            }
            Self::NoPredictedChange(change) => {
                write!(
                    f,
                    "no function is to change by more than {change:.1e} of its size"
                )
            }
            Self::NoLowerTrial(trials) => {
                write!(f, "none of the {trials} trial steps lowers the cost")
            }
            Self::Program(status) => f.write_str(status.sentence()),
            Self::EquationError { program, has_mass } => equation_error(f, *program, *has_mass),
            Self::NoResponse(breakdown) => write!(f, "{breakdown}"),
            Self::NoFeasibleResponse(breakdown) => write!(
                f,
                "no start within the constraints has a motion ({breakdown}); what is kept is the \
                 start as given, which breaks them"
            ),
            Self::UnsupportedRecord(unsuited) => write!(f, "{unsuited}"),
            Self::NoMinimum { met, failure } => match failure {
                Some(failure) => write!(f, "{met}; but this is no minimum: {failure}"),
                None => write!(
                    f,
                    "{met}; whether this is a minimum could not be measured: {}",
                    ConicStatus::Stalled.sentence()
                ),
            },
            plain => f.write_str(plain.sentence()),
        }
    }
}

impl Reason {
    /// The sentence of a reason without numbers.
    fn sentence(&self) -> &'static str {
        match self {
            Self::Interrupted => "asked to stop; the best point so far is kept",
            Self::NoParameters => "there is nothing to fit: every function is fixed",
            Self::ZeroReadings => {
                "there is nothing to explain: the readings, or their squares, are zero"
            }
            Self::ExactStart => "the start fits exactly",
            Self::Overflow => {
                "the squares of the readings leave the range of numbers: give them in a larger unit"
            }
            Self::ZeroCost => "the cost is zero to rounding",
            Self::NegligibleResiduals => "the residuals are below 1e-10 of the measurements",
            Self::NoPredictedDecrease => "the linearised cost cannot be lowered any further",
            Self::NoLowerGaussNewtonStep => "no Gauss-Newton step lowers the cost",
            Self::NoLowerLineStep => "no step along the gradient lowers the cost enough",
            Self::ZeroProjectedGradient => "the projected gradient vanishes to rounding",
            Self::NoDescentToProjection => "the cost does not fall towards the projected gradient",
            Self::NoLowerStepToProjection => {
                "no step towards the projected gradient lowers the cost"
            }
            _ => "",
        }
    }
}

fn ratios(
    f: &mut fmt::Formatter<'_>,
    cost: Option<&Within>,
    gradient: Option<&Within>,
) -> fmt::Result {
    let named = [("J/J0", cost), ("G^2/G0^2", gradient)];
    let given = named
        .into_iter()
        .filter_map(|(name, test)| Some((name, test?)));
    for (i, (name, Within { value, limit })) in given.enumerate() {
        let and = if i == 0 { "" } else { " and " };
        write!(f, "{and}{name} {value:.3e} <= {limit:.3e}")?;
    }
    Ok(())
}

fn equation_error(
    f: &mut fmt::Formatter<'_>,
    program: Option<ConicStatus>,
    has_mass: bool,
) -> fmt::Result {
    let how = match program {
        None => "one sparse factorisation",
        Some(ConicStatus::Almost) => "a quadratic program, but to reduced accuracy only",
        Some(_) => "a quadratic program",
    };
    let but = match has_mass {
        true => "",
        false => {
            "; its mass is not positive at all times, so no device moves so: give the mass a `min`"
        }
    };
    write!(
        f,
        "the equation error is convex, and its minimum was found by {how}{but}"
    )
}

impl fmt::Display for ConditionFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Violation(share) => {
                write!(f, "a constraint is violated by {share:.1e} of its scale")
            }
            Self::Complementarity(share) => write!(
                f,
                "moving to its bounds promises to lower J by a fraction of {share:.1e}"
            ),
            Self::Stationarity(share) => write!(
                f,
                "the linearised cost can be lowered by a fraction of {share:.1e}"
            ),
        }
    }
}

impl fmt::Display for UnsupportedRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.reason)
    }
}

impl std::error::Error for UnsupportedRecord {}

impl fmt::Display for MissingMeasurement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::QuadraticLoss => "the equation error knows no robust loss",
            Self::KnownSensors => "the equation error takes the sensors as known",
            Self::Oscillation => "the acceleration is too short or does not oscillate",
            Self::FilteredDrive => {
                "its force or base cannot be filtered as its motion is, which is integrated from other \
                 channels than one of equally spaced accelerations"
            }
            Self::Readings => "there are too few readings",
            Self::Motion => "nothing moves",
        })
    }
}
