//! Cost and gradient in two passes over the record, for displacement samples at every node.
//!
//! The cost of a block is a quadratic function of the state at its start. The first pass computes for each block its map
//! and the derivative of that function, with all tiles independent. The states between blocks follow by a forward
//! recursion, the adjoint states by a backward one. The second pass, again with independent tiles, computes response,
//! adjoint and gradient tile by tile and stores the gradient alone. Long records are divided between two threads; the
//! results of a tile do not depend on the thread.

use super::LinearSystem;
use super::adjoint::{collect, ends};
use super::forward::starts;
use super::tile::Tile;
use super::workspace::{BlockMap, Ends, Workspace, with_workspace};
use crate::simd::{self, Arithmetic, Kernel, LANES};
use crate::system::State;
use crate::threads;

/// Number of tiles from which a second thread reduces the time: starting it takes as long as about three tiles, twice.
const WORTH_A_THREAD: usize = 24;

/// The cost `J = sum_i w_i (y_i - sample_i)^2` over all nodes.
#[derive(Clone, Copy)]
pub(super) struct LeastSquares<'a> {
    pub nodal: LinearSystem<'a>,
    pub initial: State,
    /// One sample per node, m.
    pub samples: &'a [f64],
    /// Weights `w_i` of inner nodes, and of both ends.
    pub weights: [f64; 2],
}

/// A tile with the states at the starts of its blocks, and the adjoint states at their ends.
pub(super) struct TileStates {
    tile: Tile,
    starts: Ends,
    ends: Ends,
}

/// First pass over some tiles.
pub(super) struct FirstPass<'a> {
    pub of: LeastSquares<'a>,
    pub tiles: &'a [Tile],
    pub workspace: &'a mut Workspace,
}

impl Kernel for FirstPass<'_> {
    type Output = Vec<BlockMap>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<BlockMap> {
        let Self {
            of,
            tiles,
            workspace,
        } = self;
        let mut block_maps = Vec::with_capacity(tiles.len());
        for tile in tiles {
            of.nodal.gather(arithmetic, *tile, workspace);
            tile.gather(arithmetic, of.samples, &mut workspace.source[0]);
            block_maps.push(match tiles.len() {
                1 => workspace.first_pass::<A, true>(arithmetic, of.nodal.h, tile.length),
                _ => workspace.first_pass::<A, false>(arithmetic, of.nodal.h, tile.length),
            });
        }
        block_maps
    }
}

/// Second pass over some tiles.
pub(super) struct SecondPass<'a> {
    pub of: LeastSquares<'a>,
    pub tile_states: &'a [TileStates],
    /// Gradient with respect to mass, damping, stiffness, from the first node of the tiles to the last one; overwritten.
    pub gradient: [&'a mut [f64]; 3],
    /// True if `workspace` still holds the step rates of the only tile.
    pub rates_kept: bool,
    pub workspace: &'a mut Workspace,
}

/// Results of the second pass over a tile, besides the gradient.
pub(super) struct TileResult {
    /// Sum of squared residuals.
    squares: f64,
    /// Contribution to the gradient at the node after the tile.
    behind: [f64; 3],
}

impl Kernel for SecondPass<'_> {
    type Output = Vec<TileResult>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<TileResult> {
        let Self {
            of,
            tile_states,
            mut gradient,
            rates_kept,
            workspace,
        } = self;
        let mut result = Vec::with_capacity(tile_states.len());
        let Some(start) = tile_states.first().map(|tile_state| tile_state.tile.first) else {
            return result;
        };
        let (h, factor) = (of.nodal.h, of.factor());
        // Backwards: the last tile of the first pass is still in the cache.
        for TileStates { tile, starts, ends } in tile_states.iter().rev() {
            if !rates_kept {
                of.nodal.gather(arithmetic, *tile, workspace);
                workspace.prepare_rates(arithmetic, h, tile.length);
                tile.gather(arithmetic, of.samples, &mut workspace.source[0]);
            }
            workspace.response_pass(arithmetic, h, tile.length, starts);
            let squares = workspace.compare(arithmetic, tile.length, factor);
            let last = workspace.adjoint_pass::<A, false>(arithmetic, h, tile.length, ends);
            let within = Tile {
                first: tile.first - start,
                ..*tile
            };
            result.push(TileResult {
                squares: squares.iter().sum(),
                behind: collect(arithmetic, within, workspace, &last, &mut gradient),
            });
        }
        result.reverse();
        result
    }
}

/// States at the junctions of the tiles, and the results of the steps after the last tile.
pub(super) struct Junctions {
    pub tile_states: Vec<TileStates>,
    /// Sum of squared residuals after the last tile, including the last node.
    squares: f64,
    /// Residual at the last node.
    last: f64,
    /// Adjoint state at the first node.
    adjoint: [f64; 2],
}

impl LeastSquares<'_> {
    /// Cost and gradient: overwrites `gradient` with that with respect to the functions and returns that with respect to the
    /// initial state.
    pub fn solve(self, gradient: [&mut [f64]; 3]) -> (f64, State) {
        let tiles: Vec<Tile> = Tile::cut(self.steps()).0.collect();
        let middle = middle(tiles.len());
        self.solve_in_two(&tiles, middle, gradient)
    }

    /// As [`LeastSquares::solve`], with the tiles from number `middle` on, if any, on a second thread.
    pub fn solve_in_two(
        self,
        tiles: &[Tile],
        middle: usize,
        mut gradient: [&mut [f64]; 3],
    ) -> (f64, State) {
        let (of, at_once) = (self, middle < tiles.len());
        let rest = behind(tiles);
        let block_maps = both(tiles.split_at(middle), at_once, |tiles| {
            with_workspace(|workspace| {
                simd::run(FirstPass {
                    of,
                    tiles,
                    workspace,
                })
            })
        });
        let joint = self.join(tiles, &block_maps, &mut gradient);

        let (former, latter) = joint.tile_states.split_at(middle);
        let cut = latter
            .first()
            .map_or(rest, |tile_state| tile_state.tile.first);
        let [m, c, k] = gradient.each_mut().map(|g| g[..rest].split_at_mut(cut));
        let parts = ((former, [m.0, c.0, k.0]), (latter, [m.1, c.1, k.1]));
        let result = both(parts, at_once, |(tile_states, gradient)| {
            with_workspace(|workspace| {
                simd::run(SecondPass {
                    of,
                    tile_states,
                    gradient,
                    rates_kept: tiles.len() == 1 && !at_once,
                    workspace,
                })
            })
        });
        self.finish(&joint, &result, &mut gradient)
    }

    fn steps(&self) -> usize {
        self.samples.len() - 1
    }

    /// Factor `2 w` of the residual in the derivative of `w r^2`, at inner nodes.
    fn factor(&self) -> f64 {
        2.0 * self.weights[0]
    }

    /// States and adjoint states at all block boundaries, from the block maps; the steps after the last tile are done
    /// sequentially, with their gradient.
    pub fn join(
        &self,
        tiles: &[Tile],
        block_maps: &[BlockMap],
        gradient: &mut [&mut [f64]; 3],
    ) -> Junctions {
        let Self {
            nodal,
            initial,
            samples,
            weights: [_, outer],
        } = *self;
        let (h, steps, factor) = (nodal.h, self.steps(), self.factor());
        let mut x = [initial.displacement, h * initial.velocity];
        let starts: Vec<Ends> = block_maps.iter().map(|c| starts(&c.maps, &mut x)).collect();

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

        let mut tile_states = Vec::with_capacity(tiles.len());
        for ((tile, block_map), starts) in tiles.iter().zip(block_maps).zip(starts).rev() {
            let driven = block_map.driven(&starts, factor);
            tile_states.push(TileStates {
                tile: *tile,
                starts,
                ends: ends(&block_map.maps, &driven, &mut x),
            });
        }
        tile_states.reverse();
        Junctions {
            tile_states,
            squares,
            last,
            adjoint: x,
        }
    }

    /// Cost and gradient with respect to the initial state; completes the gradient at the nodes between tiles.
    pub fn finish(
        &self,
        joint: &Junctions,
        result: &[TileResult],
        gradient: &mut [&mut [f64]; 3],
    ) -> (f64, State) {
        let mut sum = 0.0;
        for (tile_state, got) in joint.tile_states.iter().zip(result) {
            sum += got.squares;
            for (g, share) in gradient.iter_mut().zip(got.behind) {
                g[tile_state.tile.node(LANES, 0)] += share;
            }
        }
        sum += joint.squares;
        let [inner, outer] = self.weights;
        let first = self.initial.displacement - self.samples[0];
        // Both ends were counted with the weight of inner nodes.
        let cost = inner * sum + (outer - inner) * (first * first + joint.last * joint.last);
        let [y, w] = joint.adjoint;
        let initial = State {
            displacement: y + 2.0 * (outer - inner) * first,
            velocity: self.nodal.h * w,
        };
        (cost, initial)
    }
}

/// Number of tiles in the first of two parts.
fn middle(tiles: usize) -> usize {
    match tiles >= WORTH_A_THREAD && threads::spare() {
        true => tiles / 2,
        false => tiles,
    }
}

/// Node after the last tile.
fn behind(tiles: &[Tile]) -> usize {
    tiles.last().map_or(0, |tile| tile.node(LANES, 0))
}

/// Applies `act` to both parts, `at_once` on two threads; otherwise the second part is empty.
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
