//! Triangular factor of a tall matrix, by Householder reflections of blocks of rows.
//!
//! Blocks fit into the first-level cache; each is reflected into the triangle of all previous rows. Columns are ordered by their first
//! nonzero row, so that columns without entries so far cost nothing.

use super::{BLOCK_ROWS, BlockColumn, HIGH, LANES, Row, RowBlock, order_by};
use crate::simd::{self, Arithmetic, Eight, Kernel};
use nalgebra::DMatrix;
use std::ops::Range;

/// Number of columns reflected together.
const WIDE: usize = LANES;

/// Reduced least-squares problem `|D A x - d|^2 = |R x - b|^2 + rest^2` with diagonal `D`.
#[derive(Clone)]
pub(crate) struct Triangle {
    /// Rows of `R`, each followed by its entry of `b`.
    rows: Vec<Vec<f64>>,
    /// Number of columns up to the last one with nonzero entries.
    begun: usize,
    /// Squared norm of the rest.
    rest: f64,
}

impl Triangle {
    /// Empty triangle with `columns` columns, best ordered by their first nonzero row.
    pub fn new(columns: usize) -> Self {
        Self {
            rows: vec![vec![0.0; columns + 1]; columns],
            begun: 0,
            rest: 0.0,
        }
    }

    /// Triangle of `A`, the diagonal `weight_roots` of `D`, and `d`; also returns the column of `A` for each column of `R`.
    pub fn of(matrix: &DMatrix<f64>, weight_roots: &[f64], right: &[f64]) -> (Self, Vec<usize>) {
        Self::of_blocks(matrix, |triangle, block, rows| {
            triangle.add_weighted(block, &weight_roots[rows.clone()], &right[rows]);
        })
    }

    /// Triangle to which `add` adds each block of the rows of a matrix.
    fn of_blocks(
        matrix: &DMatrix<f64>,
        mut add: impl FnMut(&mut Self, &mut RowBlock, Range<usize>),
    ) -> (Self, Vec<usize>) {
        let height = matrix.nrows();
        let columns: Vec<&[f64]> = matrix.as_slice().chunks_exact(height.max(1)).collect();
        let begins: Vec<usize> = columns.iter().map(|c| begin(c)).collect();
        let order = order_by(&begins);
        let mut triangle = Self::new(order.len());
        let mut block = RowBlock::new(order.len());
        while block.first < height {
            let rows = block.first..(block.first + BLOCK_ROWS).min(height);
            block.count = rows.len();
            for (position, j) in order.iter().enumerate() {
                let column = &columns[*j][rows.clone()];
                block.column_mut(position)[..rows.len()].copy_from_slice(column);
            }
            block.first = rows.end;
            add(&mut triangle, &mut block, rows);
        }
        (triangle, order)
    }

    /// Square matrix `R` with `R^T R = A^T A`: the triangle, its columns in the order of those of `A`.
    pub fn factor(matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let (triangle, order) = Self::of_blocks(matrix, |triangle, block, rows| {
            triangle.add(block, &[0.0; BLOCK_ROWS][..rows.len()]);
        });
        let mut factor = DMatrix::zeros(order.len(), order.len());
        for (i, (entries, _)) in triangle.rows().enumerate() {
            entries.for_each(|(position, r)| factor[(i, order[position])] = r);
        }
        factor
    }

    /// Adds the rows of a block, with `D` and `d` for each; the contents of the block are then undefined.
    pub fn add_weighted(&mut self, block: &mut RowBlock, weight_roots: &[f64], right: &[f64]) {
        let positions = self.begin(block);
        simd::run(Weigh {
            columns: &mut block.columns[..positions],
            weight_roots,
        });
        self.reflect(block, right);
    }

    /// [`Triangle::add_weighted`] with `D = 1`.
    pub fn add(&mut self, block: &mut RowBlock, right: &[f64]) {
        self.begin(block);
        self.reflect(block, right);
    }

    /// Adds the columns that start in a block; returns the number of columns in use.
    fn begin(&mut self, block: &mut RowBlock) -> usize {
        let any = |part: &[f64]| part.iter().fold(false, |any, a| any | (*a != 0.0));
        let has_begun = |position: &usize| block.column(*position).chunks(4 * LANES).any(any);
        let last = (self.begun..block.begun()).rev().find(has_begun);
        self.widen(last.map_or(self.begun, |last| last + 1));
        block.widen(self.begun);
        self.begun
    }

    fn reflect(&mut self, block: &mut RowBlock, right: &[f64]) {
        let columns = &mut block.columns[..=self.begun];
        // The right-hand side follows the columns in use; the others are zero.
        let to = columns[self.begun].as_flattened_mut();
        match (
            to.first_chunk_mut::<BLOCK_ROWS>(),
            right.first_chunk::<BLOCK_ROWS>(),
        ) {
            (Some(to), Some(right)) => *to = *right,
            _ => to[..right.len()].copy_from_slice(right),
        }
        for column in columns.iter_mut() {
            column.as_flattened_mut()[right.len()..].fill(0.0);
        }
        simd::run(BlockReflection {
            triangle: self,
            block: columns,
        });
    }

    /// Adds columns, which are zero so far.
    fn widen(&mut self, begun: usize) {
        for row in &mut self.rows[..self.begun] {
            let b = std::mem::take(&mut row[self.begun]);
            row[begun] = b;
        }
        self.begun = begun;
    }

    /// Nonempty rows of `R`, with `b`.
    pub fn rows(&self) -> impl Iterator<Item = (impl Iterator<Item = (usize, f64)>, f64)> {
        let rows = self.rows[..self.begun].iter().enumerate();
        rows.map(|(i, row)| {
            let entries = row[i..self.begun].iter().enumerate();
            let entries = entries.map(move |(k, r)| (i + k, *r));
            (entries.filter(|(_, r)| *r != 0.0), row[self.begun])
        })
    }

    /// Adds the rows of another triangle, whose columns are those of this one and two more, which are the combinations `states` of the
    /// columns of this one.
    pub fn join(&mut self, other: &Triangle, states: &[[f64; 2]]) {
        let n = self.rows.len();
        let mut block = RowBlock::new(n);
        block.restart(0);
        block.count = other.begun;
        block.widen(n);
        let mut right = Vec::with_capacity(other.begun);
        for (i, (entries, b)) in other.rows().enumerate() {
            for (position, r) in entries {
                if position < n {
                    block.column_mut(position)[i] += r;
                    continue;
                }
                for (own, state) in states.iter().take(n).enumerate() {
                    block.column_mut(own)[i] += r * state[position - n];
                }
            }
            right.push(b);
        }
        self.add(&mut block, &right);
        self.rest += other.rest;
    }

    /// Products `R' b = (D A)' d`.
    pub fn products(&self) -> Vec<f64> {
        let mut products = vec![0.0; self.rows.len()];
        for (entries, b) in self.rows() {
            for (position, r) in entries {
                products[position] += r * b;
            }
        }
        products
    }

    /// Triangle of the same matrix with another right-hand side, given by its products `(D A)' d` and its square `|d|^2`; `None` if these
    /// are inconsistent with the matrix (a negative rest), or a column is linearly dependent.
    pub fn beside(mut self, products: &[f64], square: f64) -> Option<Self> {
        let n = self.rows.len();
        let mut explained = 0.0;
        for i in 0..n {
            let above = self.rows[..i].iter().map(|row| row[i] * row[n]);
            let b = (products[i] - above.sum::<f64>()) / self.rows[i][i];
            self.rows[i][n] = b;
            explained += b * b;
        }
        self.rest = square - explained;
        (self.begun == n && self.is_finite() && self.rest >= 0.0).then_some(self)
    }

    /// Solution of `R x = b`; `None` if the independent part of a column is below the share `independent` of its length.
    pub fn solve(&self, independent: f64) -> Option<Vec<f64>> {
        let n = self.rows.len();
        (self.begun == n).then_some(())?;
        let mut x = vec![0.0; n];
        for j in (0..n).rev() {
            let row = &self.rows[j];
            let known = row[j + 1..n].iter().zip(&x[j + 1..]);
            let known: f64 = known.map(|(r, x)| r * x).sum();
            let above = self.rows[..=j].iter().map(|row| row[j] * row[j]);
            let length = above.sum::<f64>().sqrt();
            let is_firm = row[j].abs() > independent * length;
            x[j] = is_firm.then(|| (row[n] - known) / row[j])?;
        }
        x.iter().all(|x| x.is_finite()).then_some(x)
    }

    /// Norm of the rest.
    pub fn rest(&self) -> f64 {
        self.rest.sqrt()
    }

    /// True if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.rest.is_finite() && self.rows.iter().flatten().all(|r| r.is_finite())
    }
}

/// First nonzero row of a column; its length if there is none.
fn begin(column: &[f64]) -> usize {
    let (eights, rest) = column.as_chunks::<LANES>();
    let is_zero = |eight: &Row| eight.iter().fold(true, |all, a| all & (*a == 0.0));
    let zeros = eights.iter().take_while(|eight| is_zero(eight)).count() * LANES;
    let from = zeros.min(column.len() - rest.len());
    let more = column[from..].iter().take_while(|a| **a == 0.0);
    from + more.count()
}

/// Multiplies the rows of columns by their `weight_roots`.
struct Weigh<'a> {
    columns: &'a mut [BlockColumn],
    weight_roots: &'a [f64],
}

impl Kernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let (weight_roots, last) = self.weight_roots.as_chunks::<LANES>();
        for column in self.columns {
            for (a, root) in column.iter_mut().zip(weight_roots) {
                *a = (Eight::load(arithmetic, root) * Eight::load(arithmetic, a)).row();
            }
            let rest = column.get_mut(weight_roots.len()).into_iter().flatten();
            rest.zip(last).for_each(|(a, root)| *a *= root);
        }
    }
}

/// Reflects a block, its right-hand side last, into the triangle.
struct BlockReflection<'a> {
    triangle: &'a mut Triangle,
    block: &'a mut [BlockColumn],
}

impl Kernel for BlockReflection<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let columns = self.block.len();
        for k in 0..columns - 1 {
            let (before, after) = self.block.split_at_mut(k + 1);
            let column = &before[k];
            let square = dot(arithmetic, column, column);
            if square == 0.0 {
                continue;
            }
            let row = &mut self.triangle.rows[k];
            let norm = (row[k] * row[k] + square).sqrt();
            // The sign avoids cancellation.
            let corner = if row[k] > 0.0 { -norm } else { norm };
            let reflector = Reflector {
                column,
                top: row[k] - corner,
                factor: 1.0 / (norm * (norm + row[k].abs())),
            };
            row[k] = corner;
            let tops = &mut row[k + 1..columns];
            let mut from = 0;
            while from < after.len() {
                let to = (from + WIDE).min(after.len());
                let (columns, tops) = (&mut after[from..to], &mut tops[from..to]);
                match to - from {
                    8 => reflector.reflect::<A, 8>(arithmetic, columns, tops),
                    7 => reflector.reflect::<A, 7>(arithmetic, columns, tops),
                    6 => reflector.reflect::<A, 6>(arithmetic, columns, tops),
                    5 => reflector.reflect::<A, 5>(arithmetic, columns, tops),
                    4 => reflector.reflect::<A, 4>(arithmetic, columns, tops),
                    3 => reflector.reflect::<A, 3>(arithmetic, columns, tops),
                    2 => reflector.reflect::<A, 2>(arithmetic, columns, tops),
                    _ => reflector.reflect::<A, 1>(arithmetic, columns, tops),
                }
                from = to;
            }
        }
        let right = &self.block[columns - 1];
        self.triangle.rest += dot(arithmetic, right, right);
    }
}

/// Reflection `1 - factor (top, column) (top, column)'`.
struct Reflector<'a> {
    column: &'a BlockColumn,
    top: f64,
    factor: f64,
}

impl Reflector<'_> {
    #[inline(always)]
    fn reflect<A: Arithmetic, const J: usize>(
        &self,
        arithmetic: A,
        columns: &mut [BlockColumn],
        tops: &mut [f64],
    ) {
        let Some(columns) = columns.first_chunk_mut::<J>() else {
            return;
        };
        let mut sums = [Eight::splat(arithmetic, 0.0); J];
        for (h, x) in self.column.iter().enumerate() {
            let x = Eight::load(arithmetic, x);
            for j in 0..J {
                sums[j] += x * Eight::load(arithmetic, &columns[j][h]);
            }
        }
        let mut rows = [[0.0; LANES]; LANES];
        for j in 0..J {
            rows[j] = sums[j].row();
        }
        let lanes = simd::transposed(arithmetic, &rows);
        let mut sum = Eight::load(arithmetic, &lanes[0]);
        for lane in &lanes[1..] {
            sum += Eight::load(arithmetic, lane);
        }
        let sum = sum.row();
        let mut shares = [Eight::splat(arithmetic, 0.0); J];
        for j in 0..J {
            let share = (self.top * tops[j] + sum[j]) * self.factor;
            tops[j] -= share * self.top;
            shares[j] = Eight::splat(arithmetic, share);
        }
        for (h, x) in self.column.iter().enumerate() {
            let x = Eight::load(arithmetic, x);
            for j in 0..J {
                columns[j][h] = (Eight::load(arithmetic, &columns[j][h]) - shares[j] * x).row();
            }
        }
    }
}

#[inline(always)]
fn dot<A: Arithmetic>(arithmetic: A, a: &BlockColumn, b: &BlockColumn) -> f64 {
    let mut sums = [Eight::splat(arithmetic, 0.0); 4];
    for h in 0..HIGH {
        sums[h % 4] += Eight::load(arithmetic, &a[h]) * Eight::load(arithmetic, &b[h]);
    }
    let lanes = ((sums[0] + sums[1]) + (sums[2] + sums[3])).row();
    let mut sum = 0.0;
    for lane in lanes {
        sum += lane;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    const ROWS: usize = 2 * BLOCK_ROWS + 37;

    /// A matrix whose columns start at different rows, in another order; weights; right-hand side.
    fn problem() -> (DMatrix<f64>, Vec<f64>, Vec<f64>) {
        let begins = [BLOCK_ROWS + 5, 0, 90, 3, BLOCK_ROWS];
        let entry = |i: usize, j: usize| match i < begins[j] {
            true => 0.0,
            false => ((i * (j + 2)) as f64 * 0.7 + j as f64).sin(),
        };
        let matrix = DMatrix::from_fn(ROWS, begins.len(), entry);
        let weight_roots = (0..ROWS).map(|i| 1.0 + (i as f64).cos().abs()).collect();
        let right = (0..ROWS).map(|i| (0.3 * i as f64).cos()).collect();
        (matrix, weight_roots, right)
    }

    #[test]
    fn the_triangle_has_the_minimum_of_the_tall_matrix() {
        let (matrix, weight_roots, right) = problem();
        let (triangle, order) = Triangle::of(&matrix, &weight_roots, &right);
        assert_eq!(order, [1, 3, 2, 4, 0]);
        let weights = DMatrix::from_diagonal(&DVector::from_vec(weight_roots));
        let (weighted, right) = (weights * matrix, DVector::from_vec(right));
        let svd = weighted.clone().svd(true, true);
        let expected = svd.solve(&right, 0.0).expect("five independent columns");
        let found = triangle.solve(1e-14).expect("five independent columns");
        for (position, j) in order.iter().enumerate() {
            assert!(
                (found[position] - expected[*j]).abs() <= 1e-13,
                "{found:?} {expected}"
            );
        }
        let rest = (weighted * expected - right).norm();
        assert!((triangle.rest() - rest).abs() <= 1e-13 * rest);
        assert!(triangle.is_finite());
    }

    /// A right-hand side given by its products and its square; inconsistent values are rejected.
    #[test]
    fn another_right_hand_side_of_the_same_matrix_is_reduced() {
        let (matrix, weight_roots, right) = problem();
        let other: Vec<f64> = right.iter().map(|x| x * x - 0.3).collect();
        let (expected, order) = Triangle::of(&matrix, &weight_roots, &other);
        let (triangle, _) = Triangle::of(&matrix, &weight_roots, &right);
        let square: f64 = other.iter().map(|x| x * x).sum();
        let found = (triangle.clone().beside(&expected.products(), square)).expect("such a side");
        let pairs = |t: &Triangle| t.solve(1e-14).expect("five independent columns");
        for (found, expected) in pairs(&found).iter().zip(pairs(&expected)) {
            assert!((found - expected).abs() <= 1e-13, "{found} {expected}");
        }
        assert!((found.rest() - expected.rest()).abs() <= 1e-12 * expected.rest());
        assert!(triangle.clone().beside(&expected.products(), 0.0).is_none());
        let wider = Triangle::new(order.len());
        assert!(wider.beside(&expected.products(), square).is_none());
    }

    /// Every division of the rows into blocks gives the same result, to machine precision.
    #[test]
    fn the_result_does_not_depend_on_the_blocks() {
        let (matrix, weight_roots, right) = problem();
        let (whole, order) = Triangle::of(&matrix, &weight_roots, &right);
        let mut parts = Triangle::new(order.len());
        let mut block = RowBlock::new(order.len());
        let mut first = 0;
        for count in (1..).take_while(|count| *count < 100) {
            let rows = first..(first + count).min(ROWS);
            block.clear();
            block.count = rows.len();
            for (position, j) in order.iter().enumerate() {
                for (r, i) in rows.clone().enumerate() {
                    block.column_mut(position)[r] = matrix[(i, *j)];
                }
            }
            parts.add_weighted(
                &mut block,
                &weight_roots[rows.clone()],
                &right[rows.clone()],
            );
            first = rows.end;
        }
        assert_eq!(first, ROWS);
        let (whole, parts) = (whole.solve(1e-14), parts.solve(1e-14));
        let pairs = whole
            .expect("a minimum")
            .into_iter()
            .zip(parts.expect("a minimum"));
        for (whole, part) in pairs {
            assert!((whole - part).abs() <= 1e-13, "{whole} {part}");
        }
    }

    #[test]
    fn undetermined_columns_have_no_solution() {
        let (mut matrix, weight_roots, right) = problem();
        let sum = matrix.column(1) + matrix.column(3);
        matrix.set_column(2, &sum);
        assert_eq!(
            Triangle::of(&matrix, &weight_roots, &right).0.solve(1e-14),
            None
        );
        matrix.column_mut(2).fill(0.0);
        assert_eq!(
            Triangle::of(&matrix, &weight_roots, &right).0.solve(1e-14),
            None
        );
        matrix[(7, 2)] = f64::NAN;
        let (triangle, _) = Triangle::of(&matrix, &weight_roots, &right);
        assert!(!triangle.is_finite());
        assert_eq!(triangle.solve(1e-14), None);
    }
}
