//! Some rows of a tall matrix.

use super::{Aligned, BlockColumn, HIGH, LANES};

/// Most rows of a piece.
pub(crate) const PIECE: usize = HIGH * LANES;

/// Up to [`PIECE`] rows, column by column; what is below them means nothing.
#[derive(Default)]
pub(crate) struct RowBlock {
    /// Which row of the matrix the first one is.
    pub first: usize,
    /// Number of rows.
    pub count: usize,
    /// Columns that have begun: what stands behind them means nothing, and stands for zeros.
    begun: usize,
    /// A column at each place, and one to spare.
    pub(super) columns: Vec<BlockColumn>,
}

impl RowBlock {
    /// One without rows, for so many places, that have all begun with zeros.
    pub fn new(places: usize) -> Self {
        Self {
            first: 0,
            count: 0,
            begun: places,
            columns: vec![Aligned([[0.0; LANES]; HIGH]); places + 1],
        }
    }

    /// No rows, and zeros everywhere.
    pub fn clear(&mut self) {
        (self.count, self.begun) = (0, self.places());
        self.columns.fill(Aligned([[0.0; LANES]; HIGH]));
    }

    /// No rows, and no column has begun; the first row will be row `first` of the matrix.
    pub fn restart(&mut self, first: usize) {
        (self.first, self.count, self.begun) = (first, 0, 0);
    }

    /// So many columns have begun: those that had not are zero so far.
    pub fn widen(&mut self, begun: usize) {
        for column in self
            .columns
            .get_mut(self.begun..begun)
            .into_iter()
            .flatten()
        {
            column.as_flattened_mut()[..self.count].fill(0.0);
        }
        self.begun = self.begun.max(begun);
    }

    /// How many columns have begun.
    pub fn begun(&self) -> usize {
        self.begun
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
