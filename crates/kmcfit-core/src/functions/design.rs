//! Design matrices: linear maps from parameters to nodal values.

use super::LocalRows;
use crate::simd::sum::largest;
use std::sync::Arc;

/// A matrix `B` of shape `nodes x parameters`.
#[derive(Debug, Clone)]
pub enum Design {
    /// No parameters.
    Empty,
    /// One parameter per node.
    Identity,
    /// One parameter, the value at all nodes.
    Constant {
        /// Number of nodes.
        nodes: usize,
    },
    /// Sparse matrix, by rows; shared by copies.
    Sparse(Arc<LocalRows>),
}

impl Design {
    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let unit = match self {
            Design::Identity => Some((i, 1.0)),
            Design::Constant { .. } => Some((0, 1.0)),
            Design::Empty | Design::Sparse(_) => None,
        };
        let entries = match self {
            Design::Sparse(rows) => Some(rows.row(i)),
            Design::Empty | Design::Identity | Design::Constant { .. } => None,
        };
        unit.into_iter().chain(entries.into_iter().flatten())
    }

    /// True for a single column with equal entries at all nodes.
    pub fn is_constant(&self) -> bool {
        match self {
            Design::Constant { .. } => true,
            Design::Sparse(rows) => rows.is_constant(),
            Design::Empty | Design::Identity => false,
        }
    }

    /// Largest absolute value of `B theta` over the nodes.
    pub fn largest(&self, theta: &[f64]) -> f64 {
        match self {
            Design::Empty => 0.0,
            Design::Identity | Design::Constant { .. } => largest(theta),
            Design::Sparse(rows) => rows.largest(theta),
        }
    }

    /// Product `B theta`.
    pub fn multiply(&self, theta: &[f64], nodes: usize) -> Vec<f64> {
        let mut values = vec![0.0; nodes];
        self.multiply_add(theta, &mut values);
        values
    }

    /// Element `i` of `B theta`.
    pub(crate) fn product_at(&self, theta: &[f64], i: usize) -> f64 {
        self.row(i).map(|(j, b)| b * theta[j]).sum()
    }

    /// Adds `B theta` to `values`.
    pub fn multiply_add(&self, theta: &[f64], values: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => values.iter_mut().zip(theta).for_each(|(v, t)| *v += t),
            Design::Constant { .. } => values.iter_mut().for_each(|v| *v += theta[0]),
            Design::Sparse(rows) => rows.multiply_add(theta, values),
        }
    }

    /// Adds `B^T nodal` to `out`.
    pub fn transpose_multiply_add(&self, nodal: &[f64], out: &mut [f64]) {
        match self {
            Design::Empty => {}
            Design::Identity => out.iter_mut().zip(nodal).for_each(|(o, n)| *o += n),
            Design::Constant { .. } => out[0] = nodal.iter().fold(out[0], |sum, n| sum + n),
            Design::Sparse(rows) => rows.transpose_multiply_add(nodal, out),
        }
    }
}
