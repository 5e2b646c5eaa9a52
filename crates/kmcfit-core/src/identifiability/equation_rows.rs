//! Covariance of the estimates of the equation error from the scores of its rows.
//!
//! With the rows `x_i` of the equation of motion in the parameters, one for each bump function of the weak form or for each sample, and its residuals `e_i`, in units of the root of the cost, the
//! scores are `s_i = x_i e_i` and
//!
//! ```text
//! Cov = H^-1 S H^-1,    H = sum_i x_i x_i^T + sum_j weight_j L_j^T L_j
//! ```
//!
//! with the kernel covariance `S` of the scores ([`KernelCovariance`]): no assumption is made on the variance and the correlation of the
//! residuals. Where a misfit makes the estimates of constants depend on the width of the bump functions, their change is a further root of the
//! covariance, and for functions of time the common shrinkage by the errors of the rows, which contain the measured response, where a force
//! gives the scale. It **excludes** what else these errors change.

use super::active::ActiveRow;
use super::columns::with_column;
use super::sensitivity::Sensitivity;
use crate::noise::KernelCovariance;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The equation of motion at the samples, or averaged by bump functions, linear in the parameters, at the minimum of the equation error.
#[derive(Debug, Clone)]
pub struct EquationRows {
    /// Rows x parameters.
    pub rows: DMatrix<f64>,
    /// Residual of each row.
    pub residuals: Vec<f64>,
    /// Rows of each record, in time order.
    pub records: Vec<Range<usize>>,
    /// Change of each row by one of the estimates that the scores do not show: of constants with the width of the bump functions, where a
    /// misfit makes them depend on it; of functions of time by the errors of the rows.
    pub change: Option<DVector<f64>>,
    /// Linear forms of the parameters held besides the constraints, as columns and coefficients: nuisance parameters, and the mean of the
    /// mass where the common scale of the functions is undetermined.
    pub held: Vec<Vec<(usize, f64)>>,
    /// True if the common scale of the functions is undetermined.
    pub is_scale_free: bool,
}

/// Scores of the rows of an equation error along scaled directions.
pub(super) struct Scores {
    /// Scores, rows x directions.
    scores: DMatrix<f64>,
    records: Vec<Range<usize>>,
    pub held: Vec<ActiveRow>,
    /// Unit vector along the common scale, where that is undetermined.
    scale: Option<DVector<f64>>,
}

impl Scores {
    pub fn of(
        equation: &EquationRows,
        sensitivity: &Sensitivity,
        theta: &[f64],
        functions: usize,
    ) -> Self {
        let mut scores = sensitivity.jacobian.clone();
        for mut column in scores.column_iter_mut() {
            (column.iter_mut().zip(&equation.residuals)).for_each(|(x, e)| *x *= e);
        }
        // The score of a held parameter does not count in the bandwidth.
        for entries in &equation.held {
            if let [(j, _)] = entries.as_slice() {
                scores.column_mut(*j).fill(0.0);
            }
        }
        let held = |entries: &Vec<(usize, f64)>| ActiveRow {
            entries: entries.clone(),
            equality: true,
            name: String::new(),
        };
        let scaled: Vec<f64> = (theta.iter().enumerate())
            .map(|(j, t)| if j < functions { *t } else { 0.0 })
            .collect();
        let along = DVector::from_vec(sensitivity.directions.nearest(&scaled));
        Self {
            scores,
            records: equation.records.clone(),
            held: equation.held.iter().map(held).collect(),
            scale: (equation.is_scale_free && along.norm() > 0.0).then(|| along.normalize()),
        }
    }

    /// Root of `H^-1 S H^-1` for the root of `H^-1` and the `effective` number of parameters; `None` if the scores have no
    /// covariance.
    pub fn root(&self, inverse_root: &DMatrix<f64>, effective: f64) -> Option<DMatrix<f64>> {
        let covariance = KernelCovariance::of(&self.scores, &self.records, effective)?;
        let middle = inverse_root.tr_mul(&covariance.sum) * inverse_root;
        let eigen = (0.5 * (&middle + middle.transpose())).symmetric_eigen();
        let mut vectors = eigen.eigenvectors;
        for (mut vector, value) in vectors.column_iter_mut().zip(&eigen.eigenvalues) {
            vector *= value.max(0.0).sqrt();
        }
        Some(inverse_root * vectors)
    }

    /// The undetermined directions, with the common scale where that is undetermined.
    pub fn undetermined(&self, others: DMatrix<f64>) -> DMatrix<f64> {
        match &self.scale {
            None => others,
            Some(scale) => with_column(others, scale),
        }
    }
}
