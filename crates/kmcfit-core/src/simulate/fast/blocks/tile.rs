//! Tiles: parts of a record divided into sixteen blocks, two in each SIMD lane.

use crate::simd::{self, Arithmetic, LANES, Row};

/// Largest number of steps per lane; the data of a tile then fit in the second-level cache.
pub(super) const LONGEST: usize = 512;

/// Eight lanes of `length` steps each, consecutive from node `first`: lane `b` holds the nodes from `first + b length` on.
/// Both halves of a lane are blocks, independent chains of operations.
#[derive(Clone, Copy)]
pub(super) struct Tile {
    pub first: usize,
    /// Steps per lane, even.
    pub length: usize,
}

impl Tile {
    /// Tiles of a record, in order, and the first node of the remaining steps.
    pub fn cut(
        steps: usize,
    ) -> (
        impl DoubleEndedIterator<Item = Tile> + ExactSizeIterator,
        usize,
    ) {
        let full = steps / (LANES * LONGEST);
        let after = full * LANES * LONGEST;
        let length = (steps - after) / (2 * LANES) * 2;
        let count = full + usize::from(length > 0);
        let tiles = (0..count).map(move |i| Tile {
            first: i * LANES * LONGEST,
            length: if i < full { LONGEST } else { length },
        });
        (tiles, after + LANES * length)
    }

    /// Node `j` of lane `b`.
    pub fn node(self, b: usize, j: usize) -> usize {
        self.first + b * self.length + j
    }

    /// Copies `values` of the nodes `0..length` of every lane to rows.
    #[inline(always)]
    pub fn gather<A: Arithmetic>(self, arithmetic: A, values: &[f64], rows: &mut [Row]) {
        let values = &values[self.first..self.first + LANES * self.length];
        let (squares, rest) = rows[..self.length].as_chunks_mut::<LANES>();
        for (q, square) in squares.iter_mut().enumerate() {
            let mut lanes = [[0.0; LANES]; LANES];
            for (b, lane) in lanes.iter_mut().enumerate() {
                let from = b * self.length + q * LANES;
                lane.copy_from_slice(&values[from..from + LANES]);
            }
            *square = simd::transposed(arithmetic, &lanes);
        }
        let done = self.length - rest.len();
        for (j, row) in rest.iter_mut().enumerate() {
            *row = std::array::from_fn(|b| values[b * self.length + done + j]);
        }
    }

    /// [`Tile::gather`] for the nodes `0..=length`; the last of each lane is the first of the next.
    #[inline(always)]
    pub fn gather_with_end<A: Arithmetic>(self, arithmetic: A, values: &[f64], rows: &mut [Row]) {
        self.gather(arithmetic, values, rows);
        rows[self.length] = std::array::from_fn(|b| values[self.node(b, self.length)]);
    }

    /// Copies rows of the nodes `0..length` of every lane back to `values`.
    #[inline(always)]
    pub fn scatter<A: Arithmetic>(self, arithmetic: A, rows: &[Row], values: &mut [f64]) {
        let values = &mut values[self.first..self.first + LANES * self.length];
        let (squares, rest) = rows[..self.length].as_chunks::<LANES>();
        for (q, square) in squares.iter().enumerate() {
            for (b, row) in simd::transposed(arithmetic, square).iter().enumerate() {
                let from = b * self.length + q * LANES;
                values[from..from + LANES].copy_from_slice(row);
            }
        }
        let done = self.length - rest.len();
        for (j, row) in rest.iter().enumerate() {
            for (b, x) in row.iter().enumerate() {
                values[b * self.length + done + j] = *x;
            }
        }
    }
}
