//! The discrete adjoint in blocks.

use super::LinearSystem;
use super::tile::Tile;
use super::workspace::{Ends, Maps, Workspace};
use crate::simd::{Arithmetic, Kernel, LANES, Row};
use crate::system::State;

/// Arguments of one adjoint solve.
pub(super) struct BlockAdjoint<'a> {
    pub nodal: LinearSystem<'a>,
    pub displacement: &'a [f64],
    pub velocity: &'a [f64],
    /// Derivative of the cost with respect to displacement and, if present, velocity.
    pub source: [Option<&'a [f64]>; 2],
    /// Gradient with respect to mass, damping, stiffness; overwritten.
    pub gradient: [&'a mut [f64]; 3],
    pub workspace: &'a mut Workspace,
}

impl Kernel for BlockAdjoint<'_> {
    type Output = State;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> State {
        let Self {
            nodal,
            displacement,
            velocity,
            source,
            mut gradient,
            workspace,
        } = self;
        let h = nodal.h;
        let steps = displacement.len() - 1;
        let scale = [1.0, 1.0 / h];
        let at = |i: usize| [0, 1].map(|q: usize| source[q].map_or(0.0, |s| s[i] * scale[q]));
        let mut x = at(steps);
        gradient.iter_mut().for_each(|g| g[steps] = 0.0);
        let (tiles, rest) = Tile::cut(steps);
        for i in (rest..steps).rev() {
            let response = [displacement[i], h * velocity[i]];
            nodal.step_back(i, response, at(i), &mut x, &mut gradient);
        }
        for tile in tiles.rev() {
            nodal.gather(arithmetic, tile, workspace);
            tile.gather(arithmetic, displacement, &mut workspace.response[0]);
            tile.gather(arithmetic, velocity, &mut workspace.response[1]);
            let last = match source {
                [Some(y), None] => {
                    tile.gather(arithmetic, y, &mut workspace.source[0]);
                    back::<A, false>(arithmetic, h, tile, workspace, &mut x)
                }
                _ => {
                    for (values, rows) in source.iter().zip(&mut workspace.source) {
                        match values {
                            Some(values) => tile.gather(arithmetic, values, rows),
                            None => rows[..tile.length].fill([0.0; LANES]),
                        }
                    }
                    back::<A, true>(arithmetic, h, tile, workspace, &mut x)
                }
            };
            let behind = collect(arithmetic, tile, workspace, &last, &mut gradient);
            for (g, share) in gradient.iter_mut().zip(behind) {
                g[tile.node(LANES, 0)] += share;
            }
        }
        State {
            displacement: x[0],
            velocity: h * x[1],
        }
    }
}

/// Gradient of one tile in SIMD layout; integrates the adjoint state `x` over the tile.
#[inline(always)]
fn back<A: Arithmetic, const VELOCITY: bool>(
    arithmetic: A,
    h: f64,
    tile: Tile,
    workspace: &mut Workspace,
    x: &mut [f64; 2],
) -> [Row; 3] {
    let maps = workspace.prepare(arithmetic, h, tile.length);
    let driven = workspace.drive::<A, VELOCITY>(arithmetic, h, tile.length);
    let ends = ends(&maps, &driven, x);
    workspace.adjoint_pass::<A, VELOCITY>(arithmetic, h, tile.length, &ends)
}

/// Copies the gradient of a tile from its SIMD layout; returns the contribution to the node after the tile.
#[inline(always)]
pub(super) fn collect<A: Arithmetic>(
    arithmetic: A,
    tile: Tile,
    workspace: &Workspace,
    last: &[Row; 3],
    gradient: &mut [&mut [f64]; 3],
) -> [f64; 3] {
    for ((g, rows), last) in gradient.iter_mut().zip(&workspace.gradient).zip(last) {
        tile.scatter(arithmetic, rows, g);
        for (b, share) in last[..LANES - 1].iter().enumerate() {
            g[tile.node(b + 1, 0)] += share;
        }
    }
    [last[0][LANES - 1], last[1][LANES - 1], last[2][LANES - 1]]
}

/// Adjoint states at the ends of all blocks, by recursion from `x` after the last block to the first; `x` becomes the state
/// before the first.
#[inline(always)]
pub(super) fn ends(maps: &Maps, driven: &Ends, x: &mut [f64; 2]) -> Ends {
    let mut ends = [[[0.0; LANES]; 2]; 2];
    for b in (0..LANES).rev() {
        for half in [1, 0] {
            ends[half][0][b] = x[0];
            ends[half][1][b] = x[1];
            // Rows of the transposed map: images of (1, 0) and (0, 1).
            *x = [0, 1].map(|q: usize| {
                let [y, w] = &maps[half][q];
                y[b] * x[0] + w[b] * x[1] + driven[half][q][b]
            });
        }
    }
    ends
}
