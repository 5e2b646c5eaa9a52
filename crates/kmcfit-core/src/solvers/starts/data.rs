//! Starting point from the measurements: the minimum of the equation error.

use crate::problem::Problem;
use crate::solvers::methods::equation_error::equation_error;

/// Minimum of the equation error; the start as given where it cannot be simulated.
pub(in crate::solvers) fn data_start(problem: &Problem, start: &[f64]) -> Vec<f64> {
    let found = equation_error(problem, start).ok();
    let found = found.filter(|theta| problem.evaluate(theta).is_ok());
    found.unwrap_or_else(|| start.to_vec())
}
