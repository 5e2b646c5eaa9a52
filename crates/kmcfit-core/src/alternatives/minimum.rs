//! Minima of linearised sums of squares.

use crate::identifiability::Factorisation;
use crate::simd::tall_qr::Triangle;
use nalgebra::{DMatrix, DVector};

/// Root `F` of `(J^T J)^-1 = F F^T` on the combinations of parameters that `J` determines, with columns of unit length for the decision.
pub(crate) fn inverse_root(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let mut scaled = match jacobian.nrows() > jacobian.ncols() {
        true => Triangle::factor(jacobian),
        false => jacobian.clone(),
    };
    let sizes: Vec<f64> = (scaled.column_iter())
        .map(|column| column.norm().max(f64::MIN_POSITIVE))
        .collect();
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let mut root = Factorisation::of(&scaled).inverse_root();
    for (mut row, size) in root.row_iter_mut().zip(&sizes) {
        row /= *size;
    }
    root
}

/// Minimum of `|r + J d|^2`.
pub(crate) struct Minimum {
    /// The minimum.
    pub(crate) squares: f64,
    pub(crate) rank: usize,
    /// Root `F` of the inverse of `J^T J`.
    pub(crate) root: DMatrix<f64>,
    /// The minimiser.
    pub(crate) change: DVector<f64>,
}

impl Minimum {
    pub(crate) fn of(jacobian: &DMatrix<f64>, residuals: &DVector<f64>) -> Self {
        let root = inverse_root(jacobian);
        let change = -(&root * root.tr_mul(&jacobian.tr_mul(residuals)));
        Self {
            squares: (residuals + jacobian * &change).norm_squared(),
            rank: root.ncols(),
            change,
            root,
        }
    }
}
