//! Verdict on a fit: may its estimates be used?
//!
//! The verdict is the worst level of its reasons. Each reason is one test of the fit: its end, the fit of the samples, the residuals after the
//! noise model, the time steps, the bases, missing force terms, the inputs, and what the samples identify.

use super::FitAssessment;
use super::FitWarning;
use super::classical::ClassicalEstimate;
use super::implausible::Implausible;
use super::plausibility::Unidentified;
use super::record_error::RecordError;
use super::rivals::AmplitudeRival;
use crate::identifiability::{
    Classification, FunctionClassification, ScaleSource, scale_source, structural_rank,
};
use crate::objective::channel_fit_percent;
use crate::problem::Problem;
use crate::record::Channel;
use crate::signal::clipped;
use crate::solvers::{Fit, MissingTerm, Status};
use crate::system::InputQuantity;
use serde::{Deserialize, Serialize};

/// Level of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictLevel {
    /// All tests passed: the estimates and their intervals can be used.
    Adequate,
    /// A reason limits the estimates, or an engineer must decide whether it does.
    Check,
    /// The estimates are not those of the system.
    Inadequate,
}

/// A reason of a verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum VerdictReason {
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
    /// The model does not explain the samples.
    PoorFit {
        /// Fit of the worst channel, per cent.
        fit_percent: f64,
    },
    /// The residuals are a multiple of the stated sigma.
    BeyondSigma {
        /// Residuals of the worst channel over its sigma.
        times: f64,
    },
    /// The error of the time steps exceeds the residuals.
    CoarseSteps {
        /// Change by halving the step, relative to the root-mean-square residual.
        times: f64,
    },
    /// The fit ended before it converged.
    NotConverged {
        /// Status at the end.
        status: Status,
    },
    /// The residuals show a term that the model does not have.
    MissingTerm(MissingTerm),
    /// Functions that vary with time, or constants and terms that depend on the amplitude.
    TimeOrAmplitude(AmplitudeRival),
    /// The residuals of a channel have a mean.
    ResidualMean {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
    },
    /// The estimates depend on the width over which Coulomb friction is smoothed.
    FrictionWidth {
        /// Name of the estimate with the largest shift.
        estimate: String,
        /// True if a larger width leaves smaller residuals.
        is_small: bool,
    },
    /// Two modes vibrate in a record.
    SecondMode {
        /// Their frequencies, Hz, the stronger first.
        frequencies: [f64; 2],
    },
    /// Many samples equal the largest one.
    Saturation {
        /// Name of the channel.
        channel: String,
    },
    /// A record with the samples of another one.
    RepeatedRecord {
        /// Name of the experiment.
        experiment: String,
        /// Name of the other one.
        other: String,
    },
    /// Faulty samples that are used.
    FaultySamples {
        /// Name of the experiment.
        experiment: String,
        /// Name of the channel.
        channel: String,
        /// The fault.
        fault: SampleFault,
    },
    /// An estimated delay beyond its limits.
    DelayAtLimit {
        /// Name of the parameter.
        parameter: String,
    },
    /// The residuals are those of errors of a measured input, or of a missing term.
    DisturbedInput {
        /// Name of the experiment.
        experiment: String,
        /// The input.
        input: InputQuantity,
    },
    /// The innovations of a channel are coherent with a measured input.
    CoherentResiduals {
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
    },
    /// The force is negligible beside the inertia force.
    NegligibleForce {
        /// Name of the experiment.
        experiment: String,
    },
    /// A finer basis fits significantly better.
    CoarseBasis {
        /// Name of the function.
        function: String,
    },
    /// Functions can vary within the periods of the vibration.
    FastVariation {
        /// Names of the functions.
        functions: Vec<String>,
    },
    /// A function oscillates, as the sum of two modes makes it.
    Oscillates {
        /// Name of the function.
        function: String,
        /// Frequency of the oscillation, Hz.
        frequency: f64,
    },
    /// The interpolation of an input loses a share of it that is not small beside the standard errors.
    InterpolationLoss {
        /// The input.
        input: InputQuantity,
        /// Share lost at the natural frequency.
        share: f64,
    },
    /// Residuals that are not white after the noise model.
    ColouredResiduals,
    /// Other frequencies match the samples as well.
    Aliased {
        /// Samples per period.
        per_period: f64,
    },
    /// A mass, damping or stiffness is negative at most times.
    Negative {
        /// Name of the function.
        function: String,
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
    /// The data show that a unit may be wrong: magnitudes, the ratio of two channels, or the mass that a force implies.
    DoubtfulUnits,
    /// A classical estimate and that of the fit differ by more than their intervals.
    ClassicalDisagrees(ClassicalEstimate),
    /// An error of a record explains the residuals.
    #[serde(untagged)]
    RecordError(RecordError),
}

/// A fault of samples, found before the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleFault {
    /// Samples held at a constant value.
    Dropouts,
    /// Values that stand for missing samples.
    MissingCodes,
    /// Single samples far from their neighbours.
    Spikes,
    /// Gaps in the samples of an input.
    InputGaps,
    /// An input with quantisation steps that are not small beside the residuals.
    CoarseInput,
}

impl VerdictReason {
    /// Level of the reason.
    pub fn level(&self) -> VerdictLevel {
        match self {
            Self::Failed { .. }
            | Self::NoSystem { .. }
            | Self::PoorFit { .. }
            | Self::BeyondSigma { .. }
            | Self::CoarseSteps { .. }
            | Self::RecordError(RecordError::InputSign { .. }) => VerdictLevel::Inadequate,
            _ => VerdictLevel::Check,
        }
    }
}

/// Level of a verdict with these reasons.
pub fn verdict_level(reasons: &[VerdictReason]) -> VerdictLevel {
    let levels = reasons.iter().map(VerdictReason::level);
    levels.max().unwrap_or(VerdictLevel::Adequate)
}

/// Reasons from a fit and its assessment, those of the highest level first; `None` for the assessment of an equation error. Those from the
/// data and from validation records are added by the application.
pub fn verdict_reasons(
    problem: &Problem,
    fit: &Fit,
    assessment: Option<&FitAssessment>,
) -> Vec<VerdictReason> {
    let mut reasons = Vec::new();
    reasons.extend(ending(fit.outcome.status));
    if let Some(assessment) = assessment {
        let plausibility = &assessment.plausibility;
        // A missing term, a second mode or an error of a record explains other reasons.
        let (causes, others): (Vec<_>, Vec<_>) = plausibility.warnings.iter().partition(is_cause);
        let is_explained = !causes.is_empty();
        let is_new = |w: &&FitWarning| match w {
            FitWarning::CoherentResiduals { .. }
            | FitWarning::DisturbedInput { .. }
            | FitWarning::ClassicalDisagrees(_) => !is_explained,
            _ => true,
        };
        let others = others.into_iter().filter(is_new);
        reasons.extend(
            causes
                .into_iter()
                .filter_map(|w| of_warning(problem, fit, w)),
        );
        match &plausibility.unidentified {
            Some(Unidentified::Failed) => {}
            Some(reason) => reasons.push(VerdictReason::NoSystem {
                reason: reason.clone(),
            }),
            None => {
                reasons.extend(others.filter_map(|w| of_warning(problem, fit, w)));
                reasons.extend(of_classifications(&assessment.classifications));
                let is_classified = !assessment.classifications.is_empty();
                reasons.extend(of_rank(problem, is_classified));
            }
        }
    } else {
        reasons.push(VerdictReason::EquationError);
    }
    if !reasons.iter().any(is_rank) {
        reasons.extend(of_scale(problem));
    }
    reasons.extend(saturations(problem));
    // What the basis permits explains less than what the samples show.
    let is_general = |reason: &VerdictReason| matches!(reason, VerdictReason::FastVariation { .. });
    reasons.sort_by_key(|reason| (std::cmp::Reverse(reason.level()), is_general(reason)));
    reasons
}

/// True for warnings that name the cause of others.
fn is_cause(warning: &&FitWarning) -> bool {
    matches!(
        warning,
        FitWarning::MissingTerm(_) | FitWarning::SecondMode { .. } | FitWarning::RecordError(_)
    )
}

/// Channels in which many samples equal the largest one.
fn saturations(problem: &Problem) -> Vec<VerdictReason> {
    let is_cut = |c: &&Channel| {
        let plain = c.before_filter();
        plain.is_some_and(|plain| clipped(plain.observed()).is_some())
    };
    let each = problem.channels().filter(is_cut);
    let each = each.map(|c| VerdictReason::Saturation {
        channel: c.kind().name().to_owned(),
    });
    each.collect()
}

fn ending(status: Status) -> Option<VerdictReason> {
    match status {
        Status::Converged | Status::Completed => None,
        Status::Failed | Status::Infeasible => Some(VerdictReason::Failed { status }),
        _ => Some(VerdictReason::NotConverged { status }),
    }
}

fn of_warning(problem: &Problem, fit: &Fit, warning: &FitWarning) -> Option<VerdictReason> {
    Some(match warning {
        FitWarning::BeyondSigma { times } => VerdictReason::BeyondSigma { times: *times },
        FitWarning::CoarseSteps { times } => VerdictReason::CoarseSteps { times: *times },
        FitWarning::PoorFit => VerdictReason::PoorFit {
            fit_percent: worst_fit(problem, fit),
        },
        FitWarning::Coloured { .. } => VerdictReason::ColouredResiduals,
        FitWarning::Correlated => return None,
        FitWarning::Aliased { per_period, .. } => VerdictReason::Aliased {
            per_period: *per_period,
        },
        FitWarning::CoarseBasis(coarse) => VerdictReason::CoarseBasis {
            function: coarse.function.clone(),
        },
        FitWarning::FastVariation { functions, .. } => VerdictReason::FastVariation {
            functions: functions.clone(),
        },
        FitWarning::Oscillates {
            function,
            frequency,
        } => VerdictReason::Oscillates {
            function: function.clone(),
            frequency: *frequency,
        },
        FitWarning::InterpolationLoss { input, share, .. } => VerdictReason::InterpolationLoss {
            input: *input,
            share: *share,
        },
        FitWarning::DisturbedInput {
            experiment, input, ..
        } => VerdictReason::DisturbedInput {
            experiment: experiment.clone(),
            input: *input,
        },
        FitWarning::CoherentResiduals {
            channel,
            input,
            share,
            ..
        } => VerdictReason::CoherentResiduals {
            channel: channel.clone(),
            input: *input,
            share: *share,
        },
        FitWarning::ContradictedInputSigma {
            experiment, input, ..
        } => VerdictReason::ContradictedInputSigma {
            experiment: experiment.clone(),
            input: *input,
        },
        FitWarning::MissingTerm(term) => VerdictReason::MissingTerm(*term),
        FitWarning::TimeOrAmplitude(rival) => VerdictReason::TimeOrAmplitude(rival.clone()),
        FitWarning::SecondMode { frequencies, .. } => VerdictReason::SecondMode {
            frequencies: *frequencies,
        },
        FitWarning::ClassicalDisagrees(e) => VerdictReason::ClassicalDisagrees(e.clone()),
        FitWarning::RecordError(error) => VerdictReason::RecordError(error.clone()),
        FitWarning::ResidualMean {
            experiment,
            channel,
            ..
        } => VerdictReason::ResidualMean {
            experiment: experiment.clone(),
            channel: channel.clone(),
        },
        FitWarning::FrictionWidth {
            estimate,
            width,
            better,
            ..
        } => VerdictReason::FrictionWidth {
            estimate: estimate.clone(),
            is_small: better > width,
        },
        FitWarning::Negative { function } => VerdictReason::Negative {
            function: function.clone(),
        },
        FitWarning::NegligibleForce { experiment } => VerdictReason::NegligibleForce {
            experiment: experiment.clone(),
        },
    })
}

/// Fit of the worst channel, per cent.
fn worst_fit(problem: &Problem, fit: &Fit) -> f64 {
    let channels = problem.predicted(&fit.best.evaluation);
    let fits = channels.map(|(channel, predicted)| channel_fit_percent(channel, predicted));
    fits.fold(100.0, f64::min)
}

fn of_classifications(classifications: &[FunctionClassification]) -> Option<VerdictReason> {
    let is_open = |c: &&FunctionClassification| {
        matches!(
            c.verdict,
            Classification::NotIdentified | Classification::PartlyIdentified(_)
        )
    };
    let open = classifications.iter().filter(is_open);
    let functions: Vec<String> = open.map(|c| c.name.clone()).collect();
    (!functions.is_empty()).then_some(VerdictReason::NotIdentified { functions })
}

fn is_rank(reason: &VerdictReason) -> bool {
    matches!(reason, VerdictReason::RankDeficient { .. })
}

/// Rank deficiency by the structural rank, for models without classifications.
fn of_rank(problem: &Problem, is_classified: bool) -> Option<VerdictReason> {
    let rank = structural_rank(problem);
    let is_deficient = rank.rank_bound < rank.parameters && !is_classified;
    is_deficient.then_some(VerdictReason::RankDeficient {
        rank_bound: rank.rank_bound,
        parameters: rank.parameters,
    })
}

fn of_scale(problem: &Problem) -> Option<VerdictReason> {
    // What the user states is no doubt about the model: a fixed function is an assumption.
    (scale_source(problem) == ScaleSource::Model).then_some(VerdictReason::OnlyRatios)
}
