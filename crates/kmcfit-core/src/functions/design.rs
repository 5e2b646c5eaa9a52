//! Design matrices: from parameters to values at the nodes.

use crate::simd::sum::largest;
use nalgebra_sparse::CsrMatrix;

/// A matrix `B` of shape `nodes x parameters`.
#[derive(Debug, Clone)]
pub enum Design {
    /// No parameters.
    Empty,
    /// One parameter per node.
    Identity,
    /// Anything else, by rows.
    Sparse(CsrMatrix<f64>),
}

impl Design {
    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let unit = matches!(self, Design::Identity).then_some((i, 1.0));
        let (columns, values) = match self {
            Design::Sparse(matrix) => {
                let range = matrix.row_offsets()[i]..matrix.row_offsets()[i + 1];
                (
                    &matrix.col_indices()[range.clone()],
                    &matrix.values()[range],
                )
            }
            _ => (&[][..], &[][..]),
        };
        let entries = columns.iter().copied().zip(values.iter().copied());
        unit.into_iter().chain(entries)
    }

    /// Whether it is of so many parameters.
    pub fn has_columns(&self, parameters: usize) -> bool {
        match self {
            Design::Empty => parameters == 0,
            Design::Identity => true,
            Design::Sparse(matrix) => matrix.ncols() == parameters,
        }
    }

    /// `values += B theta`.
    pub fn multiply_add(&self, theta: &[f64], values: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => values.iter_mut().zip(theta).for_each(|(v, t)| *v += t),
            Design::Sparse(matrix) if is_column(matrix) => {
                let pairs = values.iter_mut().zip(matrix.values());
                pairs.for_each(|(value, b)| *value += b * theta[0]);
            }
            Design::Sparse(matrix) => {
                each_row(matrix, theta, values.len(), |i, product| {
                    values[i] += product;
                });
            }
        }
    }

    /// Whether it is one column with the same entry at every node.
    pub fn is_constant(&self) -> bool {
        match self {
            Design::Sparse(matrix) => {
                let values = matrix.values();
                is_column(matrix) && values.windows(2).all(|pair| pair[0] == pair[1])
            }
            _ => false,
        }
    }

    /// The largest size that `B theta` has at any of the nodes.
    pub fn largest(&self, theta: &[f64], nodes: usize) -> f64 {
        match self {
            Design::Empty => 0.0,
            Design::Identity => largest(theta),
            // Rounding keeps the order of sizes.
            Design::Sparse(matrix) if is_column(matrix) => {
                (largest(matrix.values()) * theta[0]).abs()
            }
            Design::Sparse(matrix) => {
                // Some side by side: one maximum would wait for itself.
                let mut most = [0.0f64; 4];
                each_row(matrix, theta, nodes, |i, product| {
                    most[i % 4] = most[i % 4].max(product.abs());
                });
                largest(&most)
            }
        }
    }

    /// `B theta`.
    pub fn multiply(&self, theta: &[f64], nodes: usize) -> Vec<f64> {
        let mut values = vec![0.0; nodes];
        self.multiply_add(theta, &mut values);
        values
    }

    /// `out += B^T nodal`.
    pub fn transpose_multiply_add(&self, nodal: &[f64], out: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => out.iter_mut().zip(nodal).for_each(|(o, n)| *o += n),
            Design::Sparse(matrix) if is_column(matrix) => {
                let pairs = matrix.values().iter().zip(nodal);
                out[0] = pairs.fold(out[0], |sum, (b, value)| sum + b * value);
            }
            Design::Sparse(matrix) => {
                for (row, value) in matrix.row_iter().zip(nodal) {
                    for (&j, b) in row.col_indices().iter().zip(row.values()) {
                        out[j] += b * value;
                    }
                }
            }
        }
    }

    /// One parameter that is the value at all nodes.
    pub fn ones(nodes: usize) -> Self {
        let (offsets, columns) = ((0..=nodes).collect(), vec![0; nodes]);
        let matrix = CsrMatrix::try_from_csr_data(nodes, 1, offsets, columns, vec![1.0; nodes]);
        Design::Sparse(matrix.expect("one entry a row"))
    }
}

/// Gives `act` the number of each of the first `count` rows and its product with `theta`.
#[inline(always)]
fn each_row(matrix: &CsrMatrix<f64>, theta: &[f64], count: usize, mut act: impl FnMut(usize, f64)) {
    let (offsets, columns, entries) = matrix.csr_data();
    for (i, ends) in offsets.windows(2).take(count).enumerate() {
        let range = ends[0]..ends[1];
        let product = match (&columns[range.clone()], &entries[range]) {
            // As on knots: no loop.
            (&[j, k], &[b, c]) => b * theta[j] + c * theta[k],
            (columns, entries) => {
                let pairs = columns.iter().zip(entries);
                pairs.map(|(&j, b)| b * theta[j]).sum()
            }
        };
        act(i, product);
    }
}

/// Whether a matrix has one column, without gaps: its values are all there is to it.
fn is_column(matrix: &CsrMatrix<f64>) -> bool {
    matrix.ncols() == 1 && matrix.nnz() == matrix.nrows()
}
