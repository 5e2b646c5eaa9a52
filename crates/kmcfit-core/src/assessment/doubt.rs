//! Doubts about a fit: reasons of its verdict, and what limits its intervals.

use super::classical::ClassicalEstimate;
use super::implausible::Implausible;
use super::record_error::RecordError;
use crate::candidates::Candidate;
use crate::record::ScoreCovariance;
use crate::severity::Severity;
use crate::solvers::{MissingTerm, Status};
use crate::step::SimulationError;
use crate::system::InputQuantity;
use serde::Serialize;

/// A doubt about a fit: one test that it did not pass.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Doubt {
    /// The residuals are a multiple of sigma: standard errors are unknown.
    BeyondSigma {
        /// Residuals of the worst channel over its sigma.
        times: f64,
    },
    /// Halving the step changes the response by a multiple of the residuals: standard errors are unknown.
    CoarseSteps {
        /// Change relative to the root-mean-square residual.
        times: f64,
    },
    /// The residuals are large and not white: standard errors are unknown.
    PoorFit {
        /// Fit of the worst channel, per cent.
        fit_percent: f64,
    },
    /// The residuals are not white, beyond the noise model.
    Coloured {
        /// Covariance of the intervals: that of the model gives standard errors that are too small.
        covariance: ScoreCovariance,
    },
    /// The noise of a channel is estimated as correlated, and the intervals account for it.
    Correlated,
    /// Systems of other frequencies match equally spaced samples as well: standard errors are unknown.
    Aliased {
        /// Samples per period.
        per_period: f64,
        /// Identified natural frequency, Hz.
        frequency: f64,
    },
    /// The model with one thing more explains the samples better: the best candidate, then those that are about as good.
    Preferred {
        /// The candidates.
        candidates: Vec<Candidate>,
    },
    /// Constants with one thing more explain the samples as well as functions that vary.
    AsGood {
        /// The candidates.
        candidates: Vec<Candidate>,
    },
    /// Functions can vary within the periods of the vibration, which cannot be told from offsets, harmonics and second modes.
    FastVariation {
        /// Names of the functions.
        functions: Vec<String>,
        /// Most parameters per period.
        per_period: f64,
    },
    /// A function oscillates, as the sum of two modes that beat makes it.
    Oscillates {
        /// Name of the function.
        function: String,
        /// Frequency of the oscillation, Hz.
        frequency: f64,
    },
    /// The interpolation between the samples of an input loses a share of it, which the coefficients have lost as well.
    InterpolationLoss {
        /// Name of the experiment.
        experiment: String,
        /// The input.
        input: InputQuantity,
        /// Share lost at the natural frequency.
        share: f64,
        /// Largest shift of an estimate by cubics in place of the lines, in standard errors.
        errors: f64,
    },
    /// The residuals are those of errors of a measured input, or of a term missing from the equation of motion.
    DisturbedInput {
        /// Name of the experiment.
        experiment: String,
        /// The input.
        input: InputQuantity,
        /// Sigma of errors of the input that leave such residuals, in its SI unit.
        sigma: f64,
        /// The same relative to the input, root mean square.
        share: f64,
    },
    /// The innovations of a channel are coherent with a measured input: dynamics are missing from the model.
    CoherentResiduals {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
        /// The input.
        input: InputQuantity,
        /// Share of their variance.
        share: f64,
    },
    /// The residuals contradict the stated sigma of an input.
    ContradictedInputSigma {
        /// Name of the experiment.
        experiment: String,
        /// The input.
        input: InputQuantity,
        /// Stated sigma, in the SI unit of the input.
        given: f64,
        /// Sigma of the largest likelihood, in the SI unit of the input.
        likely: f64,
    },
    /// The residuals of the equation of motion show a term that the model does not have.
    MissingTerm(MissingTerm),
    /// Two modes explain the samples of a record.
    SecondMode {
        /// Name of the experiment.
        experiment: String,
        /// Their natural frequencies, Hz, the stronger first.
        frequencies: [f64; 2],
    },
    /// Half the width of Coulomb friction shifts an estimate by more than half a standard error and leaves residuals as small, or a larger width
    /// leaves smaller ones.
    FrictionWidth {
        /// Name of the estimate with the largest shift.
        estimate: String,
        /// Its shift, in its unit; `None` for a function with several parameters.
        shift: Option<f64>,
        /// Unit of the shift.
        unit: String,
        /// The shift in standard errors.
        errors: f64,
        /// Width, m/s.
        width: f64,
        /// A width that leaves smaller residuals, or the smallest one that leaves as small ones, m/s.
        better: f64,
    },
    /// A function is negative at most times, which violates passivity.
    Negative {
        /// Name of the function.
        function: String,
    },
    /// The measured force is negligible beside the inertia force of the system.
    NegligibleForce {
        /// Name of the experiment.
        experiment: String,
    },
    /// A classical estimate and that of the fit differ by more than their intervals.
    ClassicalDisagrees(ClassicalEstimate),
    /// The fit failed or no parameters satisfy the constraints.
    Failed {
        /// Status at the end.
        status: Status,
    },
    /// The optimum identifies no system.
    NoSystem {
        /// The reason.
        #[serde(skip)]
        reason: Unidentified,
    },
    /// The fit ended before it converged.
    NotConverged {
        /// Status at the end.
        status: Status,
    },
    /// Many samples equal the largest one.
    Saturation {
        /// Name of the channel.
        channel: String,
    },
    /// The quantisation error of an input is not small beside the residuals, and the intervals do not contain it.
    CoarseInput {
        /// Name of the experiment.
        experiment: String,
        /// Name of the channel.
        channel: String,
        /// Standard deviation of the error relative to that of the samples.
        #[serde(skip)]
        share: f64,
    },
    /// Values that stand for missing samples, and are not stated as such.
    MissingCodes {
        /// Name of the experiment.
        #[serde(skip)]
        experiment: String,
        /// Kinds of the channels.
        channels: Vec<String>,
        /// The values, in the unit of the file.
        codes: Vec<f64>,
    },
    /// Samples of a channel are far from the others: outliers or spikes.
    Outliers {
        /// Name of the experiment.
        experiment: String,
        /// Name of the channel.
        channel: String,
    },
    /// A record without an input does not decay: an unmeasured force keeps it up.
    #[serde(rename = "unmeasured_force")]
    KeptUp {
        /// Name of the experiment.
        #[serde(skip)]
        experiment: String,
        /// Kind of the channel.
        channel: String,
    },
    /// An estimated delay beyond its limits.
    DelayAtLimit {
        /// Name of the parameter.
        parameter: String,
    },
    /// A validation record is not predicted.
    NotPredicted {
        /// Name of the record.
        experiment: String,
        /// Fit of its worst channel, per cent.
        fit_percent: f64,
    },
    /// Functions that the samples do not identify, or only at some times.
    NotIdentified {
        /// Names of the functions.
        functions: Vec<String>,
    },
    /// Fewer parameter combinations are identifiable than parameters are estimated.
    RankDeficient {
        /// Largest number of identifiable combinations.
        rank_bound: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// Without a measured force the samples determine ratios to the mass only, and no function is fixed.
    OnlyRatios,
    /// No input is measured, and an unknown force acts: the equation error does not determine the damping.
    UnmeasuredForce,
    /// The equation error neglects the noise of the response, which biases its estimates.
    EquationError,
    /// The residual of the equation of motion is a large share of its largest force.
    EquationResidual {
        /// Root mean square of the residual relative to that of the largest force.
        share: f64,
    },
    /// The natural frequency or the response is outside the range of mechanical systems.
    ImplausibleUnits(Implausible),
    /// A request to end left out a part of the assessment.
    Stopped {
        /// The parts.
        not_done: Vec<&'static str>,
    },
    /// The mass is unknown: the other coefficients are ratios to it.
    MassUnknown,
    /// Units that neither the model nor a file states.
    UnitsAssumed {
        /// Quantities with the units: `force in N`.
        units: Vec<String>,
    },
    /// The clock of a record, on which all its columns are, cannot be tested.
    Clock {
        /// Name of the experiment.
        experiment: String,
    },
    /// The unit of the only channel of a record with an input cannot be tested.
    Unit {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
    },
    /// The values of the fixed functions that determine the scale of mass, damping and stiffness, which the samples leave open.
    Scale {
        /// Names of the functions.
        functions: Vec<String>,
    },
    /// An error of a record explains the residuals.
    #[serde(untagged)]
    RecordError(RecordError),
}

/// Reason for which an optimum identifies no system.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Unidentified {
    /// The fit failed.
    Failed,
    /// The simulation with half the step fails.
    NoResponseOnHalfStep {
        /// Error of the simulation.
        #[serde(skip)]
        error: SimulationError,
    },
    /// Halving the step changes the response by more than a tenth of the largest sample.
    StepDependent,
    /// The residuals of all channels exceed twice the variation of their samples.
    Unrelated,
    /// Noise of the size of the samples would be matched equally well.
    Noise,
}

impl Doubt {
    /// What it means for the estimates.
    pub fn severity(&self) -> Severity {
        match self {
            Self::Failed { .. }
            | Self::NoSystem { .. }
            | Self::PoorFit { .. }
            | Self::BeyondSigma { .. }
            | Self::CoarseSteps { .. }
            | Self::RecordError(RecordError::InputSign { .. }) => Severity::Inadequate,
            Self::Correlated | Self::KeptUp { .. } => Severity::Warning,
            Self::MassUnknown
            | Self::UnitsAssumed { .. }
            | Self::Clock { .. }
            | Self::Unit { .. }
            | Self::Scale { .. } => Severity::Note,
            _ => Severity::Check,
        }
    }

    /// True for what names the cause of other doubts.
    pub fn is_cause(&self) -> bool {
        match self {
            Self::Preferred { candidates } => candidates.first().is_some_and(Candidate::explains),
            Self::MissingTerm(_) | Self::SecondMode { .. } | Self::RecordError(_) => true,
            _ => false,
        }
    }
}
