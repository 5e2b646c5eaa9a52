//! The triangular factor of a tall matrix, by Householder reflections of some rows at a time.
//!
//! The rows are taken in pieces that stay in the processor's nearest memory; each is reflected into the
//! triangle of all rows before it. A parameter that the first readings do not see stays out of the way
//! until it is seen: the columns are taken in the order in which they begin.

use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row};
use nalgebra::DMatrix;

/// Rows of a piece, in lanes: with 34 columns they fill the nearest memory.
const HIGH: usize = 12;
/// Rows of a piece.
const PIECE: usize = HIGH * LANES;
/// Columns that are reflected at once.
const WIDE: usize = LANES;

type Column = [Row; HIGH];

/// `|D A x - d|^2 = |R x - b|^2 + rest^2` with diagonal `D`.
pub(super) struct Triangle {
    /// Column of `A` that each column of `R` is.
    order: Vec<usize>,
    /// Rows of `R`, each with its `b` behind the columns that have begun.
    rows: Vec<Vec<f64>>,
    /// Columns that have begun.
    begun: usize,
    /// The square of the rest.
    rest: f64,
}

impl Triangle {
    /// From `A`, the diagonal `roots` of `D`, and `d`.
    pub fn of(matrix: &DMatrix<f64>, roots: &[f64], right: &[f64]) -> Self {
        let n = matrix.ncols();
        let height = matrix.nrows();
        let columns: Vec<&[f64]> = matrix.as_slice().chunks_exact(height.max(1)).collect();
        let begins: Vec<usize> = columns.iter().map(|c| begin(c)).collect();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|j| begins[*j]);
        let mut triangle = Self {
            order,
            rows: vec![vec![0.0; n + 1]; n],
            begun: 0,
            rest: 0.0,
        };
        let mut piece: Vec<Column> = vec![[[0.0; LANES]; HIGH]; n + 1];
        let mut from = 0;
        while from < height {
            let to = (from + PIECE).min(height);
            let begun = (triangle.order.iter())
                .take_while(|j| begins[**j] < to)
                .count();
            triangle.widen(begun);
            let order = std::mem::take(&mut triangle.order);
            let part = |j: usize| columns[order[j]].get(from..to).unwrap_or_default();
            lanes::run(Fill {
                piece: &mut piece[..begun],
                part,
                roots: &roots[from..to],
            });
            triangle.order = order;
            let (filled, below) = piece[begun].as_flattened_mut().split_at_mut(to - from);
            filled.copy_from_slice(&right[from..to]);
            below.fill(0.0);
            lanes::run(Reflect {
                triangle: &mut triangle,
                piece: &mut piece[..=begun],
            });
            from = to;
        }
        triangle
    }

    /// More columns begin: until now there is nothing in them.
    fn widen(&mut self, begun: usize) {
        for row in &mut self.rows[..self.begun] {
            let b = std::mem::take(&mut row[self.begun]);
            row[begun] = b;
        }
        self.begun = begun;
    }

    /// Rows of `R` as columns of `A` with entries, and `b`.
    pub fn rows(&self) -> impl Iterator<Item = (impl Iterator<Item = (usize, f64)>, f64)> {
        let rows = self.rows[..self.begun].iter().enumerate();
        rows.map(|(i, row)| {
            let entries = self.order[i..self.begun].iter().zip(&row[i..]);
            let entries = entries.map(|(j, r)| (*j, *r)).filter(|(_, r)| *r != 0.0);
            (entries, row[self.begun])
        })
    }

    /// What no `x` can change, as a length.
    pub fn rest(&self) -> f64 {
        self.rest.sqrt()
    }
}

/// The first row of a column that is not zero; its length if there is none.
fn begin(column: &[f64]) -> usize {
    let (eights, rest) = column.as_chunks::<LANES>();
    let is_zero = |eight: &Row| eight.iter().fold(true, |all, a| all & (*a == 0.0));
    let zeros = eights.iter().take_while(|eight| is_zero(eight)).count() * LANES;
    let from = zeros.min(column.len() - rest.len());
    let more = column[from..].iter().take_while(|a| **a == 0.0);
    from + more.count()
}

/// Fills the columns of a piece from parts of the matrix times the diagonal `roots`, with zeros below.
struct Fill<'a, F> {
    piece: &'a mut [Column],
    part: F,
    roots: &'a [f64],
}

impl<'m, F: Fn(usize) -> &'m [f64]> Kernel for Fill<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let (roots, last) = self.roots.as_chunks::<LANES>();
        for (j, column) in self.piece.iter_mut().enumerate() {
            let (values, rest) = (self.part)(j).as_chunks::<LANES>();
            let mut filled = 0;
            for ((to, a), root) in column.iter_mut().zip(values).zip(roots) {
                *to = (Eight::load(arithmetic, root) * Eight::load(arithmetic, a)).row();
                filled += 1;
            }
            if let Some((next, below)) = column[filled..].split_first_mut() {
                *next = [0.0; LANES];
                for ((to, a), root) in next.iter_mut().zip(rest).zip(last) {
                    *to = root * a;
                }
                below.fill([0.0; LANES]);
            }
        }
    }
}

/// Reflects a piece, its right-hand side last, into the triangle.
struct Reflect<'a> {
    triangle: &'a mut Triangle,
    piece: &'a mut [Column],
}

impl Kernel for Reflect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let columns = self.piece.len();
        for k in 0..columns - 1 {
            let (before, after) = self.piece.split_at_mut(k + 1);
            let column = &before[k];
            let square = dot(arithmetic, column, column);
            if square == 0.0 {
                continue;
            }
            let row = &mut self.triangle.rows[k];
            let norm = (row[k] * row[k] + square).sqrt();
            // Away from zero, so that nothing cancels.
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
        let right = &self.piece[columns - 1];
        self.triangle.rest += dot(arithmetic, right, right);
    }
}

/// `1 - factor (top, column) (top, column)'`.
struct Reflector<'a> {
    column: &'a Column,
    top: f64,
    factor: f64,
}

impl Reflector<'_> {
    #[inline(always)]
    fn reflect<A: Arithmetic, const J: usize>(
        &self,
        arithmetic: A,
        columns: &mut [Column],
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
        let lanes = arithmetic.transpose(&rows);
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
fn dot<A: Arithmetic>(arithmetic: A, a: &Column, b: &Column) -> f64 {
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
