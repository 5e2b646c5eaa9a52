//! Methods: each is a direction and a step rule; the equation error is minimised at once.

pub(super) mod equation_error;
mod gauss_newton;
mod lbfgs;
mod line_search;
mod projected_gradient;
mod steepest_descent;

#[cfg(test)]
pub(super) use gauss_newton::GaussNewton;

use super::checkpoint::Memory;
use super::evaluator::Work;
use super::iterate::Point;
use super::reason::Reason;
use super::settings::Solver;
use crate::constraints::TOLERANCE;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::ConicStatus;

/// Where one iteration led.
#[allow(
    clippy::large_enum_variant,
    reason = "there is one at a time, and nearly all have a point"
)]
pub(crate) enum Step {
    /// To a point with lower cost; `length` is the step along the direction. A `limited` step is
    /// short because longer ones could not be computed: that it is short says nothing of a minimum.
    Moved {
        point: Box<Point>,
        length: f64,
        limited: bool,
    },
    /// Nowhere: no step lowers the cost, for this reason.
    Stuck(Reason),
    /// Nowhere: the point breaks the constraints, and no step leads into them, for this reason.
    Infeasible(Reason),
    /// Nowhere: the model predicts no decrease worth the name; the point is a minimum.
    Minimum(Reason),
}

/// A direction and a step rule.
pub(crate) trait StepRule {
    /// One iteration from `point`.
    fn step(&mut self, work: &mut Work, point: &Point) -> Step;

    /// Storage for the next step, from a point that has been left.
    fn recycle(&mut self, evaluation: Evaluation) {
        let _ = evaluation;
    }

    /// What decides its next steps from `point` beside that.
    fn memory(&self, point: &Point) -> Memory {
        let _ = point;
        Memory::Nothing
    }

    /// Takes up a memory at `point`; whether it is one of this method and this problem.
    fn recall(&mut self, memory: Memory, problem: &Problem, point: &mut Point) -> bool {
        let _ = (problem, point);
        memory == Memory::Nothing
    }
}

/// The step rule of a solver.
///
/// # Panics
/// For the equation error, which has no steps.
pub(super) fn step_rule(solver: Solver) -> Box<dyn StepRule> {
    match solver {
        Solver::SteepestDescent => Box::<steepest_descent::SteepestDescent>::default(),
        Solver::Lbfgs { memory } => Box::new(lbfgs::Lbfgs::new(memory)),
        Solver::ProjectedGradient => Box::<projected_gradient::ProjectedGradient>::default(),
        Solver::GaussNewton => Box::<gauss_newton::GaussNewton>::default(),
        Solver::EquationError => unreachable!("it takes no steps"),
    }
}

/// The step from `point` when the quadratic programs that would make one ended with `status`.
pub(super) fn no_step(problem: &Problem, point: &Point, status: ConicStatus) -> Step {
    let reason = Reason::Program(status);
    // From a point that satisfies them there is always the step of length zero.
    let inside = problem.constraints.hold(&point.parameters, TOLERANCE);
    match status == ConicStatus::Infeasible && !inside {
        true => Step::Infeasible(reason),
        false => Step::Stuck(reason),
    }
}
