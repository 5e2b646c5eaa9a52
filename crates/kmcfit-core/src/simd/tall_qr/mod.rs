//! Tall matrices, reduced to triangles some rows at a time.

mod piece;
mod triangle;

use super::{Aligned, LANES, Row};
pub(crate) use piece::{PIECE, RowBlock};
pub(crate) use triangle::Triangle;

/// Rows of a piece, in lanes: with 34 columns they fill the processor's nearest memory.
const HIGH: usize = 12;

/// A column of a piece.
type BlockColumn = Aligned<[Row; HIGH]>;
