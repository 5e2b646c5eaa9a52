//! Sparse rows with right-hand sides, appended one by one: design matrices, penalties, constraints, subproblems.

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
    /// Empty rows.
    pub fn new() -> Self {
        Self::of_width(0)
    }

    /// Empty rows with at least `width` columns.
    pub fn of_width(width: usize) -> Self {
        Self {
            width,
            starts: vec![0],
            ..Self::default()
        }
    }

    /// Appends a row with these entries (repeated columns are added) and right-hand side.
    pub fn push(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, right: f64) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let first = self.columns.len();
        // Entries usually come with rising columns; only others are searched.
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

    /// Reserves capacity for further rows and entries.
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

    /// Number of columns: as stated, or one more than the largest column of an entry.
    pub fn width(&self) -> usize {
        self.width
    }

    /// True without rows.
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

    /// Products `a_i^T z` of all rows.
    pub fn multiply(&self, z: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.len()];
        self.multiply_add(z, &mut values);
        values
    }

    /// Adds `a_i^T z` to the values, which may be fewer than the rows.
    pub fn multiply_add(&self, z: &[f64], values: &mut [f64]) {
        self.each_product(z, values.len(), |i, product| values[i] += product);
    }

    /// Adds `sum_i y_i a_i` to `out`.
    pub fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        for (i, y) in (0..self.len()).zip(y) {
            self.row(i).for_each(|(j, a)| out[j] += a * y);
        }
    }

    /// Largest `|a_i^T z|`.
    pub fn largest(&self, z: &[f64]) -> f64 {
        // Several maxima, because a single one is a chain of dependent operations.
        let mut most = [0.0f64; 4];
        self.each_product(z, self.len(), |i, product| {
            most[i % 4] = most[i % 4].max(product.abs());
        });
        largest(&most)
    }

    /// Calls `act` with the index and the product with `z` of each of the first `count` rows.
    #[inline(always)]
    fn each_product(&self, z: &[f64], count: usize, mut act: impl FnMut(usize, f64)) {
        for (i, ends) in self.starts.windows(2).take(count).enumerate() {
            let range = ends[0]..ends[1];
            let product = match (&self.columns[range.clone()], &self.values[range]) {
                // Two entries, as on knots: no loop.
                (&[j, k], &[a, b]) => a * z[j] + b * z[k],
                (columns, values) => {
                    let pairs = columns.iter().zip(values);
                    pairs.map(|(&j, a)| a * z[j]).sum()
                }
            };
            act(i, product);
        }
    }

    /// Dense matrix of the rows.
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

    /// Largest absolute entry of row `i`; 0 for an empty row.
    pub fn scale(&self, i: usize) -> f64 {
        self.row(i).fold(0.0, |most, (_, a)| most.max(a.abs()))
    }
}

/// Appends values, the first ones without a copy.
pub(crate) fn append(all: &mut Vec<f64>, values: Vec<f64>) {
    match all.is_empty() {
        true => *all = values,
        false => all.extend(values),
    }
}

/// Sorts the entries of a row by column and adds those of equal columns, in their order.
pub(crate) fn merge_columns(entries: &mut Vec<(usize, f64)>) {
    entries.sort_by_key(|(column, _)| *column);
    entries.dedup_by(|later, first| {
        let is_same = later.0 == first.0;
        if is_same {
            first.1 += later.1;
        }
        is_same
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows with three columns.
    fn rows() -> Rows {
        let mut rows = Rows::new();
        rows.push([(0, 1.0), (2, -2.0)], 5.0);
        rows.push([(1, 4.0)], 6.0);
        rows
    }

    #[test]
    fn equal_columns_are_added() {
        let mut entries = vec![(3, 1.0), (0, 2.0), (3, -4.0), (1, 0.0)];
        merge_columns(&mut entries);
        assert_eq!(entries, [(0, 2.0), (1, 0.0), (3, -3.0)]);
    }

    #[test]
    fn products_by_hand() {
        assert_eq!(rows().multiply(&[1.0, 10.0, 100.0]), [-199.0, 40.0]);
    }

    /// Rows with scaled columns have the products of the original rows with `factors * z`.
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
