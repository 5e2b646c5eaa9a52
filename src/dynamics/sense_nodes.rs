//! The accelerations at eight neighbouring nodes: what an accelerometer sampled with the grid sees.

use super::maps::FUNCTIONS;
use super::{Device, Oscillator, Trajectory, window};
use crate::lanes::{Arithmetic, Eight, LANES, Row};

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

/// Whose accelerations are seen.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub oscillator: &'a Oscillator,
    pub device: &'a Device,
    pub states: &'a Trajectory,
}

impl Sight<'_> {
    /// The accelerations at eight nodes from node `i` on, with force and acceleration of the base at each; lanes
    /// beyond the last node mean nothing.
    #[inline(always)]
    pub fn see<A: Arithmetic>(
        &self,
        arithmetic: A,
        i: usize,
        [force, base]: [Row; 2],
        seen: &mut Accelerations,
    ) {
        let (zero, one) = (Eight::splat(arithmetic, 0.0), Eight::splat(arithmetic, 1.0));
        let y = Eight::load(arithmetic, &window::row(&self.states.displacement, i));
        let v = Eight::load(arithmetic, &window::row(&self.states.velocity, i));
        let per_mass = one / Eight::load(arithmetic, &window::row(&self.device.mass, i));
        let minus_per_mass = -per_mass;
        let mut push = Eight::load(arithmetic, &force);
        let [mut by_y, mut by_v] = [zero; 2];
        let terms = self.oscillator.terms.iter().zip(&self.device.coefficients);
        for (j, (term, p)) in terms.enumerate() {
            let p = Eight::load(arithmetic, &window::row(p, i));
            let response = term.respond(arithmetic, y, v);
            push = push - p * response.phi;
            seen.functions[j + 1] = (response.phi * minus_per_mass).row();
            by_y = response.by_y.taken_from(by_y, p);
            by_v = response.by_v.taken_from(by_v, p);
        }
        let inertia = push * per_mass;
        seen.functions[0] = (inertia * minus_per_mass).row();
        seen.states = [(by_y * per_mass).row(), (by_v * per_mass).row()];
        seen.value = (inertia - Eight::load(arithmetic, &base)).row();
    }
}
