//! Fits of the beginning of a record, whose phase is not lost where that of the whole is.

use crate::alternatives::Refit;
use crate::problem::Problem;

/// Shares of a record that are fitted one after the other.
const SHARES: [f64; 4] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];
/// Fewest samples per parameter.
const SAMPLES_PER_PARAMETER: usize = 10;
/// Iteration limit of a fit.
const ITERATIONS: u64 = 20;

/// Parameters of the fit of the first quarter of each record, from fits of its beginnings.
pub(super) fn of_first_quarter(problem: &Problem, theta: &[f64]) -> Option<Vec<f64>> {
    let mut found: Option<Vec<f64>> = None;
    for share in SHARES {
        let part = problem.truncated(share);
        if part.sample_count() < SAMPLES_PER_PARAMETER * part.parameters() {
            continue;
        }
        let from = found.as_deref().unwrap_or(theta);
        found = Some(Refit::within(ITERATIONS, part, from)?.fit.best.parameters);
    }
    found
}

/// Parameters of the fit of the first half, from those of the first quarter.
pub(super) fn of_first_half(problem: &Problem, theta: &[f64]) -> Option<Vec<f64>> {
    let quarter = Refit::within(ITERATIONS, problem.truncated(0.25), theta)?;
    let half = problem.truncated(0.5);
    let half = Refit::within(ITERATIONS, half, &quarter.fit.best.parameters)?;
    Some(half.fit.best.parameters)
}
