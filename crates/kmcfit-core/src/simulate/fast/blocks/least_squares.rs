//! Cost and gradient in one go, for samples of the displacement at every node.
//!
//! A block's share of the cost is a quadratic function of the state at its start. A first pass, in which no
//! tile waits for another, finds for every block its map and the derivative of that function; from these
//! follow the states between the blocks and, from the end back, the adjoint states there. A second pass, in
//! which again no tile waits for another, computes response, adjoint and gradient tile by tile and writes
//! nothing down but the gradient. Long records are shared by two threads; what a tile gives
//! does not depend on who computes it.

use super::LinearSystem;
use super::adjoint::{collect, ends};
use super::forward::starts;
use super::tile::Tile;
use super::workspace::{BlockMap, Ends, Workspace, with_workspace};
use crate::simd::{self, Arithmetic, Kernel, LANES};
use crate::system::State;
use crate::threads;

/// From so many tiles on, a second thread pays: to start it takes as long as some three tiles do, twice.
const WORTH_A_THREAD: usize = 24;

/// `J = sum_i w_i (y_i - reading_i)^2` over all nodes.
#[derive(Clone, Copy)]
pub(super) struct LeastSquares<'a> {
    pub nodal: LinearSystem<'a>,
    pub initial: State,
    /// One a node.
    pub samples: &'a [f64],
    /// `w_i` at the inner nodes, and at both ends.
    pub weights: [f64; 2],
}

/// A tile with the states at the starts of its blocks, and the adjoint states at their ends.
pub(super) struct Leg {
    tile: Tile,
    starts: Ends,
    ends: Ends,
}

/// The first pass, over some tiles.
pub(super) struct Survey<'a> {
    pub of: LeastSquares<'a>,
    pub tiles: &'a [Tile],
    pub workspace: &'a mut Workspace,
}

impl Kernel for Survey<'_> {
    type Output = Vec<BlockMap>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<BlockMap> {
        let Self {
            of,
            tiles,
            workspace,
        } = self;
        let mut charts = Vec::with_capacity(tiles.len());
        for tile in tiles {
            of.nodal.gather(arithmetic, *tile, workspace);
            tile.gather(arithmetic, of.samples, &mut workspace.source[0]);
            charts.push(match tiles.len() {
                1 => workspace.survey::<A, true>(arithmetic, of.nodal.h, tile.length),
                _ => workspace.survey::<A, false>(arithmetic, of.nodal.h, tile.length),
            });
        }
        charts
    }
}

/// The second pass, over some legs.
pub(super) struct Descent<'a> {
    pub of: LeastSquares<'a>,
    pub legs: &'a [Leg],
    /// With respect to mass, damping, stiffness from the first node of the legs to the one before the node
    /// that follows them: overwritten.
    pub gradient: [&'a mut [f64]; 3],
    /// Whether `workspace` has surveyed the only leg before.
    pub at_hand: bool,
    pub workspace: &'a mut Workspace,
}

/// What a leg gives besides its gradient.
pub(super) struct Harvest {
    /// Sum of the squares of its residuals.
    squares: f64,
    /// What belongs to the gradient at the node behind it.
    behind: [f64; 3],
}

impl Kernel for Descent<'_> {
    type Output = Vec<Harvest>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<Harvest> {
        let Self {
            of,
            legs,
            mut gradient,
            at_hand,
            workspace,
        } = self;
        let mut harvest = Vec::with_capacity(legs.len());
        let Some(start) = legs.first().map(|leg| leg.tile.first) else {
            return harvest;
        };
        let (h, factor) = (of.nodal.h, of.factor());
        // From the end: what the first pass has seen last is still near.
        for Leg { tile, starts, ends } in legs.iter().rev() {
            if !at_hand {
                of.nodal.gather(arithmetic, *tile, workspace);
                workspace.prepare_rates(arithmetic, h, tile.length);
                tile.gather(arithmetic, of.samples, &mut workspace.source[0]);
            }
            workspace.replay(arithmetic, h, tile.length, starts);
            let squares = workspace.compare(arithmetic, tile.length, factor);
            let last = workspace.replay_back::<A, false>(arithmetic, h, tile.length, ends);
            let within = Tile {
                first: tile.first - start,
                ..*tile
            };
            harvest.push(Harvest {
                squares: squares.iter().sum(),
                behind: collect(arithmetic, within, workspace, &last, &mut gradient),
            });
        }
        harvest.reverse();
        harvest
    }
}

/// What the few steps behind the last tile give, and what both passes are joined by.
pub(super) struct Joint {
    pub legs: Vec<Leg>,
    /// Sum of the squares of the residuals behind the last tile, the one at the last node included.
    squares: f64,
    /// Residual at the last node.
    last: f64,
    /// BlockAdjoint state at the first node.
    adjoint: [f64; 2],
}

impl LeastSquares<'_> {
    /// The cost, and its gradient: with respect to the functions it overwrites `gradient`, with respect to the
    /// initial state it is returned.
    pub fn solve(self, gradient: [&mut [f64]; 3]) -> (f64, State) {
        let tiles: Vec<Tile> = Tile::cut(self.steps()).0.collect();
        let middle = middle(tiles.len());
        self.solve_in_two(&tiles, middle, gradient)
    }

    /// The same, with the tiles from number `middle` on, if there are any, in a second thread.
    pub fn solve_in_two(
        self,
        tiles: &[Tile],
        middle: usize,
        mut gradient: [&mut [f64]; 3],
    ) -> (f64, State) {
        let (of, at_once) = (self, middle < tiles.len());
        let rest = behind(tiles);
        let charts = both(tiles.split_at(middle), at_once, |tiles| {
            with_workspace(|workspace| {
                simd::run(Survey {
                    of,
                    tiles,
                    workspace,
                })
            })
        });
        let joint = self.join(tiles, &charts, &mut gradient);

        let (former, latter) = joint.legs.split_at(middle);
        let cut = latter.first().map_or(rest, |leg| leg.tile.first);
        let [m, c, k] = gradient.each_mut().map(|g| g[..rest].split_at_mut(cut));
        let parts = ((former, [m.0, c.0, k.0]), (latter, [m.1, c.1, k.1]));
        let harvest = both(parts, at_once, |(legs, gradient)| {
            with_workspace(|workspace| {
                simd::run(Descent {
                    of,
                    legs,
                    gradient,
                    at_hand: tiles.len() == 1 && !at_once,
                    workspace,
                })
            })
        });
        self.finish(&joint, &harvest, &mut gradient)
    }

    fn steps(&self) -> usize {
        self.samples.len() - 1
    }

    /// `2 w`: times the residual it is the derivative of `w r^2`, between the ends.
    fn factor(&self) -> f64 {
        2.0 * self.weights[0]
    }

    /// States and adjoint states between all blocks, from their charts; the steps behind the last
    /// tile are done one by one, with their gradient.
    pub fn join(
        &self,
        tiles: &[Tile],
        charts: &[BlockMap],
        gradient: &mut [&mut [f64]; 3],
    ) -> Joint {
        let Self {
            nodal,
            initial,
            samples,
            weights: [_, outer],
        } = *self;
        let (h, steps, factor) = (nodal.h, self.steps(), self.factor());
        let mut x = [initial.displacement, h * initial.velocity];
        let starts: Vec<Ends> = charts.iter().map(|c| starts(&c.maps, &mut x)).collect();

        let rest = behind(tiles);
        let mut response = [[0.0; 2]; 2 * LANES];
        let mut squares = 0.0;
        for i in rest..=steps {
            response[i - rest] = x;
            let r = x[0] - samples[i];
            squares += r * r;
            if i < steps {
                x = nodal.rates(i).forward(x, nodal.constants());
            }
        }
        let last = x[0] - samples[steps];
        let mut x = [2.0 * outer * last, 0.0];
        gradient.iter_mut().for_each(|g| g[steps] = 0.0);
        for i in (rest..steps).rev() {
            let state = response[i - rest];
            let source = [factor * (state[0] - samples[i]), 0.0];
            nodal.step_back(i, state, source, &mut x, gradient);
        }

        let mut legs = Vec::with_capacity(tiles.len());
        for ((tile, chart), starts) in tiles.iter().zip(charts).zip(starts).rev() {
            let driven = chart.driven(&starts, factor);
            legs.push(Leg {
                tile: *tile,
                starts,
                ends: ends(&chart.maps, &driven, &mut x),
            });
        }
        legs.reverse();
        Joint {
            legs,
            squares,
            last,
            adjoint: x,
        }
    }

    /// Cost and gradient with respect to the initial state; the gradient is completed at the nodes
    /// between legs.
    pub fn finish(
        &self,
        joint: &Joint,
        harvest: &[Harvest],
        gradient: &mut [&mut [f64]; 3],
    ) -> (f64, State) {
        let mut sum = 0.0;
        for (leg, got) in joint.legs.iter().zip(harvest) {
            sum += got.squares;
            for (g, share) in gradient.iter_mut().zip(got.behind) {
                g[leg.tile.node(LANES, 0)] += share;
            }
        }
        sum += joint.squares;
        let [inner, outer] = self.weights;
        let first = self.initial.displacement - self.samples[0];
        // Both ends have been counted like the others.
        let cost = inner * sum + (outer - inner) * (first * first + joint.last * joint.last);
        let [y, w] = joint.adjoint;
        let initial = State {
            displacement: y + 2.0 * (outer - inner) * first,
            velocity: self.nodal.h * w,
        };
        (cost, initial)
    }
}

/// Where to cut so many tiles in two.
fn middle(tiles: usize) -> usize {
    match tiles >= WORTH_A_THREAD && threads::spare() {
        true => tiles / 2,
        false => tiles,
    }
}

/// The node behind the last tile.
fn behind(tiles: &[Tile]) -> usize {
    tiles.last().map_or(0, |tile| tile.node(LANES, 0))
}

/// Does the same to both parts, `at_once` in two threads; otherwise the second is empty.
fn both<P: Send, T: Send>(
    (former, latter): (P, P),
    at_once: bool,
    act: impl Fn(P) -> Vec<T> + Sync,
) -> Vec<T> {
    if !at_once {
        return act(former);
    }
    let (mut all, more) = threads::both(|| act(former), || act(latter));
    all.extend(more);
    all
}
