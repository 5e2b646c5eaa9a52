//! One tile in lanes: storage that is used again and again, and the passes over it.

use super::step::{Constants, NodeCoefficients, StepRates};
use super::tile::LONGEST;
use crate::simd::{Arithmetic, Eight, LANES, Row};
use std::cell::RefCell;

/// One row a node.
type NodeRows = [Row; LONGEST + 1];

/// A state in every lane, at the ends of both halves.
pub(super) type Ends = [[Row; 2]; 2];

/// The maps of both halves of every lane, from the state at the start of a half to that at its end, by
/// columns: what becomes of `(1, 0)` and of `(0, 1)`.
pub(super) type Maps = [[[Row; 2]; 2]; 2];

/// What becomes of any state at the start of a block: the block's map, and half the derivative of the sum of the
/// squares of its residuals, `H x - g`, with respect to that state.
pub(super) struct BlockMap {
    pub maps: Maps,
    /// `H` of both halves: its diagonal, then what stands beside it.
    curvature: [[Row; 3]; 2],
    /// `g` of both halves.
    slope: [[Row; 2]; 2],
}

impl BlockMap {
    /// `factor (H x - g)`: the adjoint state at the start of every block that is zero at its end.
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

/// A tile in lanes.
pub(super) struct Workspace {
    /// Mass, damping, stiffness.
    pub functions: [NodeRows; 3],
    /// The six numbers of every step's [`StepRates`].
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

/// Does something with this thread's workspace.
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

    /// The adjoint state before step `j`, from that after it.
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

    /// StepRates of all steps from the functions, and the maps of all blocks.
    #[inline(always)]
    pub fn prepare<A: Arithmetic>(&mut self, arithmetic: A, h: f64, length: usize) -> Maps {
        let of = Constants::new(h).in_lanes(arithmetic);
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

    /// The charts of all blocks, from the functions and from samples in place of the source. With `KEEP`
    /// the rates of all steps are kept as well.
    #[inline(always)]
    pub fn survey<A: Arithmetic, const KEEP: bool>(
        &mut self,
        arithmetic: A,
        h: f64,
        length: usize,
    ) -> BlockMap {
        let of = Constants::new(h).in_lanes(arithmetic);
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
        let mut chart = BlockMap {
            maps: [[[empty; 2]; 2]; 2],
            curvature: [[empty; 3]; 2],
            slope: [[empty; 2]; 2],
        };
        for block in 0..2 {
            let [from_y, from_w] = map[block];
            chart.maps[block] = [
                [from_y[0].row(), from_y[1].row()],
                [from_w[0].row(), from_w[1].row()],
            ];
            let [yy, ww, yw] = curvature[block];
            chart.curvature[block] = [yy.row(), ww.row(), yw.row()];
            let [gy, gw] = slope[block];
            chart.slope[block] = [gy.row(), gw.row()];
        }
        chart
    }

    /// StepRates of all steps from the functions.
    #[inline(always)]
    pub fn prepare_rates<A: Arithmetic>(&mut self, arithmetic: A, h: f64, length: usize) {
        let of = Constants::new(h).in_lanes(arithmetic);
        let mut left = self.coefficients(arithmetic, 0, of);
        for j in 0..length {
            let right = self.coefficients(arithmetic, j + 1, of);
            self.keep_rates(j, &StepRates::new(left, right, of));
            left = right;
        }
    }

    /// The response in all blocks from their starts.
    #[inline(always)]
    pub fn replay<A: Arithmetic>(&mut self, arithmetic: A, h: f64, length: usize, starts: &Ends) {
        let of = Constants::new(h).in_lanes(arithmetic);
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

    /// From samples in place of the source: their residuals `r = y - sample`, the source
    /// `factor r`, and the sum of the squares `r^2` in every lane.
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

    /// The adjoint state at the start of every block that is zero at its end. `VELOCITY`: whether the
    /// source has a part at the velocity.
    #[inline(always)]
    pub fn drive<A: Arithmetic, const VELOCITY: bool>(
        &self,
        arithmetic: A,
        h: f64,
        length: usize,
    ) -> Ends {
        let of = Constants::new(h).in_lanes(arithmetic);
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

    /// The adjoint in all blocks from their ends, and the gradient of all steps at the nodes `0..length`;
    /// returns what belongs to the node after each lane.
    #[inline(always)]
    pub fn replay_back<A: Arithmetic, const VELOCITY: bool>(
        &mut self,
        arithmetic: A,
        h: f64,
        length: usize,
        ends: &Ends,
    ) -> [Row; 3] {
        let of = Constants::new(h).in_lanes(arithmetic);
        let scale = [of.per_h, of.one, of.h];
        let mut x = load(arithmetic, ends);
        // Share of the node to the right so far, and of the node after each half.
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
