//! Starting points, one module for each strategy.

mod equation_error;
mod frequency_scan;
mod growing_horizon;
mod truncated;

pub(super) use equation_error::equation_error_start;
pub(super) use frequency_scan::{is_dominant, scan_start};
pub(super) use growing_horizon::growing_horizon_start;
pub(super) use truncated::{truncated_start, truncated_steps};

use super::history::Reference;
use super::settings::FitSettings;
use super::timings::{Timings, timed};
use crate::objective::Evaluation;
use crate::problem::Problem;

/// Cost and gradient at the start values.
pub(super) struct Referred {
    /// `None` if the simulation fails.
    pub reference: Option<Reference>,
    /// Time by kind of work.
    pub timings: Timings,
    /// Storage of the evaluation.
    pub workspace: Option<Evaluation>,
}

/// Evaluates a problem at the start values.
pub(super) fn reference(problem: &Problem, start: &[f64], settings: &FitSettings) -> Referred {
    let mut timings = Timings::default();
    let workspace = timed(&mut timings.forward, || problem.evaluate(start)).ok();
    let reference = workspace.as_ref().map(|evaluation| Reference {
        norm_squared: timed(&mut timings.adjoint, || {
            problem.gradient(start, evaluation, settings.gradient)
        })
        .norm_squared,
        cost: evaluation.cost,
    });
    Referred {
        reference,
        timings,
        workspace,
    }
}
