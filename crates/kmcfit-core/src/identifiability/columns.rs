//! Matrices with further rows or a further column.

use nalgebra::{DMatrix, DVector};

/// The matrix with a column after the others.
pub(super) fn with_column(root: DMatrix<f64>, column: &DVector<f64>) -> DMatrix<f64> {
    let last = root.ncols();
    let mut wider = root.insert_column(last, 0.0);
    wider.set_column(last, column);
    wider
}

/// Matrix `a` above `b`.
pub(crate) fn stacked(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows() + b.nrows(), a.ncols());
    out.rows_mut(0, a.nrows()).copy_from(a);
    out.rows_mut(a.nrows(), b.nrows()).copy_from(b);
    out
}
