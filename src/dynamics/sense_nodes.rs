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
    const NOTHING: Self = Self {
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
        mut give: impl FnMut(usize, &Accelerations),
    ) {
        let mut seen = Accelerations::NOTHING;
        let mut from = nodes.start;
        while from < nodes.end {
            let [mut forces, mut bases] = [[0.0; LANES]; 2];
            let rows = forces.iter_mut().zip(&mut bases);
            for (node, (to_force, to_base)) in (from..nodes.end).zip(rows) {
                let Surroundings { force, base } = around(node);
                (*to_force, *to_base) = (force, base);
            }
            lanes::run(Sense {
                oscillator: self,
                device,
                states,
                from,
                driven: [forces, bases],
                seen: &mut seen,
            });
            give(from, &seen);
            from += LANES;
        }
    }
}

struct Sense<'a> {
    oscillator: &'a Oscillator,
    device: &'a Device,
    states: &'a Trajectory,
    from: usize,
    driven: [Row; 2],
    seen: &'a mut Accelerations,
}

impl Kernel for Sense<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let (zero, one) = (Eight::splat(arithmetic, 0.0), Eight::splat(arithmetic, 1.0));
        let i = self.from;
        let y = Eight::load(arithmetic, &window::row(&self.states.displacement, i));
        let v = Eight::load(arithmetic, &window::row(&self.states.velocity, i));
        let per_mass = one / Eight::load(arithmetic, &window::row(&self.device.mass, i));
        let mut push = Eight::load(arithmetic, &self.driven[0]);
        let [mut by_y, mut by_v] = [zero; 2];
        let terms = self.oscillator.terms.iter().zip(&self.device.coefficients);
        for (j, (term, p)) in terms.enumerate() {
            let p = Eight::load(arithmetic, &window::row(p, i));
            let response = term.respond(arithmetic, y, v);
            push = push - p * response.phi;
            by_y = by_y - p * response.by_y;
            by_v = by_v - p * response.by_v;
            self.seen.functions[j + 1] = (-response.phi * per_mass).row();
        }
        let inertia = push * per_mass;
        self.seen.functions[0] = (-inertia * per_mass).row();
        self.seen.states = [(by_y * per_mass).row(), (by_v * per_mass).row()];
        self.seen.value = (inertia - Eight::load(arithmetic, &self.driven[1])).row();
    }
}
