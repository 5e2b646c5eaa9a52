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
//! large ones do not cancel. Only the laws of the controls are stored.

use super::hessian::{BLOCKS, CONTROLS, CostToGo, UNITS, block};
use super::rows::StageRows;
use super::transitions::{NONE, Transitions, dot};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES};

/// Laws of the controls at all stages, and the cost-to-go of the first state. `X` states, a multiple of [`LANES`]; the others of the `W`
/// coordinates are controls.
pub(super) struct Factor<const X: usize, const W: usize> {
    stages: usize,
    /// Controls in use.
    controls: usize,
    /// For each stage and control `K` of its law `u = offset - K x`, and the coefficients of the earlier controls in its pivot row, over
    /// the pivot.
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

impl<const X: usize, const W: usize> Factor<X, W> {
    /// Solves the pivot rows of stage `i` for the controls: `u_c = offset_c - K_c x`, with the earlier controls substituted.
    #[inline(always)]
    fn substitute<A: Arithmetic>(&mut self, arithmetic: A, i: usize) {
        let gains = &mut self.gains[i * self.controls..(i + 1) * self.controls];
        for c in 1..gains.len() {
            let (earlier, rest) = gains.split_at_mut(c);
            let gain = &mut rest[0];
            for b in 0..X / LANES {
                let mut row = Eight::load(arithmetic, block(gain, b));
                for (other, solved) in earlier.iter().enumerate() {
                    let factor = Eight::splat(arithmetic, gain[(X + other) % W]);
                    row = row - factor * Eight::load(arithmetic, block(solved, b));
                }
                gain[b * LANES..(b + 1) * LANES].copy_from_slice(&row.row());
            }
        }
    }

    /// Sets the controls of stage `i` at zero states, for the gradients `slopes` in the controls.
    #[inline(always)]
    fn set_offsets(&mut self, i: usize, mut slopes: [f64; CONTROLS]) {
        let at = i * self.controls..(i + 1) * self.controls;
        let (gains, inverses) = (&self.gains[at.clone()], &self.inverses[at.clone()]);
        let offsets = &mut self.offsets[at];
        for c in (0..offsets.len()).rev() {
            let slope = slopes[c % CONTROLS];
            for other in 0..c {
                slopes[other % CONTROLS] -= slope * gains[c][(X + other) % W];
            }
            offsets[c] = -slope * inverses[c];
        }
        for c in 0..offsets.len() {
            for other in 0..c {
                offsets[c] -= gains[c][(X + other) % W] * offsets[other];
            }
        }
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
            factor.substitute(arithmetic, i);
            cost = h.states();
        }
        factor.first = cost;
        true
    }
}

struct Backward<'a, const X: usize, const W: usize> {
    factor: &'a mut Factor<X, W>,
    transitions: &'a Transitions<W>,
    q: &'a [[f64; W]],
}

impl<const X: usize, const W: usize> Kernel for Backward<'_, X, W> {
    type Output = [f64; X];

    /// `p_i = q_x + F_x' p_{i+1} - sum_c h_c K_c` with the gradients `h = q_u + F_u' p_{i+1}` in the controls: no control waits for
    /// another one.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "blocks of several arrays at once"
    )]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [f64; X] {
        let Self {
            factor,
            transitions,
            q,
        } = self;
        let controls = factor.controls;
        let load = |row: &[f64], b: usize| Eight::load(arithmetic, block(row, b));
        let mut p = [0.0; X];
        let mut own = [[0.0; LANES]; BLOCKS];
        for state in transitions.responses..transitions.states() {
            own[state / LANES % BLOCKS][state % LANES] = 1.0;
        }
        for (i, q) in q.iter().enumerate().rev() {
            let mut h = [Eight::splat(arithmetic, 0.0); BLOCKS];
            let mut slopes = [0.0; CONTROLS];
            slopes[..W - X].copy_from_slice(&q[X..]);
            for b in 0..X / LANES {
                h[b] = load(q, b);
            }
            if i + 1 < factor.stages {
                for b in 0..X / LANES {
                    h[b] += Eight::load(arithmetic, &own[b]) * load(&p, b);
                }
                for (k, next) in transitions.next.iter().enumerate() {
                    let p = p[(transitions.responses + k) % X];
                    if *next < X {
                        let unit = Eight::load(arithmetic, &UNITS[*next % LANES]);
                        h[*next / LANES % BLOCKS] += Eight::splat(arithmetic, p) * unit;
                    } else if *next != NONE {
                        slopes[(*next - X) % CONTROLS] += p;
                    }
                }
                for (p, step) in p.iter().zip(transitions.step(i)) {
                    for b in 0..X / LANES {
                        h[b] += Eight::splat(arithmetic, *p) * load(step, b);
                    }
                    for (slope, a) in slopes.iter_mut().zip(&step[X..]) {
                        *slope += p * a;
                    }
                }
            }
            let gains = &factor.gains[i * controls..(i + 1) * controls];
            for (gain, slope) in gains.iter().zip(&slopes) {
                for b in 0..X / LANES {
                    h[b] = h[b] - Eight::splat(arithmetic, *slope) * load(gain, b);
                }
            }
            for b in 0..X / LANES {
                p[b * LANES..(b + 1) * LANES].copy_from_slice(&h[b].row());
            }
            factor.set_offsets(i, slopes);
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
        let controls = factor.controls;
        let mut x = first;
        for (i, out) in xi.iter_mut().enumerate() {
            let mut xi = [0.0; W];
            xi[..X].copy_from_slice(&x);
            let at = i * controls..(i + 1) * controls;
            let laws = factor.gains[at.clone()].iter().zip(&factor.offsets[at]);
            for (u, (gain, offset)) in xi[X..].iter_mut().zip(laws) {
                *u = offset - dot(&gain[..X], &x);
            }
            *out = xi;
            if i + 1 < factor.stages {
                x = transitions.forward(i, &xi);
            }
        }
    }
}
