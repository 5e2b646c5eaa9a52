//! QR factorisation of tall matrices, block of rows by block of rows.

mod row_block;
mod triangle;

use super::{Aligned, LANES, Row};
pub(crate) use row_block::{BLOCK_ROWS, RowBlock};
pub(crate) use triangle::Triangle;

/// Rows of a block in units of SIMD rows; with 34 columns a block fills the first-level cache.
const HIGH: usize = 12;

/// A column of a block of rows.
type BlockColumn = Aligned<[Row; HIGH]>;
