//! Starting point from the measurements: the minimum over `theta` of the equation error
//! `integral (m a + c v + k y - f)^2 dt`, with displacement, velocity and acceleration estimated from the samples.

use crate::problem::Problem;
use crate::solvers::methods::equation_error::equation_error;

/// Minimum of the equation error; the start as given where it cannot be simulated, and with several coordinates.
pub(in crate::solvers) fn equation_error_start(problem: &Problem, start: &[f64]) -> Vec<f64> {
    let is_one = problem.system.structure.is_one();
    let found = is_one.then(|| equation_error(problem, start).ok());
    let found = found
        .flatten()
        .filter(|theta| problem.evaluate(theta).is_ok());
    found.unwrap_or_else(|| start.to_vec())
}
