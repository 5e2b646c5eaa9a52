//! A start from the measurements: the minimum of the equation error.

use crate::problem::Problem;
use crate::solvers::methods::equation_error::equation_error;

/// The minimum of the equation error; where that has no response, the start as given.
pub(in crate::solvers) fn data_start(problem: &Problem, start: &[f64]) -> Vec<f64> {
    let found = equation_error(problem, start).ok();
    let found = found.filter(|theta| problem.evaluate(theta).is_ok());
    found.unwrap_or_else(|| start.to_vec())
}
