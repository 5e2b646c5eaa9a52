//! The factorisation of weighted rows, and the rank at which standard errors, bands, verdicts, the constancy test,
//! predictions, extremes and the ranking of experiments call a combination of the parameters determined.

use nalgebra::{DMatrix, DMatrixView};

/// Singular values above this share of the largest count.
///
/// A singular value is wrong by at most the norm of the error of the matrix. Tangents, and so the columns of a Jacobian,
/// round by a few machine precisions for each step, whose signs vary: over 10^5 steps some hundred times
/// `f64::EPSILON` of the largest column. The decomposition itself adds less. The scale of a free response, which nothing
/// determines, comes out at 1e-14 of the largest singular value over 400,000 steps; the threshold is a hundred times that.
pub const RANK: f64 = 1e-12;

/// Singular values and right singular vectors of rows `A = U S V^T`, and their rank.
#[derive(Debug, Clone)]
pub(crate) struct Factorisation {
    /// Decreasing.
    pub singular_values: Vec<f64>,
    /// Number of those that count: above [`RANK`] times the largest, unless another threshold is set.
    pub rank: usize,
    /// As columns.
    vectors: DMatrix<f64>,
}

impl Factorisation {
    /// Of as many singular values as the smaller of rows and columns.
    ///
    /// A tall matrix is first reduced to its triangular factor, a wide one to that of its transpose, so
    /// that the decomposition is of a square of the smaller dimension. Of a matrix with entries that are
    /// not finite nothing is known: all values are zero.
    pub fn of(rows: &DMatrix<f64>) -> Self {
        let (singular_values, vectors) = right_svd(rows);
        let whole = Self {
            rank: 0,
            singular_values,
            vectors,
        };
        whole.above(RANK)
    }

    /// With a singular vector for every column: [`Factorisation::undetermined`] needs all.
    pub fn complete(rows: &DMatrix<f64>) -> Self {
        let (count, columns) = rows.shape();
        match count < columns {
            true => Self::of(&rows.clone().resize_vertically(columns, 0.0)),
            false => Self::of(rows),
        }
    }

    /// The same with the rank at another share of the largest singular value.
    pub fn above(self, share: f64) -> Self {
        let most = self.singular_values.first().copied().unwrap_or(0.0);
        self.above_size(share * most)
    }

    fn above_size(mut self, size: f64) -> Self {
        let values = self.singular_values.iter();
        self.rank = values.filter(|s| **s > size).count();
        self
    }

    /// The right singular vectors as columns, in the order of their values.
    pub fn vectors(&self) -> &DMatrix<f64> {
        &self.vectors
    }

    /// Orthonormal basis of the combinations of columns that the rows determine.
    pub fn determined(&self) -> DMatrixView<'_, f64> {
        self.vectors.columns(0, self.rank)
    }

    /// Orthonormal basis of those that they do not; the factorisation must be [`Factorisation::complete`].
    pub fn undetermined(&self) -> DMatrixView<'_, f64> {
        let count = self.vectors.ncols() - self.rank;
        self.vectors.columns(self.rank, count)
    }

    /// A root of `(A^T A)^-1` on the combinations that are determined: `F F^T` is the inverse.
    pub fn inverse_root(&self) -> DMatrix<f64> {
        let mut root = self.determined().into_owned();
        for (mut column, s) in root.column_iter_mut().zip(&self.singular_values) {
            column /= *s;
        }
        root
    }
}

/// An orthonormal basis of the span of the columns, with the rank at the share `tolerance` of the largest singular value.
pub(super) fn column_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let factorisation = Factorisation::of(&matrix.transpose()).above(tolerance);
    factorisation.determined().into_owned()
}

/// An orthonormal basis of the vectors that `matrix` takes to no more than `tolerance` times their
/// length, as columns.
pub(super) fn null_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let factorisation = Factorisation::complete(matrix).above_size(tolerance);
    factorisation.undetermined().into_owned()
}

/// Whether all entries are finite: an iteration for singular values of others would not end.
fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

/// Singular values, decreasing, and the right singular vectors that belong to them as columns.
///
/// A tall matrix is first reduced to its triangular factor, a wide one to that of its transpose, so
/// that the decomposition is of a square of the smaller dimension. Of a matrix with entries that are
/// not finite nothing is known: all values are zero.
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
        matrix.clone().qr().r()
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
    fn the_null_space_is_orthonormal_and_goes_to_zero() {
        let wide = DMatrix::from_row_slice(2, 4, &[1.0, 2.0, 0.0, 1.0, 2.0, 4.0, 0.0, 2.0]);
        let null = null_space(&wide, 1e-12);
        assert_eq!(null.ncols(), 3);
        assert!((wide * &null).amax() < 1e-14);
        assert!((null.transpose() * &null - DMatrix::identity(3, 3)).amax() < 1e-14);
    }
}
