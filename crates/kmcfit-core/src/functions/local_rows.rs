//! Rows of neighbouring columns: design matrices of bases on a grid.

use crate::simd::sum::largest;
use nalgebra::DMatrix;

/// A matrix whose nonzero entries of a row lie within `span` neighbouring columns. A row takes `4 + 8 span` bytes, or
/// four while all rows have a single entry of one.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalRows {
    width: usize,
    span: usize,
    /// First column of each row.
    first: Vec<u32>,
    /// `span` entries of each row, zeros included; empty while each row has the single entry one.
    values: Vec<f64>,
}

impl LocalRows {
    /// No rows yet, `width` columns, and at most `span` neighbouring ones in a row.
    ///
    /// # Panics
    /// Unless `1 <= span <= width`, and columns are 32-bit numbers.
    pub fn new(width: usize, span: usize) -> Self {
        assert!((1..=width).contains(&span), "a span within the columns");
        assert!(u32::try_from(width).is_ok(), "columns as 32-bit numbers");
        Self {
            width,
            span,
            first: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Reserves capacity for further rows.
    pub fn reserve(&mut self, rows: usize) {
        self.first.reserve_exact(rows);
        if self.span > 1 {
            self.values.reserve_exact(rows * self.span);
        }
    }

    /// Appends a row; entries of one column are added.
    ///
    /// # Panics
    /// If nonzero entries lie outside the span or the columns.
    pub fn push(&mut self, entries: impl Iterator<Item = (usize, f64)> + Clone) {
        let entries = entries.filter(|(_, value)| *value != 0.0);
        let lowest = entries.clone().map(|(column, _)| column).min();
        let first = lowest.unwrap_or(0).min(self.width - self.span);
        let begin = self.len() * self.span;
        self.first.push(first as u32);
        if self.span == 1 && self.values.is_empty() && entries.clone().eq([(first, 1.0)]) {
            return;
        }
        // Ones that were omitted so far.
        self.values.resize(begin, 1.0);
        self.values.resize(begin + self.span, 0.0);
        for (column, value) in entries {
            self.values[begin..][..self.span][column - first] += value;
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Nonzero entries of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (first, values) = self.stored(i);
        let entries = (first..).zip(values.iter().copied());
        entries.filter(|(_, value)| *value != 0.0)
    }

    /// First column and stored entries of row `i`.
    #[inline(always)]
    fn stored(&self, i: usize) -> (usize, &[f64]) {
        let values = match self.values.is_empty() {
            true => &[1.0],
            false => &self.values[i * self.span..][..self.span],
        };
        (self.first[i] as usize, values)
    }

    /// First column and entries of row `i`, from the first to the last nonzero one.
    pub(super) fn nonzero(&self, i: usize) -> (usize, &[f64]) {
        let (first, values) = self.stored(i);
        let is_nonzero = |value: &f64| *value != 0.0;
        let from = values.iter().position(is_nonzero).unwrap_or(0);
        let end = values
            .iter()
            .rposition(is_nonzero)
            .map_or(0, |last| last + 1);
        (first + from, &values[from..end])
    }

    /// Calls `act` with the index and the product with `z` of each of the first `count` rows.
    #[inline(always)]
    fn each_product(&self, z: &[f64], count: usize, mut act: impl FnMut(usize, f64)) {
        if self.values.is_empty() {
            let rows = self.first.iter().take(count).enumerate();
            return rows.for_each(|(i, first)| act(i, z[*first as usize]));
        }
        let rows = self.first.iter().zip(self.values.chunks_exact(self.span));
        for (i, (&first, values)) in rows.take(count).enumerate() {
            let first = first as usize;
            let product = match values {
                // Two entries, as on knots: no loop.
                &[a, b] => a * z[first] + b * z[first + 1],
                values => {
                    let pairs = values.iter().zip(&z[first..]);
                    pairs.map(|(a, z)| a * z).sum()
                }
            };
            act(i, product);
        }
    }

    /// Adds the product of each row with `z` to the values, which may be fewer than the rows.
    pub fn multiply_add(&self, z: &[f64], values: &mut [f64]) {
        if self.width == 1 && !self.values.is_empty() {
            let pairs = values.iter_mut().zip(&self.values);
            pairs.for_each(|(value, a)| *value += a * z[0]);
            return;
        }
        self.each_product(z, values.len(), |i, product| values[i] += product);
    }

    /// Adds the sum of all rows, each multiplied by its value of `y`, to `out`.
    pub fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        if self.width == 1 && !self.values.is_empty() {
            let pairs = self.values.iter().zip(y);
            out[0] = pairs.fold(out[0], |sum, (a, y)| sum + a * y);
            return;
        }
        for (i, y) in (0..self.len()).zip(y) {
            let (first, values) = self.stored(i);
            let positions = out[first..].iter_mut().zip(values);
            positions.for_each(|(out, a)| *out += a * y);
        }
    }

    /// Largest absolute product of a row with `z`.
    pub fn largest(&self, z: &[f64]) -> f64 {
        if self.width == 1 && !self.values.is_empty() {
            // Rounding preserves the order of magnitudes.
            return (largest(&self.values) * z[0]).abs();
        }
        // Several maxima, because a single one is a chain of dependent operations.
        let mut most = [0.0f64; 4];
        self.each_product(z, self.len(), |i, product| {
            most[i % 4] = most[i % 4].max(product.abs());
        });
        largest(&most)
    }

    /// True for a single column with equal entries in all rows.
    pub fn is_constant(&self) -> bool {
        // Without values all are ones.
        self.width == 1 && self.values.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Dense matrix of the rows.
    pub fn dense(&self) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.len(), self.width);
        for i in 0..self.len() {
            self.row(i).for_each(|(j, a)| out[(i, j)] = a);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows `[0 2 -1 0]`, `[0 0 0 5]`, `[0 0 0 0]` and `[3 0 4 0]` with repeated entries.
    fn rows() -> LocalRows {
        let mut rows = LocalRows::new(4, 3);
        rows.push([(1, 2.0), (2, -1.5), (2, 0.5)].into_iter());
        rows.push([(3, 5.0)].into_iter());
        rows.push(std::iter::empty());
        rows.push([(2, 4.0), (0, 3.0)].into_iter());
        rows
    }

    #[test]
    fn products_are_those_of_the_dense_matrix() {
        let (rows, dense) = (rows(), rows().dense());
        assert_eq!(
            dense.row(0).iter().copied().collect::<Vec<_>>(),
            [0.0, 2.0, -1.0, 0.0]
        );
        assert_eq!(
            dense.row(3).iter().copied().collect::<Vec<_>>(),
            [3.0, 0.0, 4.0, 0.0]
        );
        let (z, y) = ([1.0, -2.0, 0.5, 3.0], [2.0, -1.0, 7.0, 0.25]);
        let mut values = [1.0; 4];
        rows.multiply_add(&z, &mut values);
        assert_eq!(values, [-3.5, 16.0, 1.0, 6.0]);
        let mut out = [0.0; 4];
        rows.transpose_multiply_add(&y, &mut out);
        assert_eq!(out, [0.75, 4.0, -1.0, -5.0]);
        assert_eq!(rows.largest(&z), 15.0);
        assert_eq!(rows.row(3).collect::<Vec<_>>(), [(0, 3.0), (2, 4.0)]);
        assert_eq!(rows.nonzero(1), (3, &[5.0][..]));
        assert_eq!(rows.nonzero(2).1.len(), 0);
    }

    #[test]
    fn one_column_of_equal_entries_is_constant() {
        let column = |entries: [f64; 2]| {
            let mut rows = LocalRows::new(1, 1);
            entries
                .iter()
                .for_each(|a| rows.push([(0, *a)].into_iter()));
            rows
        };
        assert!(column([2.0, 2.0]).is_constant());
        assert!(!column([2.0, 3.0]).is_constant());
        assert_eq!(column([2.0, -3.0]).largest(&[-2.0]), 6.0);
    }

    /// Rows `[1 0]`, `[0 1]`, `[0 1]`, of which the ones are omitted, and the same with `[0.5 0]` behind them.
    #[test]
    fn ones_are_products_as_well() {
        let mut rows = LocalRows::new(2, 1);
        rows.reserve(4);
        [0, 1, 1]
            .into_iter()
            .for_each(|j| rows.push([(j, 1.0)].into_iter()));
        assert!(rows.values.is_empty());
        let check = |rows: &LocalRows, expected: &[(usize, f64)]| {
            let each = (0..rows.len()).flat_map(|i| rows.row(i));
            assert!(each.eq(expected.iter().copied()));
            let (z, y) = ([2.0, -3.0], [1.0, 10.0, 100.0, 1000.0]);
            let products: Vec<f64> = expected.iter().map(|(j, a)| a * z[*j]).collect();
            let mut values = vec![0.5; rows.len()];
            rows.multiply_add(&z, &mut values);
            assert!(
                values
                    .iter()
                    .eq(products.iter().map(|p| 0.5 + p).collect::<Vec<_>>().iter())
            );
            let mut out = [0.0; 2];
            rows.transpose_multiply_add(&y, &mut out);
            let mut sums = [0.0; 2];
            (expected.iter().zip(y)).for_each(|((j, a), y)| sums[*j] += a * y);
            assert_eq!(out, sums);
            assert_eq!(rows.largest(&z), 3.0);
        };
        check(&rows, &[(0, 1.0), (1, 1.0), (1, 1.0)]);
        rows.push([(0, 0.5)].into_iter());
        check(&rows, &[(0, 1.0), (1, 1.0), (1, 1.0), (0, 0.5)]);
        let mut one = LocalRows::new(1, 1);
        (0..3).for_each(|_| one.push([(0, 1.0)].into_iter()));
        assert!(one.is_constant());
    }
}
