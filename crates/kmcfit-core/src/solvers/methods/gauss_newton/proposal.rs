//! Proposed step of a linearised problem, and its predicted decrease.

use crate::constraints;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, Solution, Subproblem};
use crate::record::Loss;
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::linearization::robust_surplus;
use crate::solvers::optimality::response_rounding;
use crate::solvers::reason::Reason;
use crate::solvers::settings::QpSolver;
use crate::solvers::timings::timed;

/// Share of the plain step's predicted decrease from which a clipped step is used.
const CLIPPED: f64 = 0.9;
/// Distance of an active bound, relative to the largest distance of a bound.
const ACTIVE: f64 = 1e-4;
/// J above this share of the misfit of zero response is that of noise or of another model: residuals of a thousandth of the
/// measurements.
const NOISE: f64 = 1e-6;
/// Share of J below which a predicted decrease is within the accuracy of a quadratic program.
const PROGRAM_ACCURACY: f64 = 1e-9;
/// Relative change of the functions below which a step is a rounding error.
pub(super) const SMALLEST_CHANGE: f64 = 1e-9;

/// A step of the parameters and the predicted decrease of J.
pub(super) struct Proposal {
    pub parameters: Vec<f64>,
    pub predicted: f64,
    /// Bound of the further decrease of the subproblem; 0 where it is solved to full accuracy.
    pub uncertainty: f64,
    /// True if the subproblem was solved to the accuracy of a step.
    pub is_solved: bool,
}

/// Result of a subproblem.
pub(super) enum ProposalOutcome {
    Step(Proposal),
    /// The subproblem could not be solved; its status.
    Unsolved(ConicStatus),
}

/// Smallest significant decrease of the cost, given the accuracy of a quadratic program and the rounding error of the
/// response.
fn least_decrease(problem: &Problem, cost: f64) -> f64 {
    PROGRAM_ACCURACY * cost + response_rounding(problem, cost)
}

/// Reason to end at a minimum after a proposal that did not lower the cost: its predicted decrease, or its change, is below
/// the rounding error. `None` otherwise.
pub(super) fn at_minimum(
    problem: &Problem,
    point: &Iterate,
    proposal: &Proposal,
) -> Option<Reason> {
    // A negative or NaN prediction belongs to a wrong solution.
    if proposal.predicted.abs() + proposal.uncertainty
        <= least_decrease(problem, point.evaluation.cost)
    {
        return Some(Reason::NoPredictedDecrease);
    }
    let change = change(problem, point, proposal);
    let is_known = proposal.predicted > 0.0 && proposal.is_solved;
    (is_known && change <= SMALLEST_CHANGE).then_some(Reason::NoPredictedChange(change))
}

/// True if the decrease of the cost, predicted and computed, is within the rounding error: near a minimum the cost has half the
/// digits of the parameters.
pub(super) fn is_below_rounding(
    problem: &Problem,
    point: &Iterate,
    proposal: &Proposal,
    decrease: f64,
) -> bool {
    let rounding = response_rounding(problem, point.evaluation.cost);
    proposal.is_solved && decrease.abs().max(proposal.predicted.abs()) <= rounding
}

/// Largest change of a function in a proposal, relative to its size.
pub(super) fn change(problem: &Problem, point: &Iterate, proposal: &Proposal) -> f64 {
    point.relative_change(problem, &proposal.parameters)
}

/// Best feasible step of the subproblem. Candidates with a predicted increase of the cost are rejected.
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
    // Rounding, or a clipped parameter, may violate a row that the step itself satisfies.
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
    let iterations = work.program_iterations;
    let is_plain = constraints.is_empty() && sub.absolute.is_empty();
    if work.qp == QpSolver::Clarabel && !is_plain {
        let solution = work.program(|| sub.solve_by_clarabel(iterations));
        return of_program(work, sub, point, &solution);
    }
    // Bounds that noisy data make active mostly stay active, and the stages take no longer than one plain step.
    let is_noisy = cost > NOISE * work.problem().zero_response_misfit();
    if is_noisy
        && sub.layout.is_some()
        && sub.is_active_at_zero(ACTIVE)
        && let Some((z, excess)) = work.program(|| sub.step_on_stages(iterations))
        && let step @ ProposalOutcome::Step(_) = of_point(work, sub, point, &z, true, |_| excess)
    {
        return step;
    }
    let plain = work.algebra(|| sub.solve_equality_constrained());
    let plain = plain.map(|z| (cost - sub.value(&z), z));
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
            let held = work.algebra(|| sub.solve_active_set(z, near));
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
    let step = work
        .program(|| (sub.step_on_stages(iterations)).ok_or_else(|| sub.solve_within(iterations)));
    match step {
        Ok((z, excess)) => of_point(work, sub, point, &z, true, |_| excess),
        Err(solution) => of_program(work, sub, point, &solution),
    }
}

/// Step to the solution of a program.
fn of_program(
    work: &mut CountedEvaluator,
    sub: &Subproblem,
    point: &Iterate,
    solution: &Solution,
) -> ProposalOutcome {
    if !solution.status.is_point() {
        return ProposalOutcome::Unsolved(solution.status);
    }
    let is_solved = solution.status == ConicStatus::Solved;
    let share = match (is_solved, &solution.kkt) {
        (true, _) => 0.0,
        (false, Some(kkt)) => kkt.cost(),
        (false, None) => f64::INFINITY,
    };
    let uncertainty = |cost: f64| share * cost;
    of_point(work, sub, point, &solution.z, is_solved, uncertainty)
}

/// Step to a point of a program, with the uncertainty of the predicted decrease for the larger of the costs at both ends; unsolved if it
/// violates the constraints or predicts a higher cost.
fn of_point(
    work: &mut CountedEvaluator,
    sub: &Subproblem,
    point: &Iterate,
    z: &[f64],
    is_solved: bool,
    uncertainty: impl Fn(f64) -> f64,
) -> ProposalOutcome {
    let (constraints, cost) = (&work.problem().constraints, point.evaluation.cost);
    let parameters = constraints.moved(&point.parameters, z);
    if !constraints.hold(&parameters, constraints::TOLERANCE) {
        return ProposalOutcome::Unsolved(ConicStatus::Stalled);
    }
    // The value of the program is not used: its solution satisfies the steps only to the program's accuracy.
    let model = model_cost(work, sub, point, &parameters);
    let predicted = cost - model;
    if predicted < -least_decrease(work.problem(), cost) || predicted.is_nan() {
        return ProposalOutcome::Unsolved(ConicStatus::Stalled);
    }
    ProposalOutcome::Step(Proposal {
        parameters,
        predicted,
        uncertainty: uncertainty(cost.max(model)),
        is_solved,
    })
}

/// Cost of the subproblem for the step to `parameters`, by tangent solves.
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

/// Cost of the samples with linearised predictions and quadratic majorants of the losses.
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
            let majorant = channel.majorant(predicted);
            let mut change = change.clone();
            channel.whiten_rows(&mut change);
            let rows = majorant
                .weighted
                .iter()
                .zip(&majorant.weight_roots)
                .zip(&change);
            misfit += rows
                .map(|((r, root), d)| (r + root * d).powi(2))
                .sum::<f64>();
        }
    }
    misfit
}
