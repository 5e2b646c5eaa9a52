//! Gauss–Newton steps with a proximal term, under constraints.
//!
//! Each iteration minimises the linearised cost plus `damping * J * sum_f 1/T integral (delta p_f / size of p_f)^2 dt` under
//! the linearised constraints. The plain step, one sparse factorisation, is taken where it is feasible. Where it violates
//! simple bounds, the clipped step is taken if it is nearly as good as the plain one, a lower bound of all feasible steps,
//! or else the plain step with the violated bounds active. Otherwise a quadratic program is solved.

mod proposal;

use super::{Step, StepRule, no_step};
use crate::objective::Evaluation;
use crate::qp::{ConicStatus, Subproblem};
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::linearization::{Linearization, linearisation_tangents, linearise};
use crate::solvers::optimality::Optimality;
use crate::solvers::reason::Reason;
use proposal::{
    Proposal, ProposalOutcome, SMALLEST_CHANGE, at_minimum, change, is_below_rounding, propose,
};

/// Initial weight of the proximal term, relative to J.
const FIRST_DAMPING: f64 = 1e-2;
/// Smallest weight; smaller values are below the regularisation of the factorisation.
const LEAST_DAMPING: f64 = 1e-10;
/// Largest weight, at which a step changes no digit of the cost.
const MOST_DAMPING: f64 = 1e14;
/// Share of the predicted decrease from which a step is accepted.
const ACCEPTED: f64 = 0.05;
/// Shares of the predicted decrease above which the damping is reduced and below which it is raised.
const GOOD: f64 = 0.7;
const POOR: f64 = 0.3;
/// Predicted decrease, relative to J0, below which it is a rounding error: the square of the precision of the residuals.
const NO_DECREASE: f64 = 1e-30;

/// Largest change of a function, relative to its size, for which a Jacobian is reused.
const NEARBY: f64 = 1e-2;
/// Largest relative deviation of the decrease from its prediction for which a Jacobian is reused. The phase of lightly damped
/// responses makes the Jacobian invalid after shorter changes. A step with a reused Jacobian leaves about that share of the
/// error, a step with a new one its square.
const AS_PREDICTED: f64 = 0.1;

/// The method with its damping.
pub struct GaussNewton {
    damping: f64,
    first_cost: Option<f64>,
    /// Change of the last step below the rounding error of the cost.
    last_change: Option<f64>,
    /// Storage for the next trial.
    workspace: Option<Evaluation>,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self {
            damping: FIRST_DAMPING,
            first_cost: None,
            last_change: None,
            workspace: None,
        }
    }
}

impl StepRule for GaussNewton {
    fn step(&mut self, work: &mut CountedEvaluator, point: &Iterate) -> Step {
        let problem = work.problem();
        let first_cost = *self.first_cost.get_or_insert(point.evaluation.cost);
        if point.evaluation.cost <= NO_DECREASE * first_cost {
            return Step::Minimum(Reason::ZeroCost);
        }
        let mut linear = LinearisedProblem::new(work, point);
        let mut evaluation = self.workspace.take().unwrap_or_else(|| problem.workspace());
        let before = self.damping;
        while self.damping <= MOST_DAMPING {
            linear.damp(self.damping * point.evaluation.cost);
            let proposal = match propose(work, &linear.sub, point) {
                ProposalOutcome::Step(proposal) => proposal,
                ProposalOutcome::Unsolved(_)
                    if Optimality::is_exact(problem, point.evaluation.cost) =>
                {
                    return Step::Minimum(Reason::NegligibleResiduals);
                }
                ProposalOutcome::Unsolved(status) => {
                    linear.failure = Some(status);
                    self.damping *= 10.0;
                    continue;
                }
            };
            let result = work.evaluate_into(&proposal.parameters, &mut evaluation);
            let decrease = result.map(|()| point.evaluation.cost - evaluation.cost);
            let gain = decrease.map_or(f64::NAN, |decrease| decrease / proposal.predicted);
            if linear.failure.is_some() && change(problem, point, &proposal) <= SMALLEST_CHANGE {
                // Without the effect of damping caused by failed programs.
                break;
            }
            if gain >= ACCEPTED && evaluation.cost < point.evaluation.cost {
                self.learn(gain);
                if linear.failure.is_some() || !proposal.is_solved {
                    linear.failure.get_or_insert(ConicStatus::Almost);
                    // The following programs differ and may be solved with less damping.
                    self.damping = before;
                }
                return linear.step_to(work, point, proposal, evaluation, gain);
            }
            if linear.linearization.computed_at().is_some() {
                // The reused Jacobian may be the cause.
                linear.linearise_again(work, point);
                continue;
            }
            if linear.failure.is_none()
                && let Some(reason) = at_minimum(problem, point, &proposal)
            {
                let decrease = decrease.unwrap_or(f64::INFINITY);
                if is_below_rounding(problem, point, &proposal, decrease)
                    && self.contracts(work.step_limit, change(problem, point, &proposal))
                {
                    return linear.step_to(work, point, proposal, evaluation, 0.0);
                }
                return Step::Minimum(reason);
            }
            if !proposal.is_solved {
                // A shorter step predicts less because it is short.
                linear.failure.get_or_insert(ConicStatus::Almost);
            }
            self.damping *= 8.0;
        }
        self.damping = FIRST_DAMPING;
        match linear.failure {
            Some(status) => no_step(problem, point, status),
            None => Step::Stuck(Reason::NoLowerGaussNewtonStep),
        }
    }

    fn recycle(&mut self, evaluation: Evaluation) {
        self.workspace = Some(evaluation);
    }
}

impl GaussNewton {
    /// True for a `change` above the limit of the last step, and at most half of that of the step before: steps below the rounding
    /// error of the cost go on as long as they contract.
    fn contracts(&mut self, limit: Option<f64>, change: f64) -> bool {
        let is_long = limit.is_some_and(|limit| change > limit);
        let contracts = is_long && self.last_change.is_none_or(|last| change <= 0.5 * last);
        if contracts {
            self.last_change = Some(change);
        }
        contracts
    }

    fn learn(&mut self, gain: f64) {
        if gain > GOOD {
            self.damping = (self.damping / 10.0).max(LEAST_DAMPING);
        } else if gain < POOR {
            self.damping *= 3.0;
        }
    }
}

/// Linearised problem of one iteration.
struct LinearisedProblem {
    linearization: Linearization,
    sub: Subproblem,
    /// Diagonal of the proximal term.
    scales: Vec<f64>,
    /// Status of the last program that was not solved to full accuracy.
    failure: Option<ConicStatus>,
}

impl LinearisedProblem {
    fn new(work: &mut CountedEvaluator, point: &Iterate) -> Self {
        let linearization = work.linearization(point);
        work.count_linearisation(linearisation_tangents(work.problem()));
        Self {
            sub: subproblem(work, point, &linearization),
            linearization,
            scales: point.relative_metric(work.problem()),
            failure: None,
        }
    }

    /// Computes the Jacobian at `point`.
    fn linearise_again(&mut self, work: &mut CountedEvaluator, point: &Iterate) {
        work.count_tangents(linearisation_tangents(work.problem()));
        self.linearization = work.linearise_again(point);
        self.sub = subproblem(work, point, &self.linearization);
    }

    /// Sets the weight of the proximal term.
    fn damp(&mut self, weight: f64) {
        for (d, s) in self.sub.proximal.iter_mut().zip(&self.scales) {
            *d = weight * s;
        }
    }

    /// Step from `point` to a proposal; the linearisation is reused if the step is short and the decrease as predicted.
    fn step_to(
        &self,
        work: &mut CountedEvaluator,
        point: &Iterate,
        proposal: Proposal,
        evaluation: Evaluation,
        gain: f64,
    ) -> Step {
        let from = (self.linearization.computed_at()).unwrap_or(&point.parameters);
        let to = proposal.parameters;
        let is_nearby = (gain - 1.0).abs() <= AS_PREDICTED
            && point.distance(work.problem(), from, &to) <= NEARBY;
        let moved = match is_nearby {
            true => work.complete_nearby(point, &self.linearization, to, evaluation),
            false => work.complete(to, evaluation),
        };
        Step::Moved {
            point: Box::new(moved),
            length: 1.0,
            limited: self.failure.is_some(),
        }
    }
}

/// Subproblem at a point, without the proximal term.
fn subproblem(
    work: &mut CountedEvaluator,
    point: &Iterate,
    linearization: &Linearization,
) -> Subproblem {
    let (parameters, evaluation) = (&point.parameters, &point.evaluation);
    let (problem, timings) = (work.problem(), &mut work.timings);
    linearise(problem, parameters, evaluation, linearization, timings).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The damping falls by ten above the share of a good step and rises by three below that of a poor one; at and between both
    /// shares it stays.
    #[test]
    fn the_damping_follows_the_share_of_the_predicted_decrease() {
        let cases = [
            (0.1, 3.0),
            (0.3, 1.0),
            (0.5, 1.0),
            (0.7, 1.0),
            (0.8, 0.1),
            (1.5, 0.1),
        ];
        for (gain, factor) in cases {
            let mut method = GaussNewton::default();
            method.learn(gain);
            let off = (method.damping / (factor * FIRST_DAMPING) - 1.0).abs();
            assert!(off <= f64::EPSILON, "{gain}: {}", method.damping);
        }
        let mut method = GaussNewton::default();
        (0..20).for_each(|_| method.learn(1.0));
        assert_eq!(method.damping, LEAST_DAMPING);
    }

    /// Only with a limit of the last step, above it, and at most half as long as the step before.
    #[test]
    fn steps_below_the_rounding_error_contract() {
        let mut method = GaussNewton::default();
        assert!(!method.contracts(None, 1e-8));
        let limit = Some(1e-12);
        let steps = [(1e-8, true), (6e-9, false), (1e-10, true), (1e-13, false)];
        for (change, expected) in steps {
            assert_eq!(method.contracts(limit, change), expected, "{change}");
        }
    }
}
