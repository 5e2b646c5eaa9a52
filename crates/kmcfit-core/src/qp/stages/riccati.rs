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

use super::hessian::{CostToGo, block};
use super::rows::StageRows;
use super::transitions::{Transitions, dot};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES};

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
    /// Controls of the last solution at zero states.
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

    /// Factorises for the Hessians `sum a a'` of the residuals plus `sum w a a'` of the rows with weights; false if a
    /// pivot is not positive.
    pub fn factorise(
        &mut self,
        transitions: &Transitions<W>,
        residuals: &StageRows,
        weighted: &[(&StageRows, &[f64])],
    ) -> bool {
        simd::run(Factorise {
            factor: self,
            transitions,
            residuals,
            weighted,
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
    weighted: &'a [(&'a StageRows, &'a [f64])],
}

impl<const X: usize, const W: usize> Kernel for Factorise<'_, X, W> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> bool {
        let Self {
            factor,
            transitions,
            residuals,
            weighted,
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
            for (rows, weights) in weighted {
                for row in rows.of_stage(i) {
                    h.add_square(arithmetic, rows.row(row), weights[row], &mut diagonal);
                }
            }
            h.add_diagonal(arithmetic, &diagonal, controls);
            for c in (0..controls).rev() {
                let pivot = h.corner[c][c];
                if pivot <= 0.0 || pivot.is_nan() {
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
