//! Symmetric banded matrices and their factors `L D L^T`.

use crate::simd::Real;

/// A symmetric matrix whose entries `(i, j)` vanish for `|i - j| > bandwidth`, or its factor: `L` below the diagonal, `D` on it.
#[derive(Debug, Clone)]
pub(crate) struct Banded<T> {
    size: usize,
    bandwidth: usize,
    /// Row by row the entries `(i, i - bandwidth)` to `(i, i)`.
    entries: Vec<T>,
}

impl<T: Real> Banded<T> {
    pub fn zeros(size: usize, bandwidth: usize, zero: T) -> Self {
        Self {
            size,
            bandwidth,
            entries: vec![zero; size * (bandwidth + 1)],
        }
    }

    /// VariableRole of the entry `(i, j)`, `j <= i <= j + bandwidth`, among the entries of matrices with this bandwidth.
    pub fn position(bandwidth: usize, i: usize, j: usize) -> usize {
        i * (bandwidth + 1) + bandwidth - (i - j)
    }

    pub fn fill(&mut self, value: T) {
        self.entries.fill(value);
    }

    /// Adds `factor` times a pattern of places and values.
    #[inline]
    pub fn add(&mut self, pattern: &[(usize, f64)], factor: T) {
        for (position, value) in pattern {
            self.entries[*position] = self.entries[*position] + factor.scale(*value);
        }
    }

    /// The entries `(i, first)` to `(i, i)` of row `i`, and `first`.
    fn row(&self, i: usize) -> (&[T], usize) {
        let first = i.saturating_sub(self.bandwidth);
        let end = (i + 1) * (self.bandwidth + 1);
        (&self.entries[end - (i + 1 - first)..end], first)
    }

    /// Replaces the matrix by its factor; pivots are the entries of `D` and may have any sign.
    pub fn factorise(&mut self) {
        let width = self.bandwidth + 1;
        for i in 0..self.size {
            let (before, rest) = self.entries.split_at_mut(i * width);
            let first = i.saturating_sub(self.bandwidth);
            let row = &mut rest[self.bandwidth - (i - first)..width];
            // Row i of L D, then of L.
            for j in first..i {
                let other = &before[j * width..(j + 1) * width];
                let from = first.max(j.saturating_sub(self.bandwidth));
                let other = &other[self.bandwidth - (j - from)..self.bandwidth];
                let products = row[from - first..j - first].iter().zip(other);
                row[j - first] = products.fold(row[j - first], |sum, (a, b)| sum - *a * *b);
            }
            for j in first..i {
                let of_product = row[j - first];
                let factor = of_product / before[j * width + self.bandwidth];
                row[i - first] = row[i - first] - of_product * factor;
                row[j - first] = factor;
            }
        }
    }

    /// The diagonal: of a factor its pivots.
    pub fn diagonal(&self) -> impl Iterator<Item = T> + '_ {
        (0..self.size).map(|i| self.entries[i * (self.bandwidth + 1) + self.bandwidth])
    }

    /// Solves with the factor, in place.
    pub fn solve(&self, x: &mut [T]) {
        for i in 0..self.size {
            let (row, first) = self.row(i);
            let products = row[..i - first].iter().zip(&x[first..i]);
            x[i] = products.fold(x[i], |sum, (a, b)| sum - *a * *b);
        }
        for (x, pivot) in x.iter_mut().zip(self.diagonal()) {
            *x = *x / pivot;
        }
        for i in (0..self.size).rev() {
            let (row, first) = self.row(i);
            let value = x[i];
            for (a, x) in row[..i - first].iter().zip(&mut x[first..i]) {
                *x = *x - *a * value;
            }
        }
    }
}
