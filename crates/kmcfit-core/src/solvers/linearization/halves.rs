//! The linearised samples of a long record in two halves, each reduced by itself and at the same time where a processor is
//! to spare.
//!
//! The gradient of the misfit is the product of Jacobian and residuals, so that it needs no adjoint solve.

use super::reduced::{NARROW, Reduced};
use super::residuals::Residuals;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::simd::tall_qr::{PIECE, Triangle};
use crate::threads;
use std::ops::Range;

/// The step at which a record is cut in two: the middle of a long record with few parameters; `None` elsewhere.
pub(in crate::solvers) fn halfway(problem: &Problem) -> Option<usize> {
    let is_narrow = problem.parameters() <= NARROW && Reduced::comes_in_pieces(problem);
    problem.middle().filter(|_| is_narrow)
}

/// The samples from both halves of a record cut at the step `halfway`, and the result of `beside`, which is computed after
/// the first half.
pub(in crate::solvers) fn in_halves<T>(
    problem: &Problem,
    evaluation: &Evaluation,
    halfway: usize,
    beside: impl FnOnce() -> T,
) -> (Reduced, T) {
    let ((first, more), second) = threads::both(
        || (Half::first(problem, evaluation, halfway), beside()),
        || Half::second(problem, evaluation, halfway),
    );
    (first.join(&second), more)
}

/// The samples of one half of a record, linearised and reduced.
pub(super) struct Half {
    triangle: Triangle,
    /// The parameter of each column.
    order: Vec<usize>,
    /// How the state at its end answers to each parameter, in the order of the columns.
    states: Vec<[f64; 2]>,
}

impl Half {
    /// The one before the step `halfway`.
    pub fn first(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        Self::of(problem, evaluation, 0..halfway, problem.parameters())
    }

    /// The one from the step `halfway` on. The state that it sets out from has columns of its own.
    pub fn second(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        let steps = halfway..problem.experiments[0].nodes - 1;
        Self::of(problem, evaluation, steps, problem.parameters() + 2)
    }

    fn of(problem: &Problem, evaluation: &Evaluation, steps: Range<usize>, columns: usize) -> Self {
        let order = problem.places();
        let experiment = &problem.experiments[0];
        let mut triangle = Triangle::new(columns);
        let mut residuals = Residuals::with_capacity(PIECE);
        let states = problem.each_piece_of_part(evaluation, &order, steps, |mut piece| {
            // All rows of a piece are of one channel.
            let mut first = piece.first;
            let mut of = experiment.channels.iter().zip(&evaluation.predictions[0]);
            let channel = of.find(|(channel, _)| match first.checked_sub(channel.len()) {
                Some(rest) => {
                    first = rest;
                    false
                }
                None => true,
            });
            if let Some((channel, predicted)) = channel {
                residuals.clear();
                residuals.push(channel, predicted, first..first + piece.count);
                triangle.add_weighted(&mut piece, &residuals.roots, &residuals.weighted);
            }
            piece
        });
        Self {
            triangle,
            order,
            states,
        }
    }

    /// Both halves as one: the second sets out from the state at the end of the first.
    pub fn join(self, second: &Half) -> Reduced {
        let mut triangle = self.triangle;
        triangle.join(&second.triangle, &self.states);
        let order = self.order;
        Reduced { triangle, order }
    }
}
