//! The forward solve in blocks.

use super::LinearSystem;
use super::tile::Tile;
use super::workspace::{Ends, Maps, Workspace};
use crate::simd::{Arithmetic, Kernel, LANES};
use crate::system::State;

/// Arguments of one forward solve.
pub(super) struct BlockForward<'a> {
    pub nodal: LinearSystem<'a>,
    pub initial: State,
    pub displacement: &'a mut [f64],
    pub velocity: &'a mut [f64],
    pub workspace: &'a mut Workspace,
}

impl Kernel for BlockForward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Self {
            nodal,
            displacement,
            velocity,
            workspace,
            ..
        } = self;
        let h = nodal.h;
        let steps = displacement.len() - 1;
        let mut x = [self.initial.displacement, h * self.initial.velocity];
        let (tiles, rest) = Tile::cut(steps);
        for tile in tiles {
            nodal.gather(arithmetic, tile, workspace);
            let maps = workspace.prepare(arithmetic, h, tile.length);
            let starts = starts(&maps, &mut x);
            workspace.response_pass(arithmetic, h, tile.length, &starts);
            tile.scatter(arithmetic, &workspace.response[0], displacement);
            tile.scatter(arithmetic, &workspace.response[1], velocity);
        }
        for i in rest..=steps {
            (displacement[i], velocity[i]) = (x[0], x[1] * nodal.constants().per_h);
            if i < steps {
                x = nodal.rates(i).forward(x, nodal.constants());
            }
        }
    }
}

/// States at the starts of all blocks, by recursion from `x`, which becomes the state at the end.
#[inline(always)]
pub(super) fn starts(maps: &Maps, x: &mut [f64; 2]) -> Ends {
    let mut starts = [[[0.0; LANES]; 2]; 2];
    for b in 0..LANES {
        for half in 0..2 {
            let [from_y, from_w] = &maps[half];
            starts[half][0][b] = x[0];
            starts[half][1][b] = x[1];
            *x = [0, 1].map(|q: usize| from_y[q][b] * x[0] + from_w[q][b] * x[1]);
        }
    }
    starts
}
