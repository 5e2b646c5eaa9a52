//! The linear algebra that the module needs beside what nalgebra offers.

use nalgebra::DMatrix;

/// Whether all entries are finite: an iteration for singular values of others would not end.
fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

/// Singular values, decreasing, and the right singular vectors that belong to them as columns.
///
/// A tall matrix is first reduced to its triangular factor, a wide one to that of its transpose, so
/// that the decomposition is of a square of the smaller dimension. Of a matrix with entries that are
/// not finite nothing is known: all values are zero.
pub(super) fn right_svd(matrix: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
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

/// An orthonormal basis of the vectors that `matrix` takes to no more than `tolerance` times their
/// length, as columns.
pub(super) fn null_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let (rows, columns) = matrix.shape();
    if rows == 0 || !is_finite(matrix) {
        return DMatrix::identity(columns, columns);
    }
    // Rows of zeros make it square, so that the decomposition names every right vector.
    let square = match rows.cmp(&columns) {
        std::cmp::Ordering::Less => matrix.clone().resize_vertically(columns, 0.0),
        std::cmp::Ordering::Equal => matrix.clone(),
        std::cmp::Ordering::Greater => matrix.clone().qr().r(),
    };
    let svd = square.svd(false, true);
    let right = svd.v_t.expect("asked for");
    let seen = (svd.singular_values.iter())
        .filter(|s| **s > tolerance)
        .count();
    right.rows(seen, columns - seen).transpose()
}

/// An orthonormal basis of the span of the columns, those aside that are dependent to `tolerance`
/// relative to the largest singular value.
pub(super) fn column_space(matrix: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let (values, vectors) = right_svd(&matrix.transpose());
    let most = values.first().copied().unwrap_or(0.0);
    let rank = values.iter().filter(|s| **s > tolerance * most).count();
    vectors.columns(0, rank).into_owned()
}

/// Spans of time on which `holds` is true at consecutive nodes, s.
pub(super) fn spans(times: &[f64], holds: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut open = false;
    for (i, &t) in times.iter().enumerate() {
        match (holds(i), open) {
            (true, true) => {
                if let Some(span) = spans.last_mut() {
                    span[1] = t;
                }
            }
            (true, false) => spans.push([t, t]),
            _ => {}
        }
        open = holds(i);
    }
    spans
}

/// Most spans that a sentence lists.
const MOST_SPANS: usize = 4;

/// Spans in words.
pub(super) fn span_words(spans: &[[f64; 2]]) -> String {
    let word = |&[from, to]: &[f64; 2]| match from == to {
        true => format!("t = {from:.3} s"),
        false => format!("[{from:.3}, {to:.3}] s"),
    };
    let words: Vec<String> = spans.iter().take(MOST_SPANS).map(word).collect();
    match spans.len().saturating_sub(MOST_SPANS) {
        0 => words.join(", "),
        1 => format!("{} and 1 more span", words.join(", ")),
        more => format!("{} and {more} more spans", words.join(", ")),
    }
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

    #[test]
    fn spans_join_neighbours() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0];
        let mask = [true, true, false, true, false];
        assert_eq!(spans(&times, |i| mask[i]), [[0.0, 1.0], [3.0, 3.0]]);
    }
}
