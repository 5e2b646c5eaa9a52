//! Cost and gradient in one go, for readings of the displacement at every node.

use super::LinearDevice;
use super::adjoint::{collect, ends};
use super::forward::starts;
use super::scratch::{Ends, Maps, Scratch};
use super::tile::Tile;
use crate::dynamics::State;
use crate::lanes::{Arithmetic, Kernel, LANES};

/// `J = sum_i w_i (y_i - reading_i)^2` over all nodes and its gradient.
///
/// The motion is not written down: the way back computes it again, tile by tile, from the
/// states between blocks. Only the last tile is still there.
pub(super) struct Squares<'a> {
    pub device: LinearDevice<'a>,
    pub initial: State,
    /// One a node.
    pub readings: &'a [f64],
    /// `w_i` at the inner nodes, and at both ends.
    pub weights: [f64; 2],
    /// Gradient with respect to mass, damping, stiffness: overwritten.
    pub gradient: [&'a mut [f64]; 3],
    pub scratch: &'a mut Scratch,
}

impl Kernel for Squares<'_> {
    /// The cost and its gradient with respect to the initial state.
    type Output = (f64, State);

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> (f64, State) {
        let Self {
            device,
            initial,
            readings,
            weights: [inner, outer],
            mut gradient,
            scratch,
        } = self;
        let (h, steps) = (device.h, readings.len() - 1);
        let factor = 2.0 * inner;
        let mut x = [initial.displacement, h * initial.velocity];
        let first = initial.displacement - readings[0];
        let mut sum = 0.0;
        let (tiles, rest) = Tile::cut(steps);
        let last_tile = tiles.len().wrapping_sub(1);
        let mut kept: Vec<(Maps, Ends)> = Vec::with_capacity(tiles.len());
        for tile in tiles {
            device.gather(arithmetic, tile, scratch);
            let maps = scratch.prepare(arithmetic, h, tile.length);
            let starts = starts(&maps, &mut x);
            scratch.replay(arithmetic, h, tile.length, &starts);
            tile.gather(arithmetic, readings, &mut scratch.source[0]);
            let squares = scratch.compare(arithmetic, tile.length, factor);
            sum += squares.iter().sum::<f64>();
            kept.push((maps, starts));
        }
        let mut motion = [[0.0; 2]; 2 * LANES];
        for i in rest..=steps {
            motion[i - rest] = x;
            let r = x[0] - readings[i];
            sum += r * r;
            if i < steps {
                x = device.rates(i).forward(x, device.constants());
            }
        }
        let last = x[0] - readings[steps];
        // Both ends have been counted like the others.
        let cost = inner * sum + (outer - inner) * (first * first + last * last);

        let mut x = [2.0 * outer * last, 0.0];
        gradient.iter_mut().for_each(|g| g[steps] = 0.0);
        for i in (rest..steps).rev() {
            let state = motion[i - rest];
            let source = [factor * (state[0] - readings[i]), 0.0];
            device.step_back(i, state, source, &mut x, &mut gradient);
        }
        let (tiles, _) = Tile::cut(steps);
        for (which, (tile, (maps, starts))) in tiles.zip(&kept).enumerate().rev() {
            if which < last_tile {
                device.gather(arithmetic, tile, scratch);
                scratch.prepare_rates(arithmetic, h, tile.length);
                scratch.replay(arithmetic, h, tile.length, starts);
                tile.gather(arithmetic, readings, &mut scratch.source[0]);
                scratch.compare(arithmetic, tile.length, factor);
            }
            let driven = scratch.drive::<A, false>(arithmetic, h, tile.length);
            let ends = ends(maps, &driven, &mut x);
            let last = scratch.replay_back::<A, false>(arithmetic, h, tile.length, &ends);
            collect(arithmetic, tile, scratch, &last, &mut gradient);
        }
        let initial = State {
            displacement: x[0] + 2.0 * (outer - inner) * first,
            velocity: h * x[1],
        };
        (cost, initial)
    }
}
