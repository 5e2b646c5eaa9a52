//! The accelerations at eight neighbouring nodes: what an accelerometer sampled with the grid sees.

use super::maps::FUNCTIONS;
use super::{Device, Oscillator, Surroundings, Trajectory, window};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row};

/// Accelerations at eight nodes and their derivatives, one node a lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Accelerations {
    /// The accelerations of `y`, relative to the base.
    pub value: Row,
    /// Derivatives with respect to displacement and velocity at the node.
    pub states: [Row; 2],
    /// Derivatives with respect to each function's value at the node, mass first.
    pub functions: [Row; FUNCTIONS],
}

impl Accelerations {
    pub const NOTHING: Self = Self {
        value: [0.0; LANES],
        states: [[0.0; LANES]; 2],
        functions: [[0.0; LANES]; FUNCTIONS],
    };
}

impl Oscillator {
    /// Calls `give` with the accelerations at the nodes `from`, `from + 8`, ... up to `to`: the first
    /// node and what is seen at it and the seven after it, of which those from `to` on mean nothing.
    /// `around` says force and acceleration of the base at a node.
    pub(crate) fn accelerations(
        &self,
        device: &Device,
        states: &Trajectory,
        nodes: std::ops::Range<usize>,
        around: impl Fn(usize) -> Surroundings,
        give: impl FnMut(usize, &Accelerations),
    ) {
        lanes::run(Sense {
            sight: Sight {
                oscillator: self,
                device,
                states,
            },
            nodes,
            around,
            give,
        });
    }
}

struct Sense<'a, F, G> {
    sight: Sight<'a>,
    nodes: std::ops::Range<usize>,
    around: F,
    give: G,
}

impl<F: Fn(usize) -> Surroundings, G: FnMut(usize, &Accelerations)> Kernel for Sense<'_, F, G> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Sense {
            sight,
            nodes,
            around,
            mut give,
        } = self;
        let mut seen = Accelerations::NOTHING;
        let mut from = nodes.start;
        while from < nodes.end {
            let count = (nodes.end - from).min(LANES);
            sight.see(arithmetic, from, count, &around, &mut seen);
            give(from, &seen);
            from += LANES;
        }
    }
}

/// Whose accelerations are seen.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub oscillator: &'a Oscillator,
    pub device: &'a Device,
    pub states: &'a Trajectory,
}

impl Sight<'_> {
    /// The accelerations at `count` nodes, at most eight, from node `i` on; lanes beyond mean nothing.
    #[inline(always)]
    pub fn see<A: Arithmetic>(
        &self,
        arithmetic: A,
        i: usize,
        count: usize,
        around: impl Fn(usize) -> Surroundings,
        seen: &mut Accelerations,
    ) {
        let [mut forces, mut bases] = [[0.0; LANES]; 2];
        for l in 0..count.min(LANES) {
            let Surroundings { force, base } = around(i + l);
            (forces[l], bases[l]) = (force, base);
        }
        let (zero, one) = (Eight::splat(arithmetic, 0.0), Eight::splat(arithmetic, 1.0));
        let y = Eight::load(arithmetic, &window::row(&self.states.displacement, i));
        let v = Eight::load(arithmetic, &window::row(&self.states.velocity, i));
        let per_mass = one / Eight::load(arithmetic, &window::row(&self.device.mass, i));
        let mut push = Eight::load(arithmetic, &forces);
        let [mut by_y, mut by_v] = [zero; 2];
        let terms = self.oscillator.terms.iter().zip(&self.device.coefficients);
        for (j, (term, p)) in terms.enumerate() {
            let p = Eight::load(arithmetic, &window::row(p, i));
            let response = term.respond(arithmetic, y, v);
            push = push - p * response.phi;
            by_y = by_y - p * response.by_y;
            by_v = by_v - p * response.by_v;
            seen.functions[j + 1] = (-response.phi * per_mass).row();
        }
        let inertia = push * per_mass;
        seen.functions[0] = (-inertia * per_mass).row();
        seen.states = [(by_y * per_mass).row(), (by_v * per_mass).row()];
        seen.value = (inertia - Eight::load(arithmetic, &bases)).row();
    }
}
