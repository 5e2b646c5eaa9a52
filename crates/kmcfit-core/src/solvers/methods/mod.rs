//! Methods, each a search direction and a step rule; the equation error is minimised directly.

pub(super) mod equation_error;
mod gauss_newton;
mod lbfgs;
mod line_search;
mod projected_gradient;
mod steepest_descent;

use super::evaluator::CountedEvaluator;
use super::iterate::Iterate;
use super::reason::Reason;
use super::settings::Solver;
use crate::constraints::TOLERANCE;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::ConicStatus;

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Result of one iteration.
#[allow(
    clippy::large_enum_variant,
    reason = "there is one at a time, and nearly all have a point"
)]
pub(crate) enum Step {
    /// A point of lower cost; `length` is the step along the direction. A `limited` step is short because longer ones could not
    /// be computed, which is no sign of convergence.
    Moved {
        point: Box<Iterate>,
        length: f64,
        limited: bool,
    },
    /// No step lowers the cost; the reason.
    Stuck(Reason),
    /// The point violates the constraints, and no step leads into them; the reason.
    Infeasible(Reason),
    /// The predicted decrease is not significant: the point is a minimum; the reason.
    Minimum(Reason),
}

/// A search direction and a step rule.
pub(crate) trait StepRule {
    /// One iteration from `point`.
    fn step(&mut self, work: &mut CountedEvaluator, point: &Iterate) -> Step;

    /// Takes storage for the next step from a point that is no longer needed.
    fn recycle(&mut self, evaluation: Evaluation) {
        let _ = evaluation;
    }
}

/// Step rule of a solver.
///
/// # Panics
/// For the equation error, which has no iterations.
pub(super) fn step_rule(solver: Solver) -> Box<dyn StepRule> {
    match solver {
        Solver::SteepestDescent => Box::<steepest_descent::SteepestDescent>::default(),
        Solver::Lbfgs { memory } => Box::new(lbfgs::Lbfgs::new(memory)),
        Solver::ProjectedGradient => Box::<projected_gradient::ProjectedGradient>::default(),
        Solver::GaussNewton => Box::<gauss_newton::GaussNewton>::default(),
        Solver::EquationError => unreachable!("it takes no steps"),
    }
}

/// Result of an iteration whose quadratic programs ended with `status`.
pub(super) fn no_step(problem: &Problem, point: &Iterate, status: ConicStatus) -> Step {
    let reason = Reason::Program(status);
    // From a feasible point the step of length zero is always feasible.
    let inside = problem.constraints.hold(&point.parameters, TOLERANCE);
    match status == ConicStatus::Infeasible && !inside {
        true => Step::Infeasible(reason),
        false => Step::Stuck(reason),
    }
}
