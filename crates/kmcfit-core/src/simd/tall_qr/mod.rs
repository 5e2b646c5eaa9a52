//! QR factorisation of tall matrices, block of rows by block of rows.

mod row_block;
mod triangle;

use super::{Aligned, LANES, Row};
pub(crate) use row_block::{BLOCK_ROWS, RowBlock};
pub(crate) use triangle::Triangle;

/// Rows of a block in units of SIMD rows; with 34 columns a block fills the first-level cache.
const HIGH: usize = 12;

/// Indices in ascending order of their keys, those of equal keys in their order: columns by the row in which they begin.
pub(crate) fn order_by(keys: &[usize]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by_key(|i| keys[*i]);
    order
}

/// A column of a block of rows.
type BlockColumn = Aligned<[Row; HIGH]>;
