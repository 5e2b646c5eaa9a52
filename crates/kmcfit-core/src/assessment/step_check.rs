//! Step-size check: the optimum simulated on a grid of half the step.

use crate::diagnostics::rms;
use crate::number_format::number_or_nan;
use crate::objective::{Evaluation, Refined};
use crate::problem::Problem;
use crate::step::SimulationError;
use serde::{Deserialize, Serialize};

/// Result of the step-size check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepCheck {
    /// Half the step, s.
    pub step: f64,
    /// Misfit on the finer grid.
    #[serde(deserialize_with = "number_or_nan")]
    pub misfit: f64,
    /// Largest change of a prediction relative to the root-mean-square residual, over the channels.
    #[serde(deserialize_with = "number_or_nan")]
    pub change_per_residual: f64,
    /// Largest change of a prediction as a share of the largest sample, over the channels.
    #[serde(deserialize_with = "number_or_nan")]
    pub change_per_sample: f64,
}

/// Outcome of the check: `None` where samples do not lie on the finer grid, an error where the simulation fails.
pub type StepCheckOutcome = Result<Option<StepCheck>, SimulationError>;

/// Simulates the optimum with half the step.
///
/// # Errors
/// A [`SimulationError`] if the simulation with half the step fails.
pub fn step_check(problem: &Problem, evaluation: &Evaluation) -> StepCheckOutcome {
    let refined = problem.on_half_step(evaluation)?;
    Ok(refined.map(|refined| StepCheck::of(problem, evaluation, &refined)))
}

impl StepCheck {
    /// Compares an evaluation with the results on half the step.
    pub(super) fn of(problem: &Problem, evaluation: &Evaluation, refined: &Refined) -> Self {
        let mut summary = StepCheck {
            step: refined.step,
            misfit: refined.misfit,
            change_per_residual: 0.0,
            change_per_sample: 0.0,
        };
        let channels = problem
            .channels()
            .zip(evaluation.predictions.iter().flatten());
        for ((channel, predicted), change) in channels.zip(refined.changes.iter().flatten()) {
            let residuals: Vec<f64> = channel.residuals(predicted).collect();
            let rms = rms(&residuals);
            let largest = channel
                .observed()
                .iter()
                .fold(0.0f64, |m, y| m.max(y.abs()));
            let change = change.iter().fold(0.0f64, |m, d| m.max(d.abs()));
            let share = |of: f64| if change == 0.0 { 0.0 } else { change / of };
            summary.change_per_residual = summary.change_per_residual.max(share(rms));
            summary.change_per_sample = summary.change_per_sample.max(share(largest));
        }
        summary
    }
}
