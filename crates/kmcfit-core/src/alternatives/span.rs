//! Derivatives of a model at its optimum, and score tests of a further parameter beside them.

use super::minimum::inverse_root;
use crate::noise::KernelCovariance;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::ScoreCovariance;
use crate::solvers::weighted_jacobian;
use nalgebra::{DMatrix, DVector};

/// Part of a candidate's derivatives outside the span of the model's below which it is no candidate.
const APART: f64 = 1e-6;

/// Number of rows that are multiplied at once.
const ROWS: usize = 1024;

/// Weighted and whitened residuals of all channels.
pub(crate) fn weighted_residuals(problem: &Problem, evaluation: &Evaluation) -> DVector<f64> {
    let each = (problem.predicted(evaluation))
        .flat_map(|(channel, predicted)| channel.majorant(predicted).weighted);
    DVector::from_vec(each.collect())
}

/// Orthonormal basis of the derivatives of the model.
pub(crate) struct Span {
    basis: DMatrix<f64>,
}

impl Span {
    /// Estimate of a parameter with the derivatives `column` beside those of the model, and its ratio to the standard error.
    pub(crate) fn score(
        problem: &Problem,
        evaluation: &Evaluation,
        column: Vec<f64>,
    ) -> Option<(f64, f64)> {
        let model = Self::of(weighted_jacobian(problem, evaluation));
        let rest = model.orthogonal(weighted_residuals(problem, evaluation));
        model.test(problem, DVector::from_vec(column), &rest, true)
    }

    pub(crate) fn of(jacobian: DMatrix<f64>) -> Self {
        let root = inverse_root(&jacobian);
        // In place, because all samples have a row.
        let mut basis = jacobian;
        for first in (0..basis.nrows()).step_by(ROWS) {
            let mut rows = basis.rows_range_mut(first..basis.nrows().min(first + ROWS));
            let product = &rows * &root;
            rows.columns_mut(0, root.ncols()).copy_from(&product);
        }
        let basis = basis.resize_horizontally(root.ncols(), 0.0);
        Self { basis }
    }

    /// Part of a vector orthogonal to the derivatives of the model.
    pub(crate) fn orthogonal(&self, mut vector: DVector<f64>) -> DVector<f64> {
        let shares = self.basis.tr_mul(&vector);
        vector.gemv(-1.0, &self.basis, &shares, 1.0);
        vector
    }

    /// Decrease of the square of `rest`, which is orthogonal to the derivatives of the model, by further columns.
    pub(crate) fn gain(&self, columns: &[DVector<f64>], rest: &DVector<f64>) -> f64 {
        let mut apart = DMatrix::from_columns(columns);
        self.make_orthogonal(&mut apart);
        let moments = apart.tr_mul(rest);
        let normal = apart.tr_mul(&apart);
        let solved = normal.cholesky().map(|factor| factor.solve(&moments));
        solved.map_or(0.0, |change| moments.dot(&change))
    }

    /// Leaves the parts of the columns orthogonal to the derivatives of the model.
    pub(crate) fn make_orthogonal(&self, columns: &mut DMatrix<f64>) {
        let shares = self.basis.tr_mul(columns);
        columns.gemm(-1.0, &self.basis, &shares, 1.0);
    }

    /// Estimate of the coefficient with the derivatives `column`, and its ratio to the standard error; `e` is the part of the residuals
    /// orthogonal to the derivatives of the model.
    pub(crate) fn test(
        &self,
        problem: &Problem,
        column: DVector<f64>,
        e: &DVector<f64>,
        is_modelled: bool,
    ) -> Option<(f64, f64)> {
        let whole = column.norm_squared();
        let mut z = self.orthogonal(column);
        let square = z.norm_squared();
        (square > APART * APART * whole).then_some(())?;
        let value = -z.dot(e) / square;
        let estimated = (self.basis.ncols() + 1) as f64;
        let is_kernel = |c: &crate::record::Channel| c.noise().scores == ScoreCovariance::Kernel;
        let variance = match !is_modelled || problem.channels().any(is_kernel) {
            true => {
                let mut rest = e.clone();
                rest.axpy(value, &z, 1.0);
                rest.component_mul_assign(&z);
                let scores = DMatrix::from_vec(rest.len(), 1, rest.data.into());
                let found = KernelCovariance::of(&scores, &problem.channel_samples(), estimated)?;
                found.sum[(0, 0)] / (square * square)
            }
            false => {
                // The rest, in place of `z`.
                z.axpy(1.0, e, value);
                z.norm_squared() / (z.len() as f64 - estimated) / square
            }
        };
        let error = variance.max(0.0).sqrt();
        (error > 0.0).then(|| (value, value / error))
    }
}
