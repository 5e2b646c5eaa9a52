//! Sparse rows with a right-hand side, built one after the other: design matrices, penalties, constraints, subproblems.

use crate::simd::sum::largest;
use nalgebra::DMatrix;

/// Rows `a_i^T z` with right-hand sides `b_i`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    width: usize,
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Rows {
    /// No rows.
    pub fn new() -> Self {
        Self::of_width(0)
    }

    /// No rows yet, of at least so many columns.
    pub fn of_width(width: usize) -> Self {
        Self {
            width,
            starts: vec![0],
            ..Self::default()
        }
    }

    /// Adds the row with these entries (columns may repeat; they add up) and right-hand side.
    pub fn push(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, right: f64) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let first = self.columns.len();
        // Rows usually come with rising columns; only others have to be searched.
        let mut highest = None;
        for (column, value) in entries {
            self.width = self.width.max(column + 1);
            let known = if highest.is_none_or(|h| column > h) {
                highest = Some(column);
                None
            } else {
                self.columns[first..].iter().position(|c| *c == column)
            };
            match known {
                Some(k) => self.values[first + k] += value,
                None => {
                    self.columns.push(column);
                    self.values.push(value);
                }
            }
        }
        self.starts.push(self.columns.len());
        self.right.push(right);
    }

    /// Makes room for so many further rows and entries.
    pub fn reserve(&mut self, rows: usize, entries: usize) {
        self.starts.reserve(rows + 1);
        self.right.reserve(rows);
        self.columns.reserve(entries);
        self.values.reserve(entries);
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.right.len()
    }

    /// Number of columns: as many as were stated, or one more than the largest column of an entry.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.right.is_empty()
    }

    /// Entries of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let columns = self.columns[range.clone()].iter().copied();
        columns.zip(self.values[range].iter().copied())
    }

    /// Right-hand sides.
    pub fn right(&self) -> &[f64] {
        &self.right
    }

    /// Sets all right-hand sides to zero.
    pub fn clear_right(&mut self) {
        self.right.fill(0.0);
    }

    /// Sets all right-hand sides.
    ///
    /// # Panics
    /// If there is not one for each row.
    pub fn set_right(&mut self, right: Vec<f64>) {
        assert_eq!(right.len(), self.len(), "one right-hand side per row");
        self.right = right;
    }

    /// `a_i^T z` for all rows.
    pub fn multiply(&self, z: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.len()];
        self.multiply_add(z, &mut values);
        values
    }

    /// Adds `a_i^T z` to the values, of which there may be fewer than rows.
    pub fn multiply_add(&self, z: &[f64], values: &mut [f64]) {
        if self.is_column() {
            let pairs = values.iter_mut().zip(&self.values);
            pairs.for_each(|(value, a)| *value += a * z[0]);
            return;
        }
        self.each_product(z, values.len(), |i, product| values[i] += product);
    }

    /// Adds `sum_i y_i a_i` to `out`.
    pub fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        if self.is_column() {
            let pairs = self.values.iter().zip(y);
            out[0] = pairs.fold(out[0], |sum, (a, y)| sum + a * y);
            return;
        }
        for (i, y) in (0..self.len()).zip(y) {
            self.row(i).for_each(|(j, a)| out[j] += a * y);
        }
    }

    /// Largest size of `a_i^T z`.
    pub fn largest(&self, z: &[f64]) -> f64 {
        if self.is_column() {
            // Rounding keeps the order of sizes.
            return (largest(&self.values) * z[0]).abs();
        }
        // Some side by side: one maximum would wait for itself.
        let mut most = [0.0f64; 4];
        self.each_product(z, self.len(), |i, product| {
            most[i % 4] = most[i % 4].max(product.abs());
        });
        largest(&most)
    }

    /// Whether there is one column, with the same entry in every row.
    pub fn is_constant(&self) -> bool {
        self.is_column() && self.values.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Whether there is one column, without gaps: its values are all there is to it.
    fn is_column(&self) -> bool {
        self.width == 1 && !self.is_empty() && self.entries() == self.len()
    }

    /// Gives `act` the number of each of the first `count` rows and its product with `z`.
    #[inline(always)]
    fn each_product(&self, z: &[f64], count: usize, mut act: impl FnMut(usize, f64)) {
        for (i, ends) in self.starts.windows(2).take(count).enumerate() {
            let range = ends[0]..ends[1];
            let product = match (&self.columns[range.clone()], &self.values[range]) {
                // As on knots: no loop.
                (&[j, k], &[a, b]) => a * z[j] + b * z[k],
                (columns, values) => {
                    let pairs = columns.iter().zip(values);
                    pairs.map(|(&j, a)| a * z[j]).sum()
                }
            };
            act(i, product);
        }
    }

    /// Starts of the rows and one past the last, columns and values.
    pub(crate) fn compressed(&self) -> (&[usize], &[usize], &[f64]) {
        (&self.starts, &self.columns, &self.values)
    }

    /// The rows as a matrix.
    pub fn dense(&self) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.len(), self.width);
        for i in 0..self.len() {
            self.row(i).for_each(|(j, a)| out[(i, j)] += a);
        }
        out
    }

    /// Multiplies every column by its factor.
    pub fn scale_columns(&mut self, factors: &[f64]) {
        for (column, value) in self.columns.iter().zip(&mut self.values) {
            *value *= factors[*column];
        }
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Largest size of an entry of row `i`; 0 for an empty row.
    pub fn scale(&self, i: usize) -> f64 {
        self.row(i).fold(0.0, |most, (_, a)| most.max(a.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows over three columns, by hand.
    fn rows() -> Rows {
        let mut rows = Rows::new();
        rows.push([(0, 1.0), (2, -2.0)], 5.0);
        rows.push([(1, 4.0)], 6.0);
        rows
    }

    #[test]
    fn products_by_hand() {
        assert_eq!(rows().multiply(&[1.0, 10.0, 100.0]), [-199.0, 40.0]);
    }

    /// What is scaled in its columns says of `z` what the rows said of `factors * z`.
    #[test]
    fn scaled_columns() {
        let mut scaled = rows();
        scaled.scale_columns(&[2.0, 0.5, -3.0]);
        let z = [1.5, -2.0, 0.25];
        assert_eq!(
            scaled.multiply(&z),
            rows().multiply(&[3.0, -1.0, -0.75]),
            "{z:?}"
        );
        assert_eq!(scaled.right(), rows().right());
        assert_eq!(scaled.scale(0), 6.0);
    }
}
