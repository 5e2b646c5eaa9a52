//! Design matrices: from parameters to values at the nodes.

use nalgebra_sparse::{CooMatrix, CsrMatrix};

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
                for (row, value) in matrix.row_iter().zip(values) {
                    let columns = row.col_indices().iter().zip(row.values());
                    *value += columns.map(|(&j, b)| b * theta[j]).sum::<f64>();
                }
            }
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
            Design::Sparse(_) => largest(&self.multiply(theta, nodes)),
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
        let mut entries = CooMatrix::new(nodes, 1);
        (0..nodes).for_each(|i| entries.push(i, 0, 1.0));
        Design::Sparse(CsrMatrix::from(&entries))
    }
}

/// The largest size of any of the values.
pub(crate) fn largest(f: &[f64]) -> f64 {
    // Four at a time: one maximum would wait for itself.
    let (fours, rest) = f.as_chunks::<4>();
    let mut most = [0.0f64; 4];
    for four in fours {
        for (most, p) in most.iter_mut().zip(four) {
            *most = most.max(p.abs());
        }
    }
    let rest = rest.iter().map(|p| p.abs());
    rest.chain(most).fold(0.0, f64::max)
}

/// Whether a matrix has one column, without gaps: its values are all there is to it.
fn is_column(matrix: &CsrMatrix<f64>) -> bool {
    matrix.ncols() == 1 && matrix.nnz() == matrix.nrows()
}
