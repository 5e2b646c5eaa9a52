//! Gram matrices of the L2 inner product in parameters: `G = B^T W B` with trapezoid weights `W`.

use super::{Design, LocalRows};
use crate::rows::Rows;
use nalgebra::DMatrix;
use nalgebra_sparse::csc::CscCol;
use nalgebra_sparse::factorization::CscCholesky;
use nalgebra_sparse::{CooMatrix, CscMatrix, CsrMatrix, SparseEntry};
use std::collections::BTreeMap;
use std::ops::Range;

/// Smallest squared sine of the angle between a column of the design matrix and the previous ones for which they count as
/// independent. Rounding errors are about 1e-15, and gradients are amplified by the inverse.
const INDEPENDENT: f64 = 1e-12;

/// Gram matrix of one basis in L2, with its factor.
#[derive(Debug, Clone)]
pub enum Gram {
    /// Diagonal for nodal functions: `G = W`.
    Diagonal(Vec<f64>),
    /// Any other basis, with its Cholesky factor.
    Factored {
        /// `G`.
        matrix: Rows,
        /// Cholesky factor.
        factor: Box<CscCholesky<f64>>,
    },
}

impl Gram {
    /// Gram matrix of `design` with the quadrature `weights` (s) at the nodes; `None` if the columns are (nearly) linearly
    /// dependent on the grid.
    pub fn new(design: &Design, weights: &[f64]) -> Option<Self> {
        match design {
            Design::Empty => Some(Gram::Diagonal(Vec::new())),
            Design::Identity => Some(Gram::Diagonal(weights.to_vec())),
            Design::Constant { .. } => {
                let sum = weights.iter().sum();
                Self::factored(&CsrMatrix::from(&DMatrix::from_element(1, 1, sum)))
            }
            Design::Sparse(rows) => Self::factored(&weighted_products(rows, weights)),
        }
    }

    /// With its Cholesky factor; `None` for (nearly) dependent columns.
    fn factored(gram: &CsrMatrix<f64>) -> Option<Self> {
        let factor = CscCholesky::factor(&CscMatrix::from(gram)).ok()?;
        independent(gram, factor.l()).then_some(())?;
        Some(Gram::Factored {
            matrix: rows_of(gram),
            factor: Box::new(factor),
        })
    }

    /// Diagonal of `G`.
    pub fn diagonal(&self) -> Vec<f64> {
        match self {
            Gram::Diagonal(weights) => weights.clone(),
            Gram::Factored { matrix, .. } => {
                let entry = |i| matrix.row(i).find(|(j, _)| *j == i).map_or(0.0, |(_, a)| a);
                (0..matrix.len()).map(entry).collect()
            }
        }
    }

    /// Computes `out = G theta`.
    pub fn multiply(&self, theta: &[f64], out: &mut [f64]) {
        match self {
            Gram::Diagonal(weights) => {
                for ((o, w), t) in out.iter_mut().zip(weights).zip(theta) {
                    *o = w * t;
                }
            }
            Gram::Factored { matrix, .. } => {
                out.fill(0.0);
                matrix.multiply_add(theta, out);
            }
        }
    }

    /// Squared L2 norm `theta^T G theta`.
    pub fn square(&self, theta: &[f64]) -> f64 {
        match self {
            Gram::Diagonal(weights) => {
                let terms = weights.iter().zip(theta);
                terms.map(|(w, t)| w * t * t).sum()
            }
            // As |L^T theta|^2, which has no cancellation.
            Gram::Factored { factor, .. } => {
                let columns = factor.l().col_iter();
                let product = |column: &CscCol<'_, f64>| -> f64 {
                    let entries = column.row_indices().iter().zip(column.values());
                    entries.map(|(i, l)| l * theta[*i]).sum()
                };
                columns.map(|column| product(&column).powi(2)).sum()
            }
        }
    }

    /// Computes `out = G^-1 dual`, which converts a Euclidean gradient to the parameters of the L2 gradient.
    pub fn solve(&self, dual: &[f64], out: &mut [f64]) {
        match self {
            Gram::Diagonal(weights) => {
                for ((o, w), d) in out.iter_mut().zip(weights).zip(dual) {
                    *o = d / w;
                }
            }
            Gram::Factored { factor, .. } => {
                let solution = factor.solve(&DMatrix::from_column_slice(dual.len(), 1, dual));
                out.copy_from_slice(solution.as_slice());
            }
        }
    }
}

/// `B^T W B`, each entry summed in the order of the rows. Neighbouring rows have mostly the same columns, those of the functions of one cell.
fn weighted_products(rows: &LocalRows, weights: &[f64]) -> CsrMatrix<f64> {
    let mut products: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let mut cell = 0..0;
    let mut sums: Vec<f64> = Vec::new();
    let positions = |cell: &Range<usize>| -> Vec<(usize, usize)> {
        let pairs = cell.clone().flat_map(|j| cell.clone().map(move |k| (j, k)));
        pairs.collect()
    };
    for (i, weight) in (0..rows.len()).zip(weights) {
        let (first, entries) = rows.nonzero(i);
        let own = first..first + entries.len();
        if own != cell {
            products.extend(positions(&cell).into_iter().zip(sums));
            cell = own;
            let known = |position| products.get(&position).copied().unwrap_or(0.0);
            sums = positions(&cell).into_iter().map(known).collect();
        }
        for (a, sums) in entries.iter().zip(sums.chunks_exact_mut(cell.len().max(1))) {
            for (b, sum) in entries.iter().zip(sums) {
                *sum += a * (weight * b);
            }
        }
    }
    products.extend(positions(&cell).into_iter().zip(sums));
    let mut matrix = CooMatrix::new(rows.width(), rows.width());
    for ((j, k), product) in products {
        matrix.push(j, k, product);
    }
    CsrMatrix::from(&matrix)
}

fn rows_of(matrix: &CsrMatrix<f64>) -> Rows {
    let mut rows = Rows::of_width(matrix.ncols());
    for row in matrix.row_iter() {
        let entries = row.col_indices().iter().zip(row.values());
        rows.push(entries.map(|(j, a)| (*j, *a)), 0.0);
    }
    rows
}

/// True if no pivot `L_jj^2` is negligible relative to the diagonal entry `G_jj`.
fn independent(gram: &CsrMatrix<f64>, lower: &CscMatrix<f64>) -> bool {
    let diagonal = |matrix: Option<SparseEntry<'_, f64>>| matrix.map_or(0.0, |e| e.into_value());
    (0..gram.nrows()).all(|j| {
        let pivot = diagonal(lower.get_entry(j, j));
        pivot * pivot > INDEPENDENT * diagonal(gram.get_entry(j, j))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    /// The squared norm equals the weighted sum over the nodes for every basis.
    #[test]
    fn squared_norms_equal_those_of_the_nodal_values() {
        let weights = [0.5, 1.0, 1.0, 1.0, 0.5];
        let theta = [1.5, -2.0];
        let mut rows = LocalRows::new(2, 2);
        for i in 0..5 {
            rows.push([(0, 1.0), (1, 0.25 * i as f64)].into_iter());
        }
        let design = Design::Sparse(Arc::new(rows));
        let gram = Gram::new(&design, &weights).expect("independent columns");
        let value = |i: usize| theta[0] + theta[1] * 0.25 * i as f64;
        let expected: f64 = (0..5).map(|i| weights[i] * value(i).powi(2)).sum();
        assert!((gram.square(&theta) - expected).abs() <= 1e-14 * expected);
        let nodal = Gram::new(&Design::Identity, &weights).expect("weights");
        let values: Vec<f64> = (0..5).map(value).collect();
        assert!((nodal.square(&values) - expected).abs() <= 1e-14 * expected);
    }
}
