//! A block of rows of a tall matrix.

use super::{Aligned, BlockColumn, HIGH, LANES};

/// Largest number of rows of a block.
pub(crate) const BLOCK_ROWS: usize = HIGH * LANES;

/// Up to [`BLOCK_ROWS`] rows, column by column; entries below the last row are undefined.
#[derive(Default)]
pub(crate) struct RowBlock {
    /// Index of the first row in the matrix.
    pub first: usize,
    /// Number of rows.
    pub count: usize,
    /// Number of columns with nonzero entries so far; later columns are undefined and count as zero.
    begun: usize,
    /// The columns, and a spare one.
    pub(super) columns: Vec<BlockColumn>,
}

impl RowBlock {
    /// An empty block with `positions` columns of zeros.
    pub fn new(positions: usize) -> Self {
        Self {
            first: 0,
            count: 0,
            begun: positions,
            columns: vec![Aligned([[0.0; LANES]; HIGH]); positions + 1],
        }
    }

    /// Removes all rows and sets all entries to zero.
    pub fn clear(&mut self) {
        (self.count, self.begun) = (0, self.positions());
        self.columns.fill(Aligned([[0.0; LANES]; HIGH]));
    }

    /// Removes all rows and columns; the next row is row `first` of the matrix.
    pub fn restart(&mut self, first: usize) {
        (self.first, self.count, self.begun) = (first, 0, 0);
    }

    /// Extends the block to `begun` columns; new ones are zero so far.
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

    /// Number of columns in use.
    pub fn begun(&self) -> usize {
        self.begun
    }

    /// Number of free rows.
    pub fn room(&self) -> usize {
        BLOCK_ROWS - self.count.min(BLOCK_ROWS)
    }

    /// True without free rows.
    pub fn is_full(&self) -> bool {
        self.room() == 0
    }

    /// Number of columns.
    pub fn positions(&self) -> usize {
        self.columns.len().saturating_sub(1)
    }

    /// Rows of a column.
    pub fn column(&self, position: usize) -> &[f64] {
        &self.columns[position].as_flattened()[..self.count]
    }

    /// A column, with space for [`BLOCK_ROWS`] rows.
    #[inline(always)]
    pub fn column_mut(&mut self, position: usize) -> &mut [f64; BLOCK_ROWS] {
        let flat = self.columns[position].as_flattened_mut();
        flat.first_chunk_mut().expect("so many rows")
    }
}
