//! Samples linearised by tangent solves and reduced to a triangular factor, for functions with few parameters.

use super::residuals::Residuals;
use crate::host::Instant;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::simd::LANES;
use crate::simd::tall_qr::{BLOCK_ROWS, Triangle};
use crate::solvers::timings::{Timings, timed};
use nalgebra::DMatrix;
use std::time::Duration;

/// Number of columns up to which the reduction of a block of rows is as fast as reading the clock.
pub(super) const NARROW: usize = LANES;

/// Linearised samples, reduced to as many rows as there are parameters: `|R delta + b|^2 + rest^2` with the triangular
/// factor `R` of the weighted Jacobian.
#[derive(Clone)]
pub(crate) struct Reduced {
    pub(super) triangle: Triangle,
    /// Parameter of each column.
    pub(super) order: Vec<usize>,
}

impl Reduced {
    /// True if the Jacobian of a problem can be reduced block by block ([`Problem::each_row_block`]) with a benefit.
    pub fn is_computed_by_blocks(problem: &Problem) -> bool {
        problem.is_computed_by_blocks() && problem.sample_count() > problem.parameters()
    }

    /// Reduction of the whole Jacobian of the predictions.
    pub(super) fn of(jacobian: &DMatrix<f64>, residuals: &Residuals) -> Self {
        let Residuals {
            weight_roots,
            weighted,
        } = residuals;
        let (triangle, order) = Triangle::of(jacobian, weight_roots, weighted);
        Self { triangle, order }
    }

    /// Reduction at an evaluated point, in one pass.
    pub(super) fn block_by_block(
        problem: &Problem,
        evaluation: &Evaluation,
        timings: &mut Timings,
    ) -> Self {
        let clock = Instant::now();
        let order = problem.positions();
        let mut residuals = Residuals::with_capacity(BLOCK_ROWS);
        let mut triangle = Triangle::new(order.len());
        let mut reducing = Duration::ZERO;
        problem.each_row_block(evaluation, &order, |mut block| {
            residuals.set_block(problem, evaluation, &block);
            let Residuals {
                weight_roots,
                weighted,
            } = &residuals;
            let mut add = || triangle.add_weighted(&mut block, weight_roots, weighted);
            match order.len() > NARROW {
                true => timed(&mut reducing, add),
                false => add(),
            }
            block
        });
        timings.linear_algebra += reducing;
        timings.tangent += clock.elapsed().saturating_sub(reducing);
        Self { triangle, order }
    }

    /// The same Jacobian at a nearby point with known misfit (a sum of squares) and gradient; `None` if it is inconsistent with
    /// them.
    pub fn nearby(&self, misfit: f64, gradient: &[f64]) -> Option<Self> {
        let products: Vec<f64> = self.order.iter().map(|j| 0.5 * gradient[*j]).collect();
        let triangle = self.triangle.clone().beside(&products, misfit)?;
        let order = self.order.clone();
        Some(Self { triangle, order })
    }

    /// Negative step to the minimum, in the order of the columns.
    #[cfg(test)]
    pub fn solution(&self) -> Option<Vec<f64>> {
        self.triangle.solve(1e-14)
    }

    /// True if all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        self.triangle.is_finite()
    }

    /// Subproblem in `delta theta`; the constant part of the misfit is a row of its own.
    pub(super) fn subproblem(&self) -> Subproblem {
        let mut sub = empty(self.order.len());
        for (entries, b) in self.triangle.rows() {
            let entries = entries.map(|(position, r)| (self.order[position], r));
            sub.residuals.push(entries, -b);
        }
        sub.residuals.push([], self.triangle.rest());
        sub
    }

    /// Gradient of the misfit; `None` where it is not finite.
    pub fn misfit_gradient(&self) -> Option<Vec<f64>> {
        let mut gradient = vec![0.0; self.order.len()];
        for (product, j) in self.triangle.products().into_iter().zip(&self.order) {
            gradient[*j] = 2.0 * product;
        }
        let is_finite = self.triangle.is_finite() && gradient.iter().all(|g| g.is_finite());
        is_finite.then_some(gradient)
    }
}

/// Subproblem whose variables are eliminated together.
fn empty(variables: usize) -> Subproblem {
    let mut sub = Subproblem::new(variables);
    sub.elimination_order = vec![0; variables];
    sub
}

/// Subproblem in `delta theta` at an evaluated point, from the full Jacobian: one tangent solve per parameter.
pub(super) fn of_whole_jacobian(
    problem: &Problem,
    evaluation: &Evaluation,
    timings: &mut Timings,
) -> Subproblem {
    let residuals = Residuals::at(problem, evaluation);
    let jacobian = timed(&mut timings.tangent, || {
        problem.whitened_jacobian(evaluation)
    });
    timed(&mut timings.linear_algebra, || {
        let Residuals {
            weight_roots,
            weighted,
        } = &residuals;
        if jacobian.nrows() > jacobian.ncols() {
            return Reduced::of(&jacobian, &residuals).subproblem();
        }
        let mut sub = empty(jacobian.ncols());
        for ((row, root), r) in jacobian.row_iter().zip(weight_roots).zip(weighted) {
            let entries = row.iter().map(|a| root * a).enumerate();
            sub.residuals.push(entries.filter(|(_, a)| *a != 0.0), -r);
        }
        // All rows of the samples then end alike.
        sub.residuals.push([], 0.0);
        sub
    })
}

/// Weighted Jacobian `sqrt(w) dz/dtheta` (samples x parameters) for the predictions `z` of all channels, whitened where the
/// noise is correlated.
pub fn weighted_jacobian(problem: &Problem, evaluation: &Evaluation) -> DMatrix<f64> {
    let Residuals { weight_roots, .. } = Residuals::at(problem, evaluation);
    let mut jacobian = problem.whitened_jacobian(evaluation);
    for mut column in jacobian.column_iter_mut() {
        (column.iter_mut().zip(&weight_roots)).for_each(|(a, root)| *a *= root);
    }
    jacobian
}
