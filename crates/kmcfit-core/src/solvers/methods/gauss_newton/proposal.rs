//! The step that a linearised problem proposes, and what is predicted of it.

use crate::constraints;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, Subproblem};
use crate::record::Loss;
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::linearization::robust_surplus;
use crate::solvers::optimality::response_rounding;
use crate::solvers::reason::Reason;
use crate::solvers::timings::timed;

/// A clipped step is used if it keeps this share of the plain step's predicted decrease.
const CLIPPED: f64 = 0.9;
/// A predicted decrease below this share of J that does not come true is within the accuracy to
/// which a quadratic program is solved.
const PROGRAM_ACCURACY: f64 = 1e-9;
/// A relative change of the functions below this is not a step but rounding.
pub(super) const SMALLEST_CHANGE: f64 = 1e-9;

/// A step of the parameters and the decrease of J that the model predicts for it.
pub(super) struct Proposal {
    pub parameters: Vec<f64>,
    pub predicted: f64,
    /// By how much more the subproblem can be lowered, as far as its solution is known; 0 where it is known to full accuracy.
    pub uncertainty: f64,
    /// Whether the subproblem was solved as accurately as was wanted.
    pub is_solved: bool,
}

/// What a subproblem gives.
pub(super) enum ProposalOutcome {
    Step(Proposal),
    /// No step: the subproblem could not be solved, for this reason.
    Unsolved(ConicStatus),
}

/// A decrease of the cost that cannot be told from none: by the accuracy to which a quadratic program is solved, and the
/// rounding of the response.
fn least_decrease(problem: &Problem, cost: f64) -> f64 {
    PROGRAM_ACCURACY * cost + response_rounding(problem, cost)
}

/// Why a proposal that did not lower the cost is no reason to go on, if it is none: it promises
/// less than the rounding of the cost, or moves less than rounding moves the response.
pub(super) fn at_minimum(
    problem: &Problem,
    point: &Iterate,
    proposal: &Proposal,
) -> Option<Reason> {
    // A prediction below zero by more, or of no number, is that of a wrong solution.
    if proposal.predicted.abs() + proposal.uncertainty
        <= least_decrease(problem, point.evaluation.cost)
    {
        return Some(Reason::NoPredictedDecrease);
    }
    let change = change(problem, point, proposal);
    let is_known = proposal.predicted > 0.0 && proposal.is_solved;
    (is_known && change <= SMALLEST_CHANGE).then_some(Reason::NoPredictedChange(change))
}

/// The largest change of a function that a proposal asks for, relative to the function's size.
pub(super) fn change(problem: &Problem, point: &Iterate, proposal: &Proposal) -> f64 {
    point.relative_change(problem, &proposal.parameters)
}

/// The best step that the subproblem offers in the constraint set. Staying is a step as well: whatever predicts
/// a higher cost is no solution, and the next way is tried.
pub(super) fn propose(
    work: &mut CountedEvaluator,
    sub: &Subproblem,
    point: &Iterate,
) -> ProposalOutcome {
    let constraints = &work.problem().constraints;
    let cost = point.evaluation.cost;
    let least = least_decrease(work.problem(), cost);
    // False for NaN.
    let is_sound = |predicted: &f64| *predicted >= -least;
    // Rounding of the step, or a clipped parameter, may break a row that the step itself satisfies.
    let moved = |z: &[f64]| {
        let parameters = constraints.moved(&point.parameters, z);
        let is_inside = constraints.hold(&parameters, constraints::TOLERANCE);
        is_inside.then_some(parameters)
    };
    let exact = |parameters: Vec<f64>, predicted: f64| {
        ProposalOutcome::Step(Proposal {
            parameters,
            predicted,
            uncertainty: 0.0,
            is_solved: true,
        })
    };
    // Where bounds are active they mostly stay so, and the stages take no longer than one plain step.
    let is_plain_likely = sub.layout.is_none() || !sub.is_active_at_zero(constraints::TOLERANCE);
    let plain = is_plain_likely.then(|| work.algebra(|| sub.solve_plain()));
    let plain = plain.flatten().map(|z| (cost - sub.value(&z), z));
    if let Some((best, z)) = plain.filter(|(best, _)| is_sound(best)) {
        if sub.holds(&z, 0.1 * constraints::TOLERANCE)
            && let Some(parameters) = moved(&z)
        {
            return exact(parameters, best);
        }
        if constraints.are_simple() {
            if let Some(parameters) = moved(&z) {
                let predicted = cost - model_cost(work, sub, point, &parameters);
                if predicted >= CLIPPED * best && is_sound(&predicted) {
                    return exact(parameters, predicted);
                }
            }
            let near = 0.1 * constraints::TOLERANCE;
            let held = work.algebra(|| sub.solve_held(z, near));
            let held = held.map(|z| (cost - sub.value(&z), z));
            if let Some((predicted, z)) = held
                && predicted >= CLIPPED * best
                && is_sound(&predicted)
                && let Some(parameters) = moved(&z)
            {
                return exact(parameters, predicted);
            }
        }
    }
    let iterations = work.program_iterations;
    let (solution, excess) = work.program(|| sub.solve_step(iterations));
    if !solution.status.is_point() {
        return ProposalOutcome::Unsolved(solution.status);
    }
    let Some(parameters) = moved(&solution.z) else {
        return ProposalOutcome::Unsolved(ConicStatus::Stalled);
    };
    // Not the program's own value: its solution satisfies the steps only to its accuracy.
    let model = model_cost(work, sub, point, &parameters);
    let predicted = cost - model;
    if !is_sound(&predicted) {
        return ProposalOutcome::Unsolved(ConicStatus::Stalled);
    }
    ProposalOutcome::Step(Proposal {
        parameters,
        predicted,
        uncertainty: match (solution.status, &solution.kkt) {
            (ConicStatus::Solved, _) => excess,
            (_, Some(kkt)) => kkt.cost() * cost.max(model),
            (_, None) => f64::INFINITY,
        },
        is_solved: solution.status == ConicStatus::Solved,
    })
}

/// The subproblem's cost for the step to `parameters`, by tangent solves.
fn model_cost(
    work: &mut CountedEvaluator,
    sub: &Subproblem,
    point: &Iterate,
    parameters: &[f64],
) -> f64 {
    let problem = work.problem();
    work.count_tangents(1);
    let delta: Vec<f64> = parameters
        .iter()
        .zip(&point.parameters)
        .map(|(a, b)| a - b)
        .collect();
    let near: f64 = sub
        .proximal
        .iter()
        .zip(&delta)
        .map(|(d, z)| d * z * z)
        .sum();
    let misfit = timed(&mut work.timings.tangent, || {
        linear_misfit(problem, &point.evaluation, &delta)
    });
    near + problem.regularisation(parameters) + misfit
}

/// The cost of the samples with every prediction replaced by its linearisation, and every loss by
/// the squares that stand for it.
fn linear_misfit(problem: &Problem, evaluation: &Evaluation, delta: &[f64]) -> f64 {
    let changes = problem.predictions_tangent(evaluation, delta);
    let mut misfit = robust_surplus(problem, evaluation);
    for ((channel, predicted), change) in
        problem.predicted(evaluation).zip(changes.iter().flatten())
    {
        if channel.loss() == Loss::Squares {
            let moved: Vec<f64> = predicted.iter().zip(change).map(|(z, d)| z + d).collect();
            misfit += channel.cost(&moved);
        } else {
            let residuals = channel.residuals(predicted).zip(change).enumerate();
            misfit += residuals
                .map(|(i, (r, d))| channel.weight(i, r) * (r + d) * (r + d))
                .sum::<f64>();
        }
    }
    misfit
}
