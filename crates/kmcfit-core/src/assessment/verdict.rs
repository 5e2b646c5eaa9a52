//! Verdict on a fit: may its estimates be used?
//!
//! The verdict is the worst level of its reasons. Each reason is one test of the fit: its end, the fit of the samples, the residuals after the
//! noise model, the time steps, the bases, missing force terms, the inputs, and what the samples identify.

use super::FitAssessment;
use super::{Doubt, Unidentified};
use crate::identifiability::{
    Classification, FunctionClassification, ScaleSource, scale_source, structural_rank,
};
use crate::problem::Problem;
use crate::record::Channel;
use crate::severity::Severity;
use crate::signal::clipped;
use crate::solvers::{Fit, Status};
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

impl VerdictLevel {
    /// Level of a verdict whose findings are of at most this severity.
    pub fn of(most: Severity) -> Self {
        match most {
            Severity::Detail | Severity::Note | Severity::Warning => Self::Adequate,
            Severity::Check => Self::Check,
            Severity::Inadequate => Self::Inadequate,
        }
    }
}

/// Reasons from a fit and its assessment, those of the highest level first; `None` for the assessment of an equation error. Those from the
/// data, from validation records and from a request to end are added by the application.
pub fn verdict_reasons(
    problem: &Problem,
    fit: &Fit,
    assessment: Option<&FitAssessment>,
) -> Vec<Doubt> {
    let mut reasons = Vec::new();
    reasons.extend(ending(fit.outcome.status));
    if let Some(assessment) = assessment {
        let plausibility = &assessment.plausibility;
        let warnings = plausibility
            .warnings
            .iter()
            .filter(|w| w.severity() >= Severity::Check);
        // A missing term, a second mode or an error of a record explains other reasons.
        let (causes, others): (Vec<_>, Vec<_>) = warnings.cloned().partition(Doubt::is_cause);
        let is_explained = !causes.is_empty();
        reasons.extend(causes);
        let is_new = |doubt: &Doubt| match doubt {
            Doubt::CoherentResiduals { .. } | Doubt::DisturbedInput { .. } => !is_explained,
            _ => true,
        };
        match &plausibility.unidentified {
            Some(Unidentified::Failed) => {}
            Some(reason) => reasons.push(Doubt::NoSystem {
                reason: reason.clone(),
            }),
            None => {
                reasons.extend(others.into_iter().filter(is_new));
                reasons.extend(of_classifications(&assessment.classifications));
                let is_classified = !assessment.classifications.is_empty();
                reasons.extend(of_rank(problem, is_classified));
            }
        }
    } else {
        reasons.push(Doubt::EquationError);
    }
    if !reasons.iter().any(is_rank) {
        reasons.extend(of_scale(problem));
    }
    reasons.extend(saturations(problem));
    // What the basis permits explains less than what the samples show.
    let is_general = |reason: &Doubt| matches!(reason, Doubt::FastVariation { .. });
    reasons.sort_by_key(|reason| (std::cmp::Reverse(reason.severity()), is_general(reason)));
    reasons
}

/// Channels in which many samples equal the largest one.
fn saturations(problem: &Problem) -> Vec<Doubt> {
    let is_cut = |c: &&Channel| {
        let plain = c.before_filter();
        plain.is_some_and(|plain| clipped(plain.observed()).is_some())
    };
    let each = problem.channels().filter(is_cut);
    let each = each.map(|c| Doubt::Saturation {
        channel: c.kind().name().to_owned(),
    });
    each.collect()
}

fn ending(status: Status) -> Option<Doubt> {
    match status {
        Status::Converged | Status::Completed => None,
        Status::Failed | Status::Infeasible => Some(Doubt::Failed { status }),
        _ => Some(Doubt::NotConverged { status }),
    }
}

fn of_classifications(classifications: &[FunctionClassification]) -> Option<Doubt> {
    let is_open = |c: &&FunctionClassification| {
        matches!(
            c.verdict,
            Classification::NotIdentified | Classification::PartlyIdentified(_)
        )
    };
    let open = classifications.iter().filter(is_open);
    let functions: Vec<String> = open.map(|c| c.name.clone()).collect();
    (!functions.is_empty()).then_some(Doubt::NotIdentified { functions })
}

fn is_rank(reason: &Doubt) -> bool {
    matches!(reason, Doubt::RankDeficient { .. })
}

/// Rank deficiency by the structural rank, for models without classifications.
fn of_rank(problem: &Problem, is_classified: bool) -> Option<Doubt> {
    let rank = structural_rank(problem);
    let is_deficient = rank.rank_bound < rank.parameters && !is_classified;
    is_deficient.then_some(Doubt::RankDeficient {
        rank_bound: rank.rank_bound,
        parameters: rank.parameters,
    })
}

fn of_scale(problem: &Problem) -> Option<Doubt> {
    // What the user states is no doubt about the model: a fixed function is an assumption.
    (scale_source(problem) == ScaleSource::Model).then_some(Doubt::OnlyRatios)
}
