//! Storage of one tile in SIMD layout, and the passes over it.

use super::step::{Constants, NodeCoefficients, StepRates};
use super::tile::LONGEST;
use crate::simd::{Arithmetic, Eight, LANES, Row};
use std::cell::RefCell;

/// One row per node.
type NodeRows = [Row; LONGEST + 1];

/// One state per lane, at the ends of both halves.
pub(super) type Ends = [[Row; 2]; 2];

/// Maps of both halves of every lane, from the state at the start of a half to that at its end, by columns: the images of
/// `(1, 0)` and `(0, 1)`.
pub(super) type Maps = [[[Row; 2]; 2]; 2];

/// Map of a block, and half the derivative `H x - g` of its sum of squared residuals with respect to the state `x` at its
/// start.
pub(super) struct BlockMap {
    pub maps: Maps,
    /// `H` of both halves: diagonal, then off-diagonal entry.
    curvature: [[Row; 3]; 2],
    /// `g` of both halves.
    slope: [[Row; 2]; 2],
}

impl BlockMap {
    /// Adjoint states `factor (H x - g)` at the starts of all blocks, for adjoint states of zero at their ends.
    pub fn driven(&self, starts: &Ends, factor: f64) -> Ends {
        let mut driven = [[[0.0; LANES]; 2]; 2];
        for (half, [dy, dw]) in driven.iter_mut().enumerate() {
            let ([y, w], [gy, gw]) = (&starts[half], &self.slope[half]);
            let [yy, ww, yw] = &self.curvature[half];
            for b in 0..LANES {
                dy[b] = factor * (yy[b] * y[b] + yw[b] * w[b] - gy[b]);
                dw[b] = factor * (yw[b] * y[b] + ww[b] * w[b] - gw[b]);
            }
        }
        driven
    }
}

/// A tile in SIMD layout.
pub(super) struct Workspace {
    /// Mass, damping, stiffness.
    pub functions: [NodeRows; 3],
    /// The six numbers of each step's [`StepRates`].
    rates: [NodeRows; 6],
    /// Displacement and velocity.
    pub response: [NodeRows; 2],
    /// Derivative of the cost with respect to displacement and velocity.
    pub source: [NodeRows; 2],
    /// Gradient with respect to the functions.
    pub gradient: [NodeRows; 3],
}

thread_local! {
    static WORKSPACE: RefCell<Box<Workspace>> = RefCell::default();
}

impl Default for Workspace {
    fn default() -> Self {
        let empty = [[0.0; LANES]; LONGEST + 1];
        Self {
            functions: [empty; 3],
            rates: [empty; 6],
            response: [empty; 2],
            source: [empty; 2],
            gradient: [empty; 3],
        }
    }
}

/// Calls `act` with the workspace of the thread.
pub(super) fn with_workspace<R>(act: impl FnOnce(&mut Workspace) -> R) -> R {
    WORKSPACE.with_borrow_mut(|workspace| act(workspace))
}

impl Workspace {
    #[inline(always)]
    fn coefficients<A: Arithmetic>(
        &self,
        arithmetic: A,
        j: usize,
        of: Constants<Eight<A>>,
    ) -> NodeCoefficients<Eight<A>> {
        let [m, c, k] = &self.functions;
        NodeCoefficients {
            m: Eight::load(arithmetic, &m[j]),
            c: Eight::load(arithmetic, &c[j]),
            hk: of.h * Eight::load(arithmetic, &k[j]),
        }
    }

    #[inline(always)]
    fn rates<A: Arithmetic>(&self, arithmetic: A, j: usize) -> StepRates<Eight<A>> {
        let [alpha, beta, gamma, delta, left, middle] = &self.rates;
        StepRates {
            alpha: Eight::load(arithmetic, &alpha[j]),
            beta: Eight::load(arithmetic, &beta[j]),
            gamma: Eight::load(arithmetic, &gamma[j]),
            delta: Eight::load(arithmetic, &delta[j]),
            mobility: [
                Eight::load(arithmetic, &left[j]),
                Eight::load(arithmetic, &middle[j]),
            ],
        }
    }

    #[inline(always)]
    fn keep_rates<A: Arithmetic>(&mut self, j: usize, rates: &StepRates<Eight<A>>) {
        let [alpha, beta, gamma, delta, left, middle] = &mut self.rates;
        alpha[j] = rates.alpha.row();
        beta[j] = rates.beta.row();
        gamma[j] = rates.gamma.row();
        delta[j] = rates.delta.row();
        left[j] = rates.mobility[0].row();
        middle[j] = rates.mobility[1].row();
    }

    /// Adjoint state before step `j`, from that after it.
    #[inline(always)]
    fn backward<A: Arithmetic, const VELOCITY: bool>(
        &self,
        rates: &StepRates<Eight<A>>,
        j: usize,
        x: [Eight<A>; 2],
        arithmetic: A,
        of: Constants<Eight<A>>,
    ) -> [Eight<A>; 2] {
        let [y, w] = rates.backward(x, of);
        let y = y + Eight::load(arithmetic, &self.source[0][j]);
        match VELOCITY {
            true => [
                y,
                w + of.per_h * Eight::load(arithmetic, &self.source[1][j]),
            ],
            false => [y, w],
        }
    }

    /// Computes the rates of all steps and the maps of all blocks.
    #[inline(always)]
    pub fn prepare<A: Arithmetic>(&mut self, arithmetic: A, h: f64, length: usize) -> Maps {
        let of = Constants::new(h).splat(arithmetic);
        let mut left = self.coefficients(arithmetic, 0, of);
        let mut maps = [[[[0.0; LANES]; 2]; 2]; 2];
        for (half, map) in maps.iter_mut().enumerate() {
            let first = half * (length / 2);
            let mut from_y = [of.one, of.zero];
            let mut from_w = [of.zero, of.one];
            for j in first..first + length / 2 {
                let right = self.coefficients(arithmetic, j + 1, of);
                let rates = StepRates::new(left, right, of);
                self.keep_rates(j, &rates);
                let increment = rates.increment(of);
                from_y = increment.forward(from_y);
                from_w = increment.forward(from_w);
                left = right;
            }
            *map = [
                [from_y[0].row(), from_y[1].row()],
                [from_w[0].row(), from_w[1].row()],
            ];
        }
        maps
    }

    /// Block maps of all blocks, from the functions and from samples in place of the source. `KEEP` stores the rates of all
    /// steps.
    #[inline(always)]
    pub fn first_pass<A: Arithmetic, const KEEP: bool>(
        &mut self,
        arithmetic: A,
        h: f64,
        length: usize,
    ) -> BlockMap {
        let of = Constants::new(h).splat(arithmetic);
        let half = length / 2;
        let mut left = [
            self.coefficients(arithmetic, 0, of),
            self.coefficients(arithmetic, half, of),
        ];
        let mut map = [[[of.one, of.zero], [of.zero, of.one]]; 2];
        let mut curvature = [[of.zero; 3]; 2];
        let mut slope = [[of.zero; 2]; 2];
        for i in 0..half {
            for block in 0..2 {
                let j = block * half + i;
                let sample = Eight::load(arithmetic, &self.source[0][j]);
                let [from_y, from_w] = &mut map[block];
                let [yy, ww, yw] = &mut curvature[block];
                *yy += from_y[0] * from_y[0];
                *ww += from_w[0] * from_w[0];
                *yw += from_y[0] * from_w[0];
                slope[block][0] += from_y[0] * sample;
                slope[block][1] += from_w[0] * sample;
                let right = self.coefficients(arithmetic, j + 1, of);
                let rates = StepRates::new(left[block], right, of);
                if KEEP {
                    self.keep_rates(j, &rates);
                }
                let increment = rates.increment(of);
                *from_y = increment.forward(*from_y);
                *from_w = increment.forward(*from_w);
                left[block] = right;
            }
        }
        let empty = [0.0; LANES];
        let mut block_map = BlockMap {
            maps: [[[empty; 2]; 2]; 2],
            curvature: [[empty; 3]; 2],
            slope: [[empty; 2]; 2],
        };
        for block in 0..2 {
            let [from_y, from_w] = map[block];
            block_map.maps[block] = [
                [from_y[0].row(), from_y[1].row()],
                [from_w[0].row(), from_w[1].row()],
            ];
            let [yy, ww, yw] = curvature[block];
            block_map.curvature[block] = [yy.row(), ww.row(), yw.row()];
            let [gy, gw] = slope[block];
            block_map.slope[block] = [gy.row(), gw.row()];
        }
        block_map
    }

    /// Computes the rates of all steps from the functions.
    #[inline(always)]
    pub fn prepare_rates<A: Arithmetic>(&mut self, arithmetic: A, h: f64, length: usize) {
        let of = Constants::new(h).splat(arithmetic);
        let mut left = self.coefficients(arithmetic, 0, of);
        for j in 0..length {
            let right = self.coefficients(arithmetic, j + 1, of);
            self.keep_rates(j, &StepRates::new(left, right, of));
            left = right;
        }
    }

    /// Response in all blocks from their initial states.
    #[inline(always)]
    pub fn response_pass<A: Arithmetic>(
        &mut self,
        arithmetic: A,
        h: f64,
        length: usize,
        starts: &Ends,
    ) {
        let of = Constants::new(h).splat(arithmetic);
        let mut x = load(arithmetic, starts);
        for i in 0..length / 2 {
            for (half, x) in x.iter_mut().enumerate() {
                let j = half * (length / 2) + i;
                self.response[0][j] = x[0].row();
                self.response[1][j] = (x[1] * of.per_h).row();
                *x = self.rates(arithmetic, j).forward(*x, of);
            }
        }
    }

    /// Residuals `r = y - sample`, from samples in place of the source; replaces the source by `factor r` and returns the sum
    /// of `r^2` in each lane.
    #[inline(always)]
    pub fn compare<A: Arithmetic>(&mut self, arithmetic: A, length: usize, factor: f64) -> Row {
        let factor = Eight::splat(arithmetic, factor);
        let mut sums = [Eight::splat(arithmetic, 0.0); 2];
        for i in 0..length / 2 {
            for (odd, sum) in sums.iter_mut().enumerate() {
                let j = 2 * i + odd;
                let y = Eight::load(arithmetic, &self.response[0][j]);
                let r = y - Eight::load(arithmetic, &self.source[0][j]);
                *sum += r * r;
                self.source[0][j] = (factor * r).row();
            }
        }
        (sums[0] + sums[1]).row()
    }

    /// Adjoint states at the starts of all blocks for states of zero at their ends. `VELOCITY` is true if the source has a
    /// velocity part.
    #[inline(always)]
    pub fn drive<A: Arithmetic, const VELOCITY: bool>(
        &self,
        arithmetic: A,
        h: f64,
        length: usize,
    ) -> Ends {
        let of = Constants::new(h).splat(arithmetic);
        let mut x = [[of.zero; 2]; 2];
        for i in (0..length / 2).rev() {
            for (half, x) in x.iter_mut().enumerate() {
                let j = half * (length / 2) + i;
                let rates = self.rates(arithmetic, j);
                *x = self.backward::<A, VELOCITY>(&rates, j, *x, arithmetic, of);
            }
        }
        [
            [x[0][0].row(), x[0][1].row()],
            [x[1][0].row(), x[1][1].row()],
        ]
    }

    /// Adjoint in all blocks from their ends, and the gradient of all steps at the nodes `0..length`; returns the contribution
    /// to the node after each lane.
    #[inline(always)]
    pub fn adjoint_pass<A: Arithmetic, const VELOCITY: bool>(
        &mut self,
        arithmetic: A,
        h: f64,
        length: usize,
        ends: &Ends,
    ) -> [Row; 3] {
        let of = Constants::new(h).splat(arithmetic);
        let scale = [of.per_h, of.one, of.h];
        let mut x = load(arithmetic, ends);
        // Contributions to the right node so far, and to the node after each half.
        let mut after = [[of.zero; 3]; 2];
        let mut last = [[of.zero; 3]; 2];
        for i in (0..length / 2).rev() {
            for half in 0..2 {
                let j = half * (length / 2) + i;
                let rates = self.rates(arithmetic, j);
                let response = [
                    Eight::load(arithmetic, &self.response[0][j]),
                    of.h * Eight::load(arithmetic, &self.response[1][j]),
                ];
                let (node, middle) = rates.shares(response, x[half], of);
                for f in 0..3 {
                    let right = after[half][f] + middle[f];
                    if i + 1 == length / 2 {
                        last[half][f] = right;
                    } else {
                        self.gradient[f][j + 1] = (right * scale[f]).row();
                    }
                    after[half][f] = node[f] + middle[f];
                }
                x[half] = self.backward::<A, VELOCITY>(&rates, j, x[half], arithmetic, of);
            }
        }
        for f in 0..3 {
            self.gradient[f][0] = (after[0][f] * scale[f]).row();
            self.gradient[f][length / 2] = ((after[1][f] + last[0][f]) * scale[f]).row();
        }
        [
            (last[1][0] * scale[0]).row(),
            (last[1][1] * scale[1]).row(),
            (last[1][2] * scale[2]).row(),
        ]
    }
}

#[inline(always)]
fn load<A: Arithmetic>(arithmetic: A, ends: &Ends) -> [[Eight<A>; 2]; 2] {
    let [[a, b], [c, d]] = ends;
    [
        [Eight::load(arithmetic, a), Eight::load(arithmetic, b)],
        [Eight::load(arithmetic, c), Eight::load(arithmetic, d)],
    ]
}
