//! Gauss–Newton steps with a proximal term, under constraints.
//!
//! Each iteration minimises the linearised cost plus `damping * J * sum_f 1/T integral (delta p_f /
//! size of p_f)^2 dt` under the linearised constraints. The plain step, one sparse factorisation, is
//! taken where it stays in the set; where it leaves a set of simple bounds, the clipped step is
//! taken if it is nearly as good as the plain one, which no step in the set can beat, or else the plain
//! step with those bounds held that it meets; only otherwise a quadratic program is solved.

mod dense;
mod proposal;
mod structured;

pub(crate) use dense::{Half, Reduced, halfway, is_wide, weighted_jacobian};

pub(super) use proposal::response_rounding;
use proposal::{Answer, Proposal, SMALLEST_CHANGE, at_minimum, change, propose};

use super::infeasible::no_step;
use super::optimality::Optimality;
use super::point::Work;
use super::timings::timed;
use super::{Bits, Descend, Memory, Point, Step, Timings};
use crate::objective::{Evaluation, Loss};
use crate::problem::Problem;
use crate::qp::{ConicStatus, Subproblem};

/// Up to so many parameters the Jacobian is formed by one tangent solve each.
pub const FEW_PARAMETERS: usize = 64;
/// First weight of the proximal term, relative to J.
const FIRST_DAMPING: f64 = 1e-2;
/// Smallest weight: less is lost in the factorisation's own shift.
const LEAST_DAMPING: f64 = 1e-10;
/// Largest weight: a step so short changes no digit of the cost.
const MOST_DAMPING: f64 = 1e14;
/// A step is taken if it brings this share of the predicted decrease.
const ACCEPTED: f64 = 0.05;
/// Above this share the damping falls, below the next it rises.
const GOOD: f64 = 0.7;
const POOR: f64 = 0.3;
/// A predicted decrease below this share of J0 is rounding: J0 is a sum of squares, so this is the
/// square of the precision of its terms.
const NO_DECREASE: f64 = 1e-30;

/// The Jacobian is kept while no function is further from where it was made than this, relative to its size, ...
const NEARBY: f64 = 1e-2;
/// ... and the decrease is as predicted to this share: where a motion remembers long, its phase makes the Jacobian another
/// one sooner. A step with the old one leaves about that share of the error, which one with its own would square.
const AS_PREDICTED: f64 = 0.1;

/// The method and its damping.
pub struct GaussNewton {
    damping: f64,
    first_cost: Option<f64>,
    /// Where the Jacobian was made, if not at the point itself but at one nearby.
    made_at: Option<Vec<f64>>,
    /// Storage for the next trial.
    spare: Option<Evaluation>,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self {
            damping: FIRST_DAMPING,
            first_cost: None,
            made_at: None,
            spare: None,
        }
    }
}

impl Descend for GaussNewton {
    fn step(&mut self, work: &mut Work, point: &Point) -> Step {
        let problem = work.problem();
        let first_cost = *self.first_cost.get_or_insert(point.evaluation.cost);
        if point.evaluation.cost <= NO_DECREASE * first_cost {
            return Step::Minimum("the cost is zero to rounding".into());
        }
        let mut sub = self.linearise(work, point);
        // Diagonal of the proximal term.
        let scales = point.relative_metric(problem);
        let mut evaluation = self.spare.take().unwrap_or_else(|| problem.workspace());
        let mut trouble = None;
        let before = self.damping;
        while self.damping <= MOST_DAMPING {
            let weight = self.damping * point.evaluation.cost;
            for (d, s) in sub.proximal.iter_mut().zip(&scales) {
                *d = weight * s;
            }
            let proposal = match propose(work, &sub, point) {
                Answer::Step(proposal) => proposal,
                Answer::Unsolved(_) if Optimality::is_exact(problem, point.evaluation.cost) => {
                    return Step::Minimum(
                        "the residuals are below 1e-10 of the measurements".into(),
                    );
                }
                Answer::Unsolved(status) => {
                    trouble = Some(status);
                    self.damping *= 10.0;
                    continue;
                }
            };
            let result = work.evaluate_into(&proposal.parameters, &mut evaluation);
            let decrease = result.map(|()| point.evaluation.cost - evaluation.cost);
            let gain = decrease.map_or(f64::NAN, |decrease| decrease / proposal.predicted);
            if trouble.is_some() && change(problem, point, &proposal) <= SMALLEST_CHANGE {
                // What is left of the step by damping away the programs that stalled.
                break;
            }
            if gain >= ACCEPTED && evaluation.cost < point.evaluation.cost {
                self.learn(gain);
                if trouble.is_none() && proposal.uncertainty > 0.0 {
                    trouble = Some(ConicStatus::Almost);
                }
                if trouble.is_some() {
                    // The next programs are others: they get the chance to be solved with less.
                    self.damping = before;
                }
                let is_nearby = (gain - 1.0).abs() <= AS_PREDICTED
                    && self.distance(problem, point, &proposal) <= NEARBY;
                let moved = self.moved(work, point, proposal.parameters, evaluation, is_nearby);
                return Step::Moved {
                    point: Box::new(moved),
                    length: 1.0,
                    hindered: trouble.is_some(),
                };
            }
            if self.made_at.take().is_some() {
                // The Jacobian of another point may be to blame.
                work.count_tangents(linearisation_tangents(problem));
                work.linearise_again(point, None);
                sub = self.linearise(work, point);
                continue;
            }
            if trouble.is_none()
                && let Some(reason) = at_minimum(problem, point, &proposal)
            {
                return Step::Minimum(reason);
            }
            if proposal.uncertainty > 0.0 {
                // A shorter step promises less for being short.
                trouble = trouble.or(Some(ConicStatus::Almost));
            }
            self.damping *= 8.0;
        }
        self.damping = FIRST_DAMPING;
        match trouble {
            Some(status) => no_step(problem, point, status),
            None => Step::Stuck("no Gauss-Newton step lowers the cost".into()),
        }
    }

    fn recycle(&mut self, evaluation: Evaluation) {
        self.spare = Some(evaluation);
    }

    fn memory(&self) -> Memory {
        let numbers = std::iter::once(self.damping).chain(self.first_cost);
        Memory::GaussNewton {
            numbers: Bits(numbers.collect()),
            made_at: self.made_at.clone().map(Bits),
        }
    }

    fn recall(&mut self, memory: Memory, problem: &Problem, _: &Point) -> bool {
        let Memory::GaussNewton { numbers, made_at } = memory else {
            return false;
        };
        if made_at
            .as_ref()
            .is_some_and(|at| at.0.len() != problem.parameters())
        {
            return false;
        }
        let [damping, first_cost @ ..] = numbers.0.as_slice() else {
            return false;
        };
        if first_cost.len() > 1 {
            return false;
        }
        self.damping = *damping;
        self.first_cost = first_cost.first().copied();
        self.made_at = made_at.map(|at| at.0);
        true
    }
}

impl GaussNewton {
    /// The subproblem at a point: readings, penalties, constraints, without the proximal term.
    fn linearise(&mut self, work: &mut Work, point: &Point) -> Subproblem {
        let problem = work.problem();
        if self.made_at.is_none() {
            work.count_linearisation(linearisation_tangents(problem));
        }
        let made_at = self.made_at.as_deref();
        let ahead = work.linearised(&point.parameters).or_else(|| {
            // The search was ended from outside when it stood here.
            work.linearise_again(point, made_at);
            work.linearised(&point.parameters)
        });
        linearise_from(problem, point, ahead, &mut work.timings).0
    }

    /// How far a proposal goes from where the Jacobian was made, relative to the sizes of the functions at the point.
    fn distance(&self, problem: &Problem, point: &Point, proposal: &Proposal) -> f64 {
        let from = self.made_at.as_ref().unwrap_or(&point.parameters);
        point.distance(problem, from, &proposal.parameters)
    }

    /// The point that a step from `before` leads to; if that is nearby, with the same Jacobian.
    fn moved(
        &mut self,
        work: &mut Work,
        before: &Point,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        is_nearby: bool,
    ) -> Point {
        if !is_nearby {
            self.made_at = None;
            return work.complete(parameters, evaluation);
        }
        let (point, has_stayed) = work.complete_nearby(parameters, evaluation);
        let made_at = self.made_at.take();
        self.made_at = has_stayed.then(|| made_at.unwrap_or_else(|| before.parameters.clone()));
        point
    }

    fn learn(&mut self, gain: f64) {
        if gain > GOOD {
            self.damping = (self.damping / 10.0).max(LEAST_DAMPING);
        } else if gain < POOR {
            self.damping *= 3.0;
        }
    }
}

/// The tangent solves of one linearisation; with many parameters the step Jacobians count as one.
pub(super) fn linearisation_tangents(problem: &Problem) -> u64 {
    match problem.parameters() {
        few @ ..=FEW_PARAMETERS => few as u64,
        _ => 1,
    }
}

/// The linearised readings alone: `|F z - f|^2` is the misfit of the linearised predictions. The first
/// variables are the change of the parameters; with many of them the changes of the states follow,
/// tied to them by equalities.
pub(crate) fn linear_readings(problem: &Problem, evaluation: &Evaluation) -> Subproblem {
    timed_readings(problem, evaluation, None, &mut Timings::default())
}

/// [`linear_readings`], and what its tangents and its linear algebra took.
fn timed_readings(
    problem: &Problem,
    evaluation: &Evaluation,
    ahead: Option<Reduced>,
    timings: &mut Timings,
) -> Subproblem {
    if problem.parameters() <= FEW_PARAMETERS {
        return dense::subproblem(problem, evaluation, ahead, timings);
    }
    let steps = timed(&mut timings.tangent, || {
        structured::steps(problem, evaluation)
    });
    timed(&mut timings.linear_algebra, || {
        structured::subproblem(problem, evaluation, &steps)
    })
}

/// [`linearise`] without counting, and the number of residual rows that belong to the readings:
/// they come first.
pub(super) fn linearise_at(
    problem: &Problem,
    point: &Point,
    timings: &mut Timings,
) -> (Subproblem, usize) {
    linearise_from(problem, point, None, timings)
}

/// [`linearise_at`], from the readings `ahead` if they have been linearised already.
fn linearise_from(
    problem: &Problem,
    point: &Point,
    ahead: Option<Reduced>,
    timings: &mut Timings,
) -> (Subproblem, usize) {
    let mut sub = timed_readings(problem, &point.evaluation, ahead, timings);
    let readings = sub.residuals.len();
    timed(&mut timings.linear_algebra, || {
        add_the_rest(problem, &point.parameters, &point.evaluation, &mut sub);
    });
    (sub, readings)
}

/// The subproblem in parameters and states about any states, which need not be a motion.
pub(super) fn linearise_about(
    problem: &Problem,
    parameters: &[f64],
    evaluation: &Evaluation,
) -> Subproblem {
    let steps = structured::steps(problem, evaluation);
    let mut sub = structured::subproblem(problem, evaluation, &steps);
    add_the_rest(problem, parameters, evaluation, &mut sub);
    sub
}

/// All that the cost and the constraints have beside the readings.
fn add_the_rest(
    problem: &Problem,
    parameters: &[f64],
    evaluation: &Evaluation,
    sub: &mut Subproblem,
) {
    sub.constant = robust_surplus(problem, evaluation);
    add_penalties(problem, parameters, sub);
    add_variations(problem, parameters, sub);
    add_priors(problem, parameters, sub);
    add_soft(problem, parameters, sub);
    sub.constrain(&problem.constraints, parameters);
}

/// The cost of the readings less the weighted squares that stand for it: none for least squares.
fn robust_surplus(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let mut surplus = 0.0;
    for (experiment, predictions) in problem.experiments.iter().zip(&evaluation.predictions) {
        for (channel, predicted) in experiment.channels.iter().zip(predictions) {
            if channel.loss() != Loss::Squares {
                let residuals = channel.residuals(predicted).enumerate();
                let squares: f64 = residuals.map(|(i, r)| channel.weight(i, r) * r * r).sum();
                surplus += channel.cost(predicted) - squares;
            }
        }
    }
    surplus
}

/// `(x + delta - mean) / sigma` of the scalars' priors as residual rows.
pub(crate) fn add_priors(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    let functions = &problem.functions;
    for (index, scalar) in functions.scalar_range().zip(functions.scalars()) {
        if let Some(prior) = scalar.prior {
            let row = [(index, 1.0 / prior.sigma)];
            sub.residuals
                .push(row, (prior.mean - parameters[index]) / prior.sigma);
        }
    }
}

/// `sqrt(weight) (L (theta + delta) - target)` as residual rows.
pub(super) fn add_penalties(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for penalty in &problem.penalties {
        let range = problem.functions.ranges()[penalty.function].clone();
        let root = penalty.weight.sqrt();
        let residuals = penalty.residuals(&parameters[range.clone()]);
        for (i, r) in residuals.iter().enumerate() {
            let row = penalty
                .rows
                .row(i)
                .map(|(j, a)| (range.start + j, root * a));
            sub.residuals.push(row, -root * r);
        }
    }
}

/// `weight |D (theta + delta)|` as absolute values.
pub(super) fn add_variations(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for variation in &problem.variations {
        let range = problem.functions.ranges()[variation.function].clone();
        let changes = variation.changes(&parameters[range.clone()], variation.count());
        for (i, change) in changes.iter().enumerate() {
            let row = variation.rows.row(i).map(|(j, a)| (range.start + j, a));
            sub.absolute.push(row, -change);
            sub.absolute_weights.push(variation.weight);
        }
    }
}

/// The rows of soft constraints that are broken at `parameters`, as residuals.
fn add_soft(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for group in &problem.soft {
        let root = group.row_weight().sqrt();
        for i in 0..group.rows.len() {
            let excess = group.excess(i, parameters);
            if excess != 0.0 {
                let row = group.rows.row(i).map(|(j, a)| (j, root * a));
                sub.residuals.push(row, -root * excess);
            }
        }
    }
}
