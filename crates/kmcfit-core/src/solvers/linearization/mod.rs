//! Linearisation of predictions and cost at an iterate: the subproblem of a Gauss–Newton step.

mod halves;
mod penalties;
mod reduced;
mod residuals;
mod structured;
#[cfg(test)]
mod tests;

pub(super) use halves::{halfway, in_halves};
pub(super) use penalties::add_variations;
pub(crate) use penalties::{add_penalties, add_priors, add_soft};
pub(super) use reduced::Reduced;
pub(crate) use reduced::weighted_jacobian;

use super::timings::{Timings, timed};
use crate::objective::{Evaluation, Gradient};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::qp::Subproblem;
use crate::record::Loss;
use reduced::of_whole_jacobian;

/// Linearised predictions of an iterate.
#[derive(Clone, Default)]
pub(crate) enum Linearization {
    /// Computed when a step is made.
    #[default]
    Fresh,
    /// Computed with the gradient, in two halves of a long record.
    Halves(Reduced),
    /// Computed at the nearby parameters `at`; residuals and gradient are those of the iterate.
    Reused {
        /// Parameters of the Jacobian.
        at: Vec<f64>,
        /// Samples with that Jacobian, and residuals and gradient of the iterate.
        reduced: Reduced,
    },
}

impl Linearization {
    /// Linearisation at the evaluated point.
    pub fn at(problem: &Problem, evaluation: &Evaluation, timings: &mut Timings) -> Self {
        Self::Halves(reduce(problem, evaluation, timings))
    }

    /// This linearisation for a point near `from`, its own; `None` where it is inconsistent with the point.
    pub fn nearby(
        &self,
        from: &[f64],
        evaluation: &Evaluation,
        gradient: &Gradient,
    ) -> Option<Self> {
        let at = self.computed_at().unwrap_or(from).to_vec();
        let reduced = self.reduced()?;
        let reduced = reduced.nearby(evaluation.misfit, &gradient.euclidean)?;
        Some(Self::Reused { at, reduced })
    }

    /// Linearised samples, if computed.
    pub fn reduced(&self) -> Option<&Reduced> {
        match self {
            Self::Fresh => None,
            Self::Halves(reduced) | Self::Reused { reduced, .. } => Some(reduced),
        }
    }

    /// Parameters of the Jacobian, if they differ from the iterate's.
    pub fn computed_at(&self) -> Option<&[f64]> {
        match self {
            Self::Reused { at, .. } => Some(at),
            Self::Fresh | Self::Halves(_) => None,
        }
    }
}

/// Number of tangent solves of one linearisation; with many parameters the step Jacobians count as one.
pub(super) fn linearisation_tangents(problem: &Problem) -> u64 {
    match problem.parameters() {
        few @ ..=FEW_PARAMETERS => few as u64,
        _ => 1,
    }
}

/// Samples linearised and reduced at an evaluated point, a long record in halves.
fn reduce(problem: &Problem, evaluation: &Evaluation, timings: &mut Timings) -> Reduced {
    match halfway(problem) {
        Some(halfway) => timed(&mut timings.tangent, || {
            in_halves(problem, evaluation, halfway, || ()).0
        }),
        None => Reduced::block_by_block(problem, evaluation, timings),
    }
}

/// Linearised samples alone: `|F z - f|^2` is the misfit of the linearised predictions. The first variables are the changes
/// of the parameters; with many of them the changes of the states follow, linked by equalities.
pub(crate) fn linear_predictions(problem: &Problem, evaluation: &Evaluation) -> Subproblem {
    samples(problem, evaluation, None, &mut Timings::default())
}

/// [`linear_predictions`] from the `known` reduction, if computed; adds the time of tangents and linear algebra.
fn samples(
    problem: &Problem,
    evaluation: &Evaluation,
    known: Option<&Reduced>,
    timings: &mut Timings,
) -> Subproblem {
    if problem.parameters() <= FEW_PARAMETERS {
        if Reduced::is_computed_by_blocks(problem) {
            let mut own = None;
            let reduced = known.unwrap_or_else(|| own.insert(reduce(problem, evaluation, timings)));
            // Otherwise the order of operations differs.
            if reduced.is_finite() {
                return timed(&mut timings.linear_algebra, || reduced.subproblem());
            }
        }
        return of_whole_jacobian(problem, evaluation, timings);
    }
    let steps = timed(&mut timings.tangent, || {
        structured::steps(problem, evaluation)
    });
    timed(&mut timings.linear_algebra, || {
        structured::subproblem(problem, evaluation, &steps)
    })
}

/// Subproblem at an evaluated point without the proximal term: samples, penalties and constraints. Also returns the number
/// of residual rows of the samples, which come first.
pub(super) fn linearise(
    problem: &Problem,
    parameters: &[f64],
    evaluation: &Evaluation,
    linearization: &Linearization,
    timings: &mut Timings,
) -> (Subproblem, usize) {
    let mut sub = samples(problem, evaluation, linearization.reduced(), timings);
    let samples = sub.residuals.len();
    timed(&mut timings.linear_algebra, || {
        add_the_rest(problem, parameters, evaluation, &mut sub);
    });
    (sub, samples)
}

/// Adds the terms of the cost besides the samples, and the constraints.
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

/// Cost of the samples minus its quadratic majorant: zero for least squares.
pub(super) fn robust_surplus(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let mut surplus = 0.0;
    for (channel, predicted) in problem.predicted(evaluation) {
        if channel.loss() != Loss::Squares {
            let weighted = channel.majorant(predicted).weighted;
            let squares: f64 = weighted.iter().map(|r| r * r).sum();
            surplus += channel.cost(predicted) - squares;
        }
    }
    surplus
}
