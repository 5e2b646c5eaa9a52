//! Dense rows of a front.

use crate::simd::{self, Arithmetic, Kernel};

/// Rows of equal length, one after the other in memory.
#[derive(Default)]
pub struct FrontalRows {
    length: usize,
    count: usize,
    values: Vec<f64>,
}

impl FrontalRows {
    /// Removes all rows and sets their length.
    pub fn clear(&mut self, length: usize) {
        self.length = length;
        self.truncate(0);
    }

    pub fn truncate(&mut self, count: usize) {
        self.count = count;
        self.values.truncate(count * self.length);
    }

    pub fn len(&self) -> usize {
        self.count
    }

    /// Adds a row of zeros.
    pub fn add(&mut self) -> &mut [f64] {
        let first = self.values.len();
        self.count += 1;
        self.values.resize(first + self.length, 0.0);
        &mut self.values[first..]
    }

    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.length..(i + 1) * self.length]
    }

    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.length..(i + 1) * self.length]
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        // chunks_exact_mut does not accept zero, the length before the first row.
        self.values.chunks_exact_mut(self.length.max(1))
    }

    /// All rows but the last, and the last; there must be one.
    pub fn split_last(&mut self) -> (impl Iterator<Item = &mut [f64]>, &[f64]) {
        let last = (self.count - 1) * self.length;
        let (rest, last) = self.values.split_at_mut(last);
        (rest.chunks_exact_mut(self.length), last)
    }

    pub fn swap(&mut self, i: usize, j: usize) {
        if i != j {
            let (low, high) = (i.min(j), i.max(j));
            let (head, tail) = self.values.split_at_mut(high * self.length);
            head[low * self.length..][..self.length].swap_with_slice(&mut tail[..self.length]);
        }
    }

    /// Reflects the rows `active`, so that only the first has an entry in `column`; none has an entry before it.
    pub fn reflect(&mut self, active: &[usize], column: usize, sums: &mut Vec<f64>) {
        simd::run(Reflect {
            rows: self,
            active,
            column,
            sums,
        });
    }
}

struct Reflect<'a> {
    rows: &'a mut FrontalRows,
    active: &'a [usize],
    column: usize,
    sums: &'a mut Vec<f64>,
}

impl Kernel for Reflect<'_> {
    type Output = ();

    /// Loops over the entries of a row, vectorised by the compiler without reordering sums.
    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) {
        let Self {
            rows,
            active,
            column,
            sums,
        } = self;
        let first = rows.row(active[0])[column];
        let squares = active.iter().map(|i| rows.row(*i)[column].powi(2));
        let norm = squares.sum::<f64>().sqrt();
        let diagonal = if first > 0.0 { -norm } else { norm };
        // I - v v' / (norm (norm + |first|)) with v the column less the diagonal in its first row.
        let weight = 1.0 / (norm * (norm + first.abs()));
        rows.row_mut(active[0])[column] = first - diagonal;
        sums.clear();
        sums.resize(rows.length - column - 1, 0.0);
        for &i in active {
            let (head, tail) = rows.row(i)[column..].split_at(1);
            let factor = weight * head[0];
            for (sum, a) in sums.iter_mut().zip(tail) {
                *sum += factor * a;
            }
        }
        for &i in active {
            let (head, tail) = rows.row_mut(i)[column..].split_at_mut(1);
            for (a, sum) in tail.iter_mut().zip(&*sums) {
                *a -= head[0] * sum;
            }
            head[0] = 0.0;
        }
        rows.row_mut(active[0])[column] = diagonal;
    }
}

/// `row += factor * other`.
pub fn add_multiple(row: &mut [f64], factor: f64, other: &[f64]) {
    for (a, b) in row.iter_mut().zip(other) {
        *a += factor * b;
    }
}
