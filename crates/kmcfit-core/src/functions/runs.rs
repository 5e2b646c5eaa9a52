//! Rows of a design that see the same one or two parameters, run after run: on knots all rows between two of
//! them see these two.

use super::Design;
use crate::simd::{self, Elementwise};
use std::ops::Range;

/// A design with one or two entries in every row.
#[derive(Debug, Clone)]
pub(crate) struct RowRuns {
    runs: Vec<Run>,
    /// The first entry of every row, and the second: zero where there is none.
    entries: [Vec<f64>; 2],
}

#[derive(Debug, Clone)]
struct Run {
    rows: Range<usize>,
    first: usize,
    second: Option<usize>,
}

/// Rows that see the same parameters.
pub(crate) struct Piece<'a> {
    pub rows: Range<usize>,
    /// The parameter, and its entries.
    pub first: (usize, &'a [f64]),
    pub second: Option<(usize, &'a [f64])>,
}

impl RowRuns {
    /// `None` where a row has no entry or more than two, or where runs are so short that they do not pay.
    pub fn of(design: &Design) -> Option<Self> {
        /// Fewest rows of a run, on average.
        const WORTH: usize = 8;
        let Design::Sparse(matrix) = design else {
            return None;
        };
        let mut runs: Vec<Run> = Vec::new();
        let mut entries = [Vec::new(), Vec::new()];
        for (i, row) in matrix.row_iter().enumerate() {
            let (first, second) = match *row.col_indices() {
                [j] => (j, None),
                [j, k] => (j, Some(k)),
                _ => return None,
            };
            entries[0].push(row.values()[0]);
            entries[1].push(row.values().get(1).copied().unwrap_or(0.0));
            match runs.last_mut() {
                Some(run) if (run.first, run.second) == (first, second) => run.rows.end = i + 1,
                _ => runs.push(Run {
                    rows: i..i + 1,
                    first,
                    second,
                }),
            }
        }
        (runs.len() * WORTH <= matrix.nrows()).then_some(Self { runs, entries })
    }

    /// The runs, as far as they are among these rows.
    #[inline(always)]
    pub fn within(&self, rows: Range<usize>) -> impl Iterator<Item = Piece<'_>> {
        let first = self.runs.partition_point(|run| run.rows.end <= rows.start);
        let runs = self.runs[first..].iter();
        let runs = runs.take_while(move |run| run.rows.start < rows.end);
        let [left, right] = &self.entries;
        runs.map(move |run| {
            let own = run.rows.start.max(rows.start)..run.rows.end.min(rows.end);
            Piece {
                first: (run.first, &left[own.clone()]),
                second: run.second.map(|k| (k, &right[own.clone()])),
                rows: own,
            }
        })
    }

    /// `values += B theta`, as [`Design::multiply_add`], with the same bits.
    pub fn multiply_add(&self, theta: &[f64], values: &mut [f64]) {
        simd::run(Elementwise(|| {
            for piece in self.within(0..values.len()) {
                let (values, (j, b)) = (&mut values[piece.rows], piece.first);
                match piece.second {
                    Some((k, c)) => {
                        for ((value, b), c) in values.iter_mut().zip(b).zip(c) {
                            *value += b * theta[j] + c * theta[k];
                        }
                    }
                    None => {
                        for (value, b) in values.iter_mut().zip(b) {
                            *value += b * theta[j];
                        }
                    }
                }
            }
        }));
    }

    /// The largest size of `B theta` at any of the first nodes, as [`Design::largest`].
    pub fn largest(&self, theta: &[f64], nodes: usize) -> f64 {
        // Many side by side: one maximum would wait for itself.
        let mut most = [0.0f64; 16];
        simd::run(Elementwise(|| {
            for piece in self.within(0..nodes) {
                let (j, b) = piece.first;
                let (k, c) = piece.second.unwrap_or((j, &self.entries[1][piece.rows]));
                let (b, c) = (b.chunks(most.len()), c.chunks(most.len()));
                for (b, c) in b.zip(c) {
                    for ((most, b), c) in most.iter_mut().zip(b).zip(c) {
                        *most = most.max((b * theta[j] + c * theta[k]).abs());
                    }
                }
            }
        }));
        most.into_iter().fold(0.0, f64::max)
    }

    /// `out += B^T nodal`, as [`Design::transpose_multiply_add`], with the same bits.
    pub fn transpose_multiply_add(&self, nodal: &[f64], out: &mut [f64]) {
        for piece in self.within(0..nodal.len()) {
            let (nodal, (j, b)) = (&nodal[piece.rows], piece.first);
            match piece.second {
                Some((k, c)) => {
                    let (mut first, mut second) = (out[j], out[k]);
                    for ((value, b), c) in nodal.iter().zip(b).zip(c) {
                        first += b * value;
                        second += c * value;
                    }
                    (out[j], out[k]) = (first, second);
                }
                None => {
                    out[j] = (nodal.iter().zip(b)).fold(out[j], |sum, (value, b)| sum + b * value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::functions::Basis;
    use crate::system::Grid;

    const NODES: usize = 401;

    fn linear(knots: &[f64]) -> Basis {
        Basis::PiecewiseLinear {
            knots: knots.to_vec(),
        }
    }

    fn designs() -> Vec<Design> {
        let grid = Grid::new(0.0, 10.0, NODES).expect("a grid");
        // A knot on nodes, where a row has one entry or a zero, and knots between nodes.
        let bases = [
            linear(&[0.0, 2.5, 5.0, 10.0]),
            linear(&[0.0, 0.711, 4.03, 9.99, 10.0]),
            Basis::Constant,
        ];
        bases.iter().map(|basis| basis.design(&grid)).collect()
    }

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn products_have_the_bits_of_the_design() {
        for design in designs() {
            let runs = RowRuns::of(&design).expect("two entries a row");
            let theta: Vec<f64> = (0..5).map(|j| (1.3 * f64::from(j)).sin() - 0.2).collect();
            let nodal: Vec<f64> = (0..NODES).map(|i| (0.1 * i as f64).cos()).collect();
            for nodes in [NODES, 300, 1] {
                let (mut one, mut other) = (nodal[..nodes].to_vec(), nodal[..nodes].to_vec());
                design.multiply_add(&theta, &mut one);
                runs.multiply_add(&theta, &mut other);
                assert_eq!(bits(&one), bits(&other));
                let (mut one, mut other) = (theta.clone(), theta.clone());
                design.transpose_multiply_add(&nodal[..nodes], &mut one);
                runs.transpose_multiply_add(&nodal[..nodes], &mut other);
                assert_eq!(bits(&one), bits(&other));
                let largest = design.multiply(&theta, NODES)[..nodes]
                    .iter()
                    .fold(0.0f64, |most, v| most.max(v.abs()));
                assert_eq!(runs.largest(&theta, nodes).to_bits(), largest.to_bits());
            }
        }
    }

    #[test]
    fn pieces_tile_the_rows() {
        for design in designs() {
            let runs = RowRuns::of(&design).expect("two entries a row");
            for (from, to) in [(0, NODES), (64, 128), (100, 101), (400, 401), (7, 7)] {
                let mut next = from;
                for piece in runs.within(from..to) {
                    assert_eq!(piece.rows.start, next);
                    for (at, i) in piece.rows.clone().enumerate() {
                        let second = piece.second.map(|(k, c)| (k, c[at]));
                        let own = [Some((piece.first.0, piece.first.1[at])), second];
                        let own: Vec<(usize, f64)> = own.into_iter().flatten().collect();
                        assert_eq!(own, design.row(i).collect::<Vec<_>>());
                    }
                    next = piece.rows.end;
                }
                assert_eq!(next, to);
            }
        }
    }

    #[test]
    fn other_designs_have_none() {
        let grid = Grid::new(0.0, 10.0, NODES).expect("a grid");
        assert!(RowRuns::of(&Design::Identity).is_none());
        assert!(RowRuns::of(&Design::Empty).is_none());
        // More entries, and a run for every few rows.
        let powers = Basis::Polynomial { degree: 3 };
        assert!(RowRuns::of(&powers.design(&grid)).is_none());
        let many: Vec<f64> = (0..101).map(|i| 0.1 * f64::from(i)).collect();
        assert!(RowRuns::of(&linear(&many).design(&grid)).is_none());
    }
}
