//! The linear-quadratic control problem of one Newton step, by the Riccati recursion.
//!
//! With the coordinates `xi_i = (x_i, u_i)` of the stages, minimises
//!
//! ```text
//! sum_i 1/2 xi_i' H_i xi_i + q_i' xi_i,    x_{i+1} = F_i xi_i
//! ```
//!
//! backwards in time: with the cost-to-go `1/2 x' P_{i+1} x + p_{i+1}' x` the controls of stage `i` are eliminated from
//! `H_i + F_i' P_{i+1} F_i` by Cholesky pivots. Weights of penalties stand on the diagonal of the controls, so that
//! large ones do not cancel. Only the pivot rows are stored.

use super::rows::StageRows;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};

/// No coordinate.
pub(super) const NONE: usize = usize::MAX;

/// The transitions `F_i`: rows of the responses, which differ from stage to stage; every other state keeps its value
/// and adds that of another coordinate, its next difference.
#[derive(Debug, Clone)]
pub(super) struct Transitions<const W: usize> {
    /// Number of response components, the first states.
    pub responses: usize,
    /// Rows of the responses, `responses` for each step.
    pub steps: Vec<[f64; W]>,
    /// For each state that is no response the coordinate that it adds; [`NONE`] for a constant. States that do not occur are
    /// beyond the end.
    pub next: Vec<usize>,
}

impl<const W: usize> Transitions<W> {
    /// States in use.
    pub fn states(&self) -> usize {
        self.responses + self.next.len()
    }

    #[inline(always)]
    fn step(&self, i: usize) -> &[[f64; W]] {
        &self.steps[i * self.responses..(i + 1) * self.responses]
    }

    /// `F_i xi`.
    #[inline(always)]
    pub fn forward<const X: usize>(&self, i: usize, xi: &[f64; W]) -> [f64; X] {
        let mut x = [0.0; X];
        for (x, row) in x.iter_mut().zip(self.step(i)) {
            *x = dot(row, xi);
        }
        for (k, next) in self.next.iter().enumerate() {
            let state = self.responses + k;
            x[state] = match *next {
                NONE => xi[state],
                next => xi[state] + xi[next],
            };
        }
        x
    }

    /// Adds `F_i' p`.
    #[inline(always)]
    pub fn backward<const X: usize>(&self, i: usize, p: &[f64; X], out: &mut [f64; W]) {
        for (p, row) in p.iter().zip(self.step(i)) {
            for (out, a) in out.iter_mut().zip(row) {
                *out += p * a;
            }
        }
        for (k, next) in self.next.iter().enumerate() {
            let state = self.responses + k;
            out[state] += p[state];
            if *next != NONE {
                out[*next] += p[state];
            }
        }
    }
}

/// The product of two vectors, in four sums side by side.
#[inline(always)]
fn dot<const W: usize>(a: &[f64; W], b: &[f64; W]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Pivot rows of all stages, and the cost-to-go of the first state. `X` states, a multiple of [`LANES`]; the others of the `W`
/// coordinates are controls.
pub(super) struct Factor<const X: usize, const W: usize> {
    stages: usize,
    /// Controls in use.
    controls: usize,
    /// For each stage and control its pivot row, divided by the pivot.
    gains: Vec<[f64; W]>,
    /// Inverses of the pivots.
    inverses: Vec<f64>,
    /// `P_0`.
    pub first: [[f64; X]; X],
    /// Of the last solution: the controls for zero states.
    offsets: Vec<f64>,
}

impl<const X: usize, const W: usize> Factor<X, W> {
    pub fn new(stages: usize, controls: usize) -> Self {
        Self {
            stages,
            controls,
            gains: vec![[0.0; W]; stages * controls],
            inverses: vec![0.0; stages * controls],
            first: [[0.0; X]; X],
            offsets: vec![0.0; stages * controls],
        }
    }

    /// Factorises for the Hessians `sum a a'` of the residuals plus `sum w a a'` of the constraint rows; false if a
    /// pivot is not positive.
    pub fn factorise(
        &mut self,
        transitions: &Transitions<W>,
        residuals: &StageRows,
        constraints: &StageRows,
        weights: &[f64],
    ) -> bool {
        simd::run(Factorise {
            factor: self,
            transitions,
            residuals,
            constraints,
            weights,
        })
    }

    /// The gradient `p_0` of the cost-to-go at the first state for the gradients `q`.
    pub fn backward(&mut self, transitions: &Transitions<W>, q: &[[f64; W]]) -> [f64; X] {
        simd::run(Backward {
            factor: self,
            transitions,
            q,
        })
    }

    /// The solution from the first state on, for the gradients of the last [`Factor::backward`].
    pub fn forward(&self, transitions: &Transitions<W>, first: [f64; X], xi: &mut [[f64; W]]) {
        simd::run(Forward {
            factor: self,
            transitions,
            first,
            xi,
        });
    }
}

struct Factorise<'a, const X: usize, const W: usize> {
    factor: &'a mut Factor<X, W>,
    transitions: &'a Transitions<W>,
    residuals: &'a StageRows,
    constraints: &'a StageRows,
    weights: &'a [f64],
}

impl<const X: usize, const W: usize> Kernel for Factorise<'_, X, W> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> bool {
        let Self {
            factor,
            transitions,
            residuals,
            constraints,
            weights,
        } = self;
        let controls = factor.controls;
        let mut cost = [[0.0; X]; X];
        for i in (0..factor.stages).rev() {
            let mut h = match i + 1 < factor.stages {
                true => CostToGo::before(arithmetic, &cost, transitions, i, controls),
                false => CostToGo::zero(arithmetic),
            };
            let mut diagonal = [0.0; W];
            for row in residuals.of_stage(i) {
                h.add_square(arithmetic, residuals.row(row), 1.0, &mut diagonal);
            }
            for row in constraints.of_stage(i) {
                h.add_square(
                    arithmetic,
                    constraints.row(row),
                    weights[row],
                    &mut diagonal,
                );
            }
            h.add_diagonal(arithmetic, &diagonal, controls);
            for c in (0..controls).rev() {
                let pivot = h.corner[c][c];
                // False for NaN.
                if !(pivot > 0.0) {
                    return false;
                }
                let inverse = 1.0 / pivot;
                factor.gains[i * controls + c] = h.eliminate(arithmetic, c, inverse);
                factor.inverses[i * controls + c] = inverse;
            }
            cost = h.states();
        }
        factor.first = cost;
        true
    }
}

/// Most controls.
const CONTROLS: usize = 4;

/// The Hessian of a stage with the cost-to-go of the next one: rows of the states, rows of the controls in the states, and the
/// controls among themselves.
struct CostToGo<A: Arithmetic, const X: usize, const W: usize> {
    states: [[Eight<A>; BLOCKS]; X],
    controls: [[Eight<A>; BLOCKS]; CONTROLS],
    corner: [[f64; CONTROLS]; CONTROLS],
}

/// Most blocks of lanes of a row of states.
const BLOCKS: usize = 2;

/// The lanes of block `b`.
#[inline(always)]
fn block(row: &[f64], b: usize) -> &Row {
    row[b * LANES..(b + 1) * LANES]
        .try_into()
        .expect("a block of lanes")
}

/// The rows with 1 in one lane and 0 in the others.
const UNITS: [Row; LANES] = {
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
    fn zero(arithmetic: A) -> Self {
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
    fn before(
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
        for c in 0..controls {
            let mut column = [0.0; X];
            for b in 0..Self::USED {
                column[b * LANES..(b + 1) * LANES]
                    .copy_from_slice(&of_controls[c % CONTROLS][b].row());
            }
            for (k, next) in transitions.next.iter().enumerate() {
                if *next != NONE && *next >= X {
                    h.corner[(*next - X) % CONTROLS][c % CONTROLS] += column[(responses + k) % X];
                }
            }
            for (q, step) in steps.iter().enumerate() {
                for other in 0..controls {
                    h.corner[other % CONTROLS][c % CONTROLS] +=
                        step[(X + other) % W] * column[q % X];
                }
            }
        }
        h
    }

    /// Adds `weight a a'`; a row with a single entry to the diagonal.
    #[inline(always)]
    fn add_square(
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
    fn add_diagonal(&mut self, arithmetic: A, diagonal: &[f64; W], controls: usize) {
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
    fn eliminate(&mut self, arithmetic: A, c: usize, inverse: f64) -> [f64; W] {
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
    fn states(&self) -> [[f64; X]; X] {
        let mut out = [[0.0; X]; X];
        for (out, row) in out.iter_mut().zip(&self.states) {
            for b in 0..Self::USED {
                out[b * LANES..(b + 1) * LANES].copy_from_slice(&row[b].row());
            }
        }
        out
    }
}

/// `row -= factor * other`.
#[inline(always)]
fn subtract_multiple<A: Arithmetic, const W: usize>(
    arithmetic: A,
    row: &mut [f64; W],
    factor: f64,
    other: &[f64; W],
) {
    let whole = W / LANES;
    let splat = Eight::splat(arithmetic, factor);
    for b in 0..whole {
        let difference = Eight::load(arithmetic, block(row, b))
            - splat * Eight::load(arithmetic, block(other, b));
        row[b * LANES..(b + 1) * LANES].copy_from_slice(&difference.row());
    }
    for (a, b) in row[whole * LANES..].iter_mut().zip(&other[whole * LANES..]) {
        *a -= factor * b;
    }
}

struct Backward<'a, const X: usize, const W: usize> {
    factor: &'a mut Factor<X, W>,
    transitions: &'a Transitions<W>,
    q: &'a [[f64; W]],
}

impl<const X: usize, const W: usize> Kernel for Backward<'_, X, W> {
    type Output = [f64; X];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [f64; X] {
        let Self {
            factor,
            transitions,
            q,
        } = self;
        let controls = factor.controls;
        let mut p = [0.0; X];
        for (i, q) in q.iter().enumerate().rev() {
            let mut h = *q;
            if i + 1 < factor.stages {
                transitions.backward(i, &p, &mut h);
            }
            for c in (0..controls).rev() {
                let at = i * controls + c;
                let slope = h[(X + c) % W];
                subtract_multiple(arithmetic, &mut h, slope, &factor.gains[at]);
                factor.offsets[at] = -slope * factor.inverses[at];
            }
            p.copy_from_slice(&h[..X]);
        }
        p
    }
}

struct Forward<'a, const X: usize, const W: usize> {
    factor: &'a Factor<X, W>,
    transitions: &'a Transitions<W>,
    first: [f64; X],
    xi: &'a mut [[f64; W]],
}

impl<const X: usize, const W: usize> Kernel for Forward<'_, X, W> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) {
        let Self {
            factor,
            transitions,
            first,
            xi,
        } = self;
        let mut x = first;
        for (i, out) in xi.iter_mut().enumerate() {
            let mut xi = [0.0; W];
            xi[..X].copy_from_slice(&x);
            for c in 0..factor.controls {
                let at = i * factor.controls + c;
                xi[(X + c) % W] = factor.offsets[at] - dot(&factor.gains[at], &xi);
            }
            *out = xi;
            if i + 1 < factor.stages {
                x = transitions.forward(i, &xi);
            }
        }
    }
}
