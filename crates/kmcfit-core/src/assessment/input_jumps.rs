//! Jumps of an input between two samples, at a time that no interpolation knows.

use super::record_error::RecordError;
use crate::alternatives::{
    Refit, applies, measured, with_input, without_correlation, worst_misfit,
};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::{Interpolation, Signal, jumps};

/// Distance of an error from a jump, in samples, up to which the jump explains it.
const NEAR: f64 = 2.5;
/// Difference of the criteria from which the evidence is very strong (Kass and Raftery 1995).
const EVIDENCE: f64 = 10.0;

/// The largest jump of an input that lines or cubics connect, where the last value until the next sample leaves residuals that are
/// smaller, and white or half of those before.
pub(super) fn connected_jump(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<RecordError> {
    applies(problem, theta, evaluation).then_some(())?;
    (0..problem.experiments.len()).find_map(|e| {
        let found = largest_jump(problem, e, |_| true)?;
        let (quantity, signal) = measured(&problem.experiments[e])?;
        (signal.interpolation() != Interpolation::Hold).then_some(())?;
        let (times, values) = (signal.times().to_vec(), signal.values().to_vec());
        let held = Signal::new(times, values, Interpolation::Hold)?;
        let mut held = with_input(problem, e, (quantity, held))?;
        without_correlation(&mut held.parts_mut().experiments);
        let refit = Refit::of(held, theta)?;
        let ratio = worst_misfit(problem, evaluation) / refit.worst_misfit();
        let gain = 2.0 * problem.sample_count() as f64 * ratio.ln();
        let is_explained = refit.is_white() || refit.explains(problem, evaluation);
        (gain > EVIDENCE && is_explained).then_some(found)
    })
}

/// A jump in place of errors of the force near it.
pub(super) fn or_jump(problem: &Problem, error: RecordError) -> RecordError {
    let RecordError::InputPulses {
        experiment, time, ..
    } = &error
    else {
        return error;
    };
    let e = problem
        .experiments
        .iter()
        .position(|e| e.name == *experiment);
    let near = |at: [f64; 2]| (at[1] - time).abs() <= NEAR * (at[1] - at[0]);
    e.and_then(|e| largest_jump(problem, e, near))
        .unwrap_or(error)
}

/// The largest jump of the measured input of an experiment among those between times that are accepted.
fn largest_jump(
    problem: &Problem,
    e: usize,
    accepts: impl Fn([f64; 2]) -> bool,
) -> Option<RecordError> {
    let experiment = &problem.experiments[e];
    let (input, signal) = measured(experiment)?;
    let (times, values) = (signal.times(), signal.values());
    let all = jumps(values).into_iter();
    let all = all.map(|i| ([times[i - 1], times[i]], values[i] - values[i - 1]));
    let accepted = all.filter(|(between, _)| accepts(*between));
    let (between, jump) = accepted.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some(RecordError::InputJump {
        experiment: experiment.name.clone(),
        input,
        between,
        jump,
    })
}
