//! Discretisation error of the time steps in the estimates.
//!
//! The predictions on half the step, `z_(h/2)`, give by extrapolation (Richardson) the error of those on the whole step, and a
//! linearised fit the shift of the estimates that it causes:
//!
//! ```text
//! e = (z_(h/2) - z_h) 2^p / (2^p - 1),    delta = -H^+ J^T W e
//! ```
//!
//! with the order `p` of the stepper. The shift is one more column of the root of the covariance, `Cov + delta delta^T`, so that every
//! interval derived from it contains the shift.

use crate::diagnostics::rms;
use crate::objective::{Evaluation, Refined};
use crate::problem::Problem;
use nalgebra::DVector;

/// Residuals below this share of the discretisation error are those of samples that were simulated with the same steps.
const SAME_STEPS: f64 = 1e-6;

/// Weighted and whitened discretisation error of all predictions, in the rows of [`Sensitivity`](super::Sensitivity) with the roots
/// `weight_roots`; `None` where half the step cannot be simulated or the samples were simulated with the same steps.
pub(crate) fn step_error(
    problem: &Problem,
    evaluation: &Evaluation,
    weight_roots: &[f64],
) -> Option<DVector<f64>> {
    of_changes(
        problem,
        evaluation,
        weight_roots,
        problem.on_half_step(evaluation).ok()??,
    )
}

/// [`step_error`] from the results on half the step.
pub(super) fn of_changes(
    problem: &Problem,
    evaluation: &Evaluation,
    weight_roots: &[f64],
    halved: Refined,
) -> Option<DVector<f64>> {
    let changes: Vec<Vec<f64>> = halved.changes.into_iter().flatten().collect();
    let pairs = problem.predicted(evaluation).zip(&changes);
    let is_of_these_steps = pairs.fold(true, |all, ((channel, predicted), changes)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        all & (rms(&residuals) < SAME_STEPS * rms(changes))
    });
    let error = weighted(problem, changes, weight_roots, richardson(problem))?;
    (!is_of_these_steps).then_some(error)
}

/// Factor `2^p / (2^p - 1)` from the changes by half the step to the error of the whole step.
pub(super) fn richardson(problem: &Problem) -> f64 {
    let order = 2f64.powi(problem.system.method.order() as i32);
    order / (order - 1.0)
}

/// Changes of the predictions of each channel, multiplied by `factor`, weighted and whitened; `None` where they are not finite.
pub(super) fn weighted(
    problem: &Problem,
    changes: Vec<Vec<f64>>,
    weight_roots: &[f64],
    factor: f64,
) -> Option<DVector<f64>> {
    let mut error = Vec::with_capacity(weight_roots.len());
    for (channel, mut changes) in problem.channels().zip(changes) {
        channel.whiten_rows(&mut changes);
        error.extend(changes);
    }
    let error = error
        .iter()
        .zip(weight_roots)
        .map(|(e, root)| factor * root * e);
    let error = DVector::from_iterator(weight_roots.len(), error);
    error.iter().all(|e| e.is_finite()).then_some(error)
}
