//! Refits near an optimum, with common settings for all analyses.

use crate::objective::GradientKind;
use crate::problem::Problem;
use crate::qp::{StageLayout, Subproblem, project_by};
use crate::simd::sum::rms;
use crate::solvers::{FitSettings, Initial, Solver, Stopping};

/// Relative decrease of J per iteration that ends a refit, far below any significant change of chi-square.
const TOLERANCE: f64 = 1e-13;
/// Iteration limit of a refit; near an optimum three to six iterations suffice.
const ITERATIONS: u64 = 60;

/// Gauss–Newton with a tolerance near machine precision.
pub fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(TOLERANCE),
            ..Stopping::exactly(ITERATIONS)
        },
        qp: crate::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

/// Natural size of each parameter: that of its function, or the scalar's own; 1 for all if `theta` cannot be simulated.
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

/// Root mean square of values, bounded below to keep squares positive.
pub fn positive_rms(values: &[f64]) -> f64 {
    rms(values).max(f64::MIN_POSITIVE.sqrt())
}

/// Feasible point nearest to `theta`, with changes scaled by `sizes`; `theta` itself without constraints, `None` where
/// the constraints contradict each other.
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
    let layout = StageLayout::of(&problem.functions);
    let (constraints, solve) = (&problem.constraints, Subproblem::solve);
    let projection = project_by(constraints, theta, &metric, layout, solve);
    projection.status.is_point().then_some(projection.theta)
}
