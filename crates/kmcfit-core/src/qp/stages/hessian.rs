//! The Hessian of one stage in vector registers.

use super::transitions::{NONE, Transitions};
use crate::simd::{Arithmetic, Eight, LANES, Row};

/// Most controls.
pub(super) const CONTROLS: usize = 4;

/// The Hessian of a stage with the cost-to-go of the next one: rows of the states, rows of the controls in the states, and the
/// controls among themselves.
pub(super) struct CostToGo<A: Arithmetic, const X: usize, const W: usize> {
    states: [[Eight<A>; BLOCKS]; X],
    controls: [[Eight<A>; BLOCKS]; CONTROLS],
    /// The controls among themselves.
    pub corner: [[f64; CONTROLS]; CONTROLS],
}

/// Most blocks of lanes of a row of states.
pub(super) const BLOCKS: usize = 2;

/// The lanes of block `b`.
#[inline(always)]
pub(super) fn block(row: &[f64], b: usize) -> &Row {
    row[b * LANES..(b + 1) * LANES]
        .try_into()
        .expect("a block of lanes")
}

/// The rows with 1 in one lane and 0 in the others.
pub(super) const UNITS: [Row; LANES] = {
    let mut units = [[0.0; LANES]; LANES];
    let mut j = 0;
    while j < LANES {
        units[j][j] = 1.0;
        j += 1;
    }
    units
};

impl<A: Arithmetic, const X: usize, const W: usize> CostToGo<A, X, W> {
    const USED: usize = X / LANES;

    #[inline(always)]
    pub fn zero(arithmetic: A) -> Self {
        let zero = Eight::splat(arithmetic, 0.0);
        Self {
            states: [[zero; BLOCKS]; X],
            controls: [[zero; BLOCKS]; CONTROLS],
            corner: [[0.0; CONTROLS]; CONTROLS],
        }
    }

    /// `F_i' P F_i`. With `F = E + G`, where `E` has the ones of the states that are no response and `G` the rows of the
    /// responses, `P F = (E' P)' + P G`: the sums of rows of `E' P` are transposed, as those of columns would need
    /// moves between lanes.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "blocks of several arrays at once"
    )]
    pub fn before(
        arithmetic: A,
        cost: &[[f64; X]; X],
        transitions: &Transitions<W>,
        i: usize,
        controls: usize,
    ) -> Self {
        let steps = transitions.step(i);
        let responses = transitions.responses;
        let used = transitions.states();
        let zero = Eight::splat(arithmetic, 0.0);
        let load = |row: &[f64], b: usize| Eight::load(arithmetic, block(row, b));
        // E' P.
        let mut sums = [[zero; BLOCKS]; X];
        let mut of_controls = [[zero; BLOCKS]; CONTROLS];
        for (k, next) in transitions.next.iter().enumerate() {
            let state = (responses + k) % X;
            for b in 0..Self::USED {
                let row = load(&cost[state], b);
                sums[state][b] += row;
                if *next < X {
                    sums[*next % X][b] += row;
                } else if *next != NONE {
                    of_controls[(*next - X) % CONTROLS][b] = row;
                }
            }
        }
        // Rows of P F: in the states, and, as columns, in the controls.
        let mut products = [[zero; BLOCKS]; X];
        for b in 0..Self::USED {
            for c in 0..Self::USED {
                let rows = std::array::from_fn(|j| sums[c * LANES + j][b]);
                let columns = Eight::transpose(arithmetic, rows);
                for (j, column) in columns.into_iter().enumerate() {
                    products[b * LANES + j][c] = column;
                }
            }
        }
        for (q, step) in steps.iter().enumerate() {
            for b in 0..Self::USED {
                let step_row = load(step, b);
                for (product, cost) in products.iter_mut().zip(cost).take(used) {
                    product[b] += Eight::splat(arithmetic, cost[q % X]) * step_row;
                }
                let row = load(&cost[q % X], b);
                for c in 0..controls {
                    of_controls[c % CONTROLS][b] +=
                        Eight::splat(arithmetic, step[(X + c) % W]) * row;
                }
            }
        }
        // F' (P F).
        let mut h = Self::zero(arithmetic);
        for (k, next) in transitions.next.iter().enumerate() {
            let state = (responses + k) % X;
            for b in 0..Self::USED {
                h.states[state][b] += products[state][b];
                if *next < X {
                    h.states[*next % X][b] += products[state][b];
                } else if *next != NONE {
                    h.controls[(*next - X) % CONTROLS][b] += products[state][b];
                }
            }
        }
        for (q, step) in steps.iter().enumerate() {
            for b in 0..Self::USED {
                let product = products[q % X][b];
                for (h, a) in h.states.iter_mut().zip(step).take(used) {
                    h[b] += Eight::splat(arithmetic, *a) * product;
                }
                for c in 0..controls {
                    h.controls[c % CONTROLS][b] +=
                        Eight::splat(arithmetic, step[(X + c) % W]) * product;
                }
            }
        }
        h.add_corner(&of_controls, transitions, steps, controls);
        h
    }

    /// Adds `F_i' P F_i` of the controls among themselves, from the columns of `P F_i` in the controls.
    #[inline(always)]
    fn add_corner(
        &mut self,
        columns: &[[Eight<A>; BLOCKS]; CONTROLS],
        transitions: &Transitions<W>,
        steps: &[[f64; W]],
        controls: usize,
    ) {
        for c in 0..controls {
            let mut column = [0.0; X];
            for b in 0..Self::USED {
                column[b * LANES..(b + 1) * LANES].copy_from_slice(&columns[c % CONTROLS][b].row());
            }
            for (k, next) in transitions.next.iter().enumerate() {
                if *next != NONE && *next >= X {
                    self.corner[(*next - X) % CONTROLS][c % CONTROLS] +=
                        column[(transitions.responses + k) % X];
                }
            }
            for (q, step) in steps.iter().enumerate() {
                for other in 0..controls {
                    self.corner[other % CONTROLS][c % CONTROLS] +=
                        step[(X + other) % W] * column[q % X];
                }
            }
        }
    }

    /// Adds `weight a a'`; a row with a single entry to the diagonal.
    #[inline(always)]
    pub fn add_square(
        &mut self,
        arithmetic: A,
        (columns, values): (&[u8], &[f64]),
        weight: f64,
        diagonal: &mut [f64; W],
    ) {
        if let ([column], [a]) = (columns, values) {
            diagonal[usize::from(*column) % W] += weight * a * a;
            return;
        }
        let mut dense = [0.0; W];
        for (column, a) in columns.iter().zip(values) {
            dense[usize::from(*column) % W] = *a;
        }
        for (column, a) in columns.iter().zip(values) {
            let (column, factor) = (usize::from(*column), weight * a);
            let splat = Eight::splat(arithmetic, factor);
            let row = match column.checked_sub(X) {
                None => &mut self.states[column % X],
                Some(c) => {
                    for (h, b) in self.corner[c % CONTROLS].iter_mut().zip(&dense[X..]) {
                        *h += factor * b;
                    }
                    &mut self.controls[c % CONTROLS]
                }
            };
            for (b, row) in row.iter_mut().enumerate().take(Self::USED) {
                *row += splat * Eight::load(arithmetic, block(&dense, b));
            }
        }
    }

    #[inline(always)]
    pub fn add_diagonal(&mut self, arithmetic: A, diagonal: &[f64; W], controls: usize) {
        for (j, (row, d)) in self.states.iter_mut().zip(diagonal).enumerate() {
            let unit = Eight::load(arithmetic, &UNITS[j % LANES]);
            row[j / LANES] += Eight::splat(arithmetic, *d) * unit;
        }
        for c in 0..controls {
            self.corner[c % CONTROLS][c % CONTROLS] += diagonal[(X + c) % W];
        }
    }

    /// Eliminates control `c`, the last that is left; its pivot row over the pivot.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "blocks of several arrays at once"
    )]
    pub fn eliminate(&mut self, arithmetic: A, c: usize, inverse: f64) -> [f64; W] {
        let mut gain = [0.0; W];
        let scale = Eight::splat(arithmetic, inverse);
        let row = self.controls[c % CONTROLS];
        for b in 0..Self::USED {
            gain[b * LANES..(b + 1) * LANES].copy_from_slice(&(row[b] * scale).row());
        }
        for other in 0..c {
            gain[(X + other) % W] = self.corner[c % CONTROLS][other % CONTROLS] * inverse;
        }
        for (states, factor) in self.states.iter_mut().zip(&gain) {
            let splat = Eight::splat(arithmetic, *factor);
            for b in 0..Self::USED {
                states[b] = states[b] - splat * row[b];
            }
        }
        for other in 0..c {
            let factor = gain[(X + other) % W];
            let splat = Eight::splat(arithmetic, factor);
            for b in 0..Self::USED {
                let difference = self.controls[other % CONTROLS][b] - splat * row[b];
                self.controls[other % CONTROLS][b] = difference;
            }
            for last in 0..=other {
                self.corner[other % CONTROLS][last % CONTROLS] -=
                    factor * self.corner[c % CONTROLS][last % CONTROLS];
            }
        }
        gain
    }

    /// The Hessian in the states.
    #[inline(always)]
    pub fn states(&self) -> [[f64; X]; X] {
        let mut out = [[0.0; X]; X];
        for (out, row) in out.iter_mut().zip(&self.states) {
            for b in 0..Self::USED {
                out[b * LANES..(b + 1) * LANES].copy_from_slice(&row[b].row());
            }
        }
        out
    }
}
