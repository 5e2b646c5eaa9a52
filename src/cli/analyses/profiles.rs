//! Profiles of single numbers.

use crate::config::{StudyPlan, StudyTarget};
use crate::report::study::*;
use kmcfit_core::internals::diagnostics::chi_square_one;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::study::Linear;
use kmcfit_core::internals::study::profile::{Interval, ProfileSettings, profile};

/// The number that a target asks about.
pub fn linear(problem: &Problem, target: &StudyTarget) -> Option<Linear> {
    match target {
        StudyTarget::Value { function, time } => Linear::value(problem, *function, *time),
        StudyTarget::Mean { function } => Some(Linear::mean(problem, *function)),
        StudyTarget::Scalar { index } => Some(Linear::scalar(problem, *index)),
    }
}

/// One profile.
///
/// # Errors
/// Why there is none.
pub fn profile_of(
    problem: &Problem,
    theta: &[f64],
    of: &Linear,
    plan: &StudyPlan,
) -> Result<ProfilePiece, String> {
    let how = ProfileSettings {
        quantile: chi_square_one(plan.confidence),
        ..ProfileSettings::default()
    };
    let found = profile(problem, theta, of, &how).map_err(|breakdown| breakdown.to_string())?;
    Ok(ProfilePiece {
        sentence: found.sentence(),
        verdict: match found.verdict {
            Interval::Identified => "identified",
            Interval::OneSided => "one-sided",
            Interval::Flat => "flat",
        }
        .into(),
        marks: (found.marks.iter())
            .map(|mark| (mark.value, mark.constraint.clone()))
            .collect(),
        name: found.name,
        unit: found.unit,
        optimum: found.optimum,
        values: found.values,
        costs: found.costs,
        interval: found.interval,
    })
}
