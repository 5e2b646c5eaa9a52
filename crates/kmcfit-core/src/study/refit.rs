//! Fits near an optimum, as all studies run them.

use crate::objective::GradientKind;
use crate::problem::Problem;
use crate::qp::project;
use crate::simd::sum::rms;
use crate::solvers::{FitSettings, Initial, Solver, Stopping};

/// A refit ends when an iteration lowers J by at most this share: far below a change of chi-square
/// that means anything.
const TOLERANCE: f64 = 1e-13;
/// Most iterations of a refit; near an optimum it takes three to six.
const ITERATIONS: u64 = 60;

/// Gauss–Newton to the last digits that count.
pub fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(TOLERANCE),
            ..Stopping::exactly(ITERATIONS)
        },
        interrupt: None,
    }
}

/// How large a change of each parameter is large: the natural size of its function, or the scalar's
/// own. `theta` must have a response; else all sizes are 1.
pub fn sizes(problem: &Problem, theta: &[f64]) -> Vec<f64> {
    let Ok(evaluation) = problem.evaluate(theta) else {
        return vec![1.0; theta.len()];
    };
    let natural = problem.natural_scales(&evaluation);
    let largest = natural
        .iter()
        .copied()
        .fold(f64::MIN_POSITIVE.sqrt(), f64::max);
    let mut sizes = vec![0.0; theta.len()];
    for (range, size) in problem.functions.ranges().iter().zip(&natural) {
        sizes[range.clone()].fill(if *size > 0.0 { *size } else { largest });
    }
    let scalars = problem.functions.scalar_range();
    for (size, scalar) in sizes[scalars].iter_mut().zip(problem.functions.scalars()) {
        *size = scalar.size;
    }
    sizes
}

/// The root mean square of values, and no less than what squares keep above zero.
pub fn positive_rms(values: &[f64]) -> f64 {
    rms(values).max(f64::MIN_POSITIVE.sqrt())
}

/// The point of the constraints nearest to `theta`, where changes are measured by `sizes`; `theta`
/// itself where there are none, `None` where they contradict each other.
pub fn nearest(problem: &Problem, theta: &[f64], sizes: &[f64]) -> Option<Vec<f64>> {
    if problem.constraints.is_empty() {
        return Some(theta.to_vec());
    }
    if problem.constraints.are_simple() {
        let mut clipped = theta.to_vec();
        problem.constraints.clip(&mut clipped);
        let holds = problem
            .constraints
            .hold(&clipped, crate::constraints::TOLERANCE);
        return holds.then_some(clipped);
    }
    let metric: Vec<f64> = sizes.iter().map(|s| 1.0 / (s * s)).collect();
    let projection = project(&problem.constraints, theta, &metric);
    projection.status.is_point().then_some(projection.theta)
}
