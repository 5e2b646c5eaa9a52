//! Linearised samples of a long record in two halves, each reduced separately, on two threads where a processor is free.
//!
//! The gradient of the misfit is the product of Jacobian and residuals and needs no adjoint solve.

use super::reduced::{NARROW, Reduced};
use super::residuals::Residuals;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::simd::tall_qr::{BLOCK_ROWS, Triangle};
use crate::threads;
use std::ops::Range;

/// Step at which a record is divided: the middle of a long record with few parameters; `None` otherwise.
pub(in crate::solvers) fn halfway(problem: &Problem) -> Option<usize> {
    let is_narrow = problem.parameters() <= NARROW && Reduced::is_computed_by_blocks(problem);
    problem.middle().filter(|_| is_narrow)
}

/// Samples of both halves of a record divided at step `halfway`, and the result of `beside`, computed after the first half.
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

/// Samples of one half of a record, linearised and reduced.
pub(super) struct Half {
    triangle: Triangle,
    /// Parameter of each column.
    order: Vec<usize>,
    /// Derivatives of the state at its end with respect to the parameters, in the order of the columns.
    states: Vec<[f64; 2]>,
}

impl Half {
    /// Half before the step `halfway`.
    pub fn first(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        Self::of(problem, evaluation, 0..halfway, problem.parameters())
    }

    /// Half from the step `halfway` on; its initial state has columns of its own.
    pub fn second(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        let steps = halfway..problem.experiments[0].nodes - 1;
        Self::of(problem, evaluation, steps, problem.parameters() + 2)
    }

    fn of(problem: &Problem, evaluation: &Evaluation, steps: Range<usize>, columns: usize) -> Self {
        let order = problem.positions();
        let mut triangle = Triangle::new(columns);
        let mut residuals = Residuals::with_capacity(BLOCK_ROWS);
        let states = problem.each_row_block_of_part(evaluation, &order, steps, |mut block| {
            residuals.set_block(problem, evaluation, &block);
            triangle.add_weighted(&mut block, &residuals.weight_roots, &residuals.weighted);
            block
        });
        Self {
            triangle,
            order,
            states,
        }
    }

    /// Joins the halves: the initial state of the second is the final state of the first.
    pub fn join(self, second: &Half) -> Reduced {
        let mut triangle = self.triangle;
        triangle.join(&second.triangle, &self.states);
        let order = self.order;
        Reduced { triangle, order }
    }
}
