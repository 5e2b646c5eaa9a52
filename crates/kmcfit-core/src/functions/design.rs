//! Design matrices: from parameters to values at the nodes.

use crate::rows::Rows;
use crate::simd::sum::largest;

/// A matrix `B` of shape `nodes x parameters`.
#[derive(Debug, Clone)]
pub enum Design {
    /// No parameters.
    Empty,
    /// One parameter per node.
    Identity,
    /// Anything else, by rows.
    Sparse(Rows),
}

impl Design {
    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let unit = matches!(self, Design::Identity).then_some((i, 1.0));
        let entries = match self {
            Design::Sparse(rows) => Some(rows.row(i)),
            Design::Empty | Design::Identity => None,
        };
        unit.into_iter().chain(entries.into_iter().flatten())
    }

    /// Whether it is one column with the same entry at every node.
    pub fn is_constant(&self) -> bool {
        matches!(self, Design::Sparse(rows) if rows.is_constant())
    }

    /// The largest size that `B theta` has at any of the nodes.
    pub fn largest(&self, theta: &[f64]) -> f64 {
        match self {
            Design::Empty => 0.0,
            Design::Identity => largest(theta),
            Design::Sparse(rows) => rows.largest(theta),
        }
    }

    /// `B theta`.
    pub fn multiply(&self, theta: &[f64], nodes: usize) -> Vec<f64> {
        let mut values = vec![0.0; nodes];
        self.multiply_add(theta, &mut values);
        values
    }

    /// `values += B theta`.
    pub fn multiply_add(&self, theta: &[f64], values: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => values.iter_mut().zip(theta).for_each(|(v, t)| *v += t),
            Design::Sparse(rows) => rows.multiply_add(theta, values),
        }
    }

    /// `out += B^T nodal`.
    pub fn transpose_multiply_add(&self, nodal: &[f64], out: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => out.iter_mut().zip(nodal).for_each(|(o, n)| *o += n),
            Design::Sparse(rows) => rows.transpose_multiply_add(nodal, out),
        }
    }

    /// One parameter that is the value at all nodes.
    pub fn ones(nodes: usize) -> Self {
        let mut rows = Rows::of_width(1);
        (0..nodes).for_each(|_| rows.push([(0, 1.0)], 0.0));
        Design::Sparse(rows)
    }
}
