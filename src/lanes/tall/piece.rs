//! Some rows of a tall matrix.

use super::{Column, HIGH, LANES};

/// Most rows of a piece.
pub(crate) const PIECE: usize = HIGH * LANES;

/// Up to [`PIECE`] rows, column by column; what is below them means nothing.
#[derive(Default)]
pub(crate) struct Piece {
    /// Which row of the matrix the first one is.
    pub first: usize,
    /// Number of rows.
    pub count: usize,
    /// A column at each place, and one to spare.
    pub(super) columns: Vec<Column>,
}

impl Piece {
    /// One without rows, for so many places.
    pub fn new(places: usize) -> Self {
        Self {
            first: 0,
            count: 0,
            columns: vec![[[0.0; LANES]; HIGH]; places + 1],
        }
    }

    /// No rows, and zeros everywhere.
    pub fn clear(&mut self) {
        self.count = 0;
        self.columns.fill([[0.0; LANES]; HIGH]);
    }

    /// How many rows there is room for.
    pub fn room(&self) -> usize {
        PIECE - self.count.min(PIECE)
    }

    /// Whether there is none.
    pub fn is_full(&self) -> bool {
        self.room() == 0
    }

    /// Number of places.
    pub fn places(&self) -> usize {
        self.columns.len().saturating_sub(1)
    }

    /// The rows of a column.
    pub fn column(&self, place: usize) -> &[f64] {
        &self.columns[place].as_flattened()[..self.count]
    }

    /// The column at a place, with room for [`PIECE`] rows.
    #[inline(always)]
    pub fn column_mut(&mut self, place: usize) -> &mut [f64; PIECE] {
        let flat = self.columns[place].as_flattened_mut();
        flat.first_chunk_mut().expect("so many rows")
    }
}
