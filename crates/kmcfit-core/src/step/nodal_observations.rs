//! Accelerations at eight neighbouring nodes, the samples of an accelerometer on the grid. Agrees with
//! [`observe`](super::observe()) to some machine precisions.

use super::Trajectory;
use super::stage::eight;
use crate::simd::{Arithmetic, Eight, LANES, Row};
use crate::system::{FUNCTIONS, NodalCoefficients, System};

/// Accelerations at eight nodes and their derivatives, one node per lane.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Accelerations {
    /// Accelerations `y''`, relative to the base.
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

/// A response observed at its nodes.
#[derive(Clone, Copy)]
pub(crate) struct NodalObservations<'a> {
    pub system: &'a System,
    pub nodal: &'a NodalCoefficients,
    pub states: &'a Trajectory,
}

impl NodalObservations<'_> {
    /// Accelerations at eight nodes from node `i`, with force and acceleration of the base at each; lanes beyond the last node
    /// are undefined.
    #[inline(always)]
    pub fn accelerations<A: Arithmetic>(
        &self,
        arithmetic: A,
        i: usize,
        [force, base]: [Eight<A>; 2],
        out: &mut Accelerations,
    ) {
        let (zero, one) = (Eight::splat(arithmetic, 0.0), Eight::splat(arithmetic, 1.0));
        let y = eight(arithmetic, self.states.displacement(0), i);
        let v = eight(arithmetic, self.states.velocity(0), i);
        let inverse_mass = one / eight(arithmetic, &self.nodal.inertias[0], i);
        let minus_inverse_mass = -inverse_mass;
        let mut push = force;
        let [mut by_y, mut by_v] = [zero; 2];
        for (j, law) in self.system.laws().iter().enumerate() {
            let p = match self.nodal.coefficients.get(j) {
                Some(p) => eight(arithmetic, p, i),
                None => zero,
            };
            let phi = law.phi(y, v);
            push = push - p * phi;
            out.functions[j + 1] = (phi * minus_inverse_mass).row();
            let [slope_y, slope_v] = law.slopes(y, v);
            if let Some(slope) = slope_y {
                by_y = by_y - p * slope;
            }
            if let Some(slope) = slope_v {
                by_v = by_v - p * slope;
            }
        }
        let inertia = push * inverse_mass;
        out.functions[0] = (inertia * minus_inverse_mass).row();
        out.states = [(by_y * inverse_mass).row(), (by_v * inverse_mass).row()];
        out.value = (inertia - base).row();
    }
}
