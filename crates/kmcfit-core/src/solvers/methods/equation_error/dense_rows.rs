//! The equations of motion as a dense matrix of rows in the parameters.

use super::equation::Equations;
use crate::noise::KernelCovariance;
use crate::problem::Problem;
use crate::qp::Subproblem;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Part of a column of the rows beside the columns before it, relative to the column, above which a parameter is determined: the
/// covariance has the square of its rounding error, 1e-4.
const DETERMINED: f64 = 1e-6;

/// The equations of motion at some parameters as rows in these, in units of the root of the cost: each with the root of its weight,
/// with a robust loss that of its residual.
pub(super) struct DenseRows {
    /// Rows x parameters.
    pub rows: DMatrix<f64>,
    pub residuals: DVector<f64>,
    /// Root of the weight of each row.
    pub weight_roots: Vec<f64>,
    /// Rows of each record, in time order.
    pub records: Vec<Range<usize>>,
}

impl DenseRows {
    pub fn of(problem: &Problem, equations: &Equations, theta: &[f64]) -> Self {
        let mut sub = Subproblem::new(problem.parameters());
        let (mut records, mut weight_roots) = (Vec::new(), Vec::new());
        for equation in &equations.list {
            let first = sub.residuals.len();
            let residuals = equation.residuals_at(problem, theta);
            let root = |e: f64| (equation.weight() * equation.loss.weight(e)).sqrt();
            equation.add_rows(problem, &residuals, root, &mut sub);
            records.push(first..sub.residuals.len());
            weight_roots.extend(residuals.into_iter().map(root));
        }
        let mut rows = DMatrix::zeros(sub.residuals.len(), sub.variables);
        for i in 0..sub.residuals.len() {
            (sub.residuals.row(i)).for_each(|(j, x)| rows[(i, j)] += x);
        }
        let right = sub.residuals.right().iter();
        Self {
            residuals: DVector::from_iterator(rows.nrows(), right.map(|e| -e)),
            rows,
            weight_roots,
            records,
        }
    }

    /// Step of the first `functions` parameters to the least squares of the rows, and the logarithm of the determinant of its kernel
    /// covariance; `None` where the rows or their residuals leave them undetermined.
    pub fn estimates(&self, functions: usize) -> Option<(DVector<f64>, f64)> {
        let columns = self.rows.columns(0, functions).into_owned();
        let sizes: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        let qr = (columns.nrows() > functions).then(|| columns.qr())?;
        let (q, r) = (qr.q(), qr.r());
        let diagonal = r.diagonal().abs();
        let is_determined = |(d, size): (&f64, &f64)| *d > DETERMINED * size;
        (diagonal.iter().zip(&sizes).all(is_determined)).then_some(())?;
        let answers = q.tr_mul(&self.residuals);
        let errors = &self.residuals - &q * &answers;
        let mut scores = q;
        for mut column in scores.column_iter_mut() {
            column.component_mul_assign(&errors);
        }
        let covariance = KernelCovariance::of(&scores, &self.records, functions as f64)?;
        let root = covariance.sum.cholesky()?.l();
        let logarithms = |diagonal: DVector<f64>| diagonal.map(f64::ln).sum();
        let size = 2.0 * (logarithms(root.diagonal()) - logarithms(diagonal));
        Some((-r.solve_upper_triangular(&answers)?, size))
    }
}
