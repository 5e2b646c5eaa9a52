//! Singular value decomposition of weighted rows, with the rank threshold that decides which combinations of parameters
//! are determined: for standard errors, bands, classification, constancy test, predictions, extremes and experiment design.

use crate::simd::tall_qr::Triangle;
use nalgebra::{DMatrix, DMatrixView};

/// Rank threshold relative to the largest singular value.
///
/// The error of a singular value is bounded by the norm of the error of the matrix. The rounding errors of tangents, and
/// so of the columns of a Jacobian, are a few units of machine precision per step with varying signs: some hundred times
/// `f64::EPSILON` of the largest column over 10^5 steps; the decomposition adds less. The scale of a free response, which
/// is undetermined, has a computed singular value of 1e-14 of the largest over 400,000 steps; the threshold is a hundred
/// times larger.
pub const RANK: f64 = 1e-12;

/// Singular values and right singular vectors of `A = U S V^T`, and the numerical rank.
#[derive(Debug, Clone)]
pub(crate) struct Factorisation {
    /// Singular values, decreasing.
    pub singular_values: Vec<f64>,
    /// Number of singular values above the threshold: [`RANK`] times the largest, unless another is set.
    pub rank: usize,
    /// Right singular vectors, as columns.
    vectors: DMatrix<f64>,
}

impl Factorisation {
    /// Decomposition with as many singular values as the smaller of rows and columns.
    ///
    /// A tall matrix is first reduced to its triangular factor, a wide one to that of its transpose, so that the
    /// decomposition is of a square matrix of the smaller dimension. For a matrix with non-finite entries all singular values
    /// are zero.
    pub fn of(rows: &DMatrix<f64>) -> Self {
        let (singular_values, vectors) = right_svd(rows);
        let whole = Self {
            rank: 0,
            singular_values,
            vectors,
        };
        whole.above(RANK)
    }

    /// Decomposition with a singular vector for every column, as [`Factorisation::undetermined`] requires.
    pub fn complete(rows: &DMatrix<f64>) -> Self {
        let (count, columns) = rows.shape();
        match count < columns {
            true => Self::of(&rows.clone().resize_vertically(columns, 0.0)),
            false => Self::of(rows),
        }
    }

    /// The same decomposition with another threshold, relative to the largest singular value.
    pub fn above(self, share: f64) -> Self {
        let most = self.singular_values.first().copied().unwrap_or(0.0);
        self.above_size(share * most)
    }

    fn above_size(mut self, size: f64) -> Self {
        let values = self.singular_values.iter();
        self.rank = values.filter(|s| **s > size).count();
        self
    }

    /// Right singular vectors as columns, in the order of the singular values.
    pub fn vectors(&self) -> &DMatrix<f64> {
        &self.vectors
    }

    /// Orthonormal basis of the combinations of columns determined by the rows.
    pub fn determined(&self) -> DMatrixView<'_, f64> {
        self.vectors.columns(0, self.rank)
    }

    /// Orthonormal basis of the undetermined combinations; the factorisation must be [`Factorisation::complete`].
    pub fn undetermined(&self) -> DMatrixView<'_, f64> {
        let count = self.vectors.ncols() - self.rank;
        self.vectors.columns(self.rank, count)
    }

    /// Root `F` of `(A^T A)^-1` on the determined combinations: `F F^T` is the inverse.
    pub fn inverse_root(&self) -> DMatrix<f64> {
        let mut root = self.determined().into_owned();
        for (mut column, s) in root.column_iter_mut().zip(&self.singular_values) {
            column /= *s;
        }
        root
    }
}

/// Orthonormal basis of the column space, with the rank threshold `tolerance` relative to the largest singular value.
pub(super) fn column_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let factorisation = Factorisation::of(&matrix.transpose()).above(tolerance);
    factorisation.determined().into_owned()
}

/// Orthonormal basis, as columns, of the vectors `x` with `|matrix x| <= tolerance |x|`.
pub(super) fn null_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let factorisation = Factorisation::complete(matrix).above_size(tolerance);
    factorisation.undetermined().into_owned()
}

/// True if all entries are finite, which the iteration for singular values requires to terminate.
fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

/// Singular values, decreasing, and right singular vectors as columns; see [`Factorisation::of`].
fn right_svd(matrix: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let (rows, columns) = matrix.shape();
    if rows == 0 || columns == 0 {
        return (Vec::new(), DMatrix::zeros(columns, 0));
    }
    if !is_finite(matrix) {
        let count = rows.min(columns);
        return (vec![0.0; count], DMatrix::identity(columns, count));
    }
    if rows < columns {
        let qr = matrix.transpose().qr();
        // J = R^T Q^T, so its right singular vectors are Q times those of R^T.
        let svd = qr.r().svd(true, false);
        let inner = svd.u.expect("asked for");
        return (svd.singular_values.as_slice().to_vec(), qr.q() * inner);
    }
    let square = if rows > columns {
        Triangle::factor(matrix)
    } else {
        matrix.clone()
    };
    let svd = square.svd(false, true);
    let right = svd.v_t.expect("asked for").transpose();
    (svd.singular_values.as_slice().to_vec(), right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_and_tall_matrices_have_the_same_singular_values() {
        let tall = DMatrix::from_fn(7, 4, |i, j| ((3 * i + 5 * j) % 7) as f64 - 3.0);
        let (a, _) = right_svd(&tall);
        let (b, right) = right_svd(&tall.transpose());
        // Rounding of values of order ten.
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-13));
        let image = tall.transpose() * &right;
        let each = image.column_iter().zip(&b);
        assert!(each.into_iter().all(|(c, s)| (c.norm() - s).abs() < 1e-13));
    }

    #[test]
    fn the_null_space_is_orthonormal_and_maps_to_zero() {
        let wide = DMatrix::from_row_slice(2, 4, &[1.0, 2.0, 0.0, 1.0, 2.0, 4.0, 0.0, 2.0]);
        let null = null_space(&wide, 1e-12);
        assert_eq!(null.ncols(), 3);
        assert!((wide * &null).amax() < 1e-14);
        assert!((null.transpose() * &null - DMatrix::identity(3, 3)).amax() < 1e-14);
    }
}
