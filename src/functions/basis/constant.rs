//! One value for all times.

use crate::functions::Design;
use nalgebra_sparse::{CooMatrix, CsrMatrix};

/// Design matrix of shape `nodes x 1`, all ones.
pub fn constant(nodes: usize) -> Design {
    let mut entries = CooMatrix::new(nodes, 1);
    for i in 0..nodes {
        entries.push(i, 0, 1.0);
    }
    Design::Sparse(CsrMatrix::from(&entries))
}
