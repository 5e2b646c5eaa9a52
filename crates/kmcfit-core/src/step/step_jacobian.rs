//! Linearisation of single steps, for methods with the states as unknowns.

use super::Trajectory;
use super::engine::{Driven, Maps};
use crate::system::{InputQuantity, State};

/// Change of the state `(y, v)` at the right node of a step.
pub type StateChange = [f64; 2];

/// One step `x_{i+1} = Phi_i(x_i, p)` and its derivatives; functions in the order of
/// [`NodalCoefficients::functions`](crate::system::NodalCoefficients::functions), mass first.
#[derive(Debug, Clone, PartialEq)]
pub struct StepJacobian {
    /// `Phi_i`: displacement and velocity at the right node.
    pub end: State,
    /// Derivatives with respect to the displacement and to the velocity at the left node.
    pub state: [StateChange; 2],
    /// Derivatives with respect to each function's value at the left node.
    pub left: Vec<StateChange>,
    /// Derivatives with respect to each function's value at the right node.
    pub right: Vec<StateChange>,
}

/// Derivatives of a step with respect to the state at its left node.
fn by_state(maps: &Maps, l: usize) -> [StateChange; 2] {
    let [[yy, yv], [vy, vv]] = &maps.growth;
    [[1.0 + yy[l], vy[l]], [yv[l], 1.0 + vv[l]]]
}

impl Driven<'_> {
    /// Linearises all steps about the node states `states`, which need not satisfy the equation of motion.
    pub fn step_jacobians(self, states: &Trajectory) -> Vec<StepJacobian> {
        let functions = 0..=self.system.terms.len();
        let mut all = Vec::with_capacity(states.nodes());
        self.each_step(states, false, |i, maps, l| {
            let at = |rows: &[[f64; crate::simd::LANES]; 2]| [rows[0][l], rows[1][l]];
            let [dy, dv] = at(&maps.increment);
            all.push(StepJacobian {
                end: State {
                    displacement: states.displacement[i] + dy,
                    velocity: states.velocity[i] + dv,
                },
                state: by_state(maps, l),
                left: functions.clone().map(|f| at(&maps.left[f])).collect(),
                right: functions.clone().map(|f| at(&maps.right[f])).collect(),
            });
        });
        all
    }

    /// Derivatives of the state at the right node of every step with respect to displacement and velocity at the left node, and with
    /// respect to the input `quantity` at the left and at the right node, between which it is linear.
    pub fn input_derivatives(
        self,
        states: &Trajectory,
        quantity: InputQuantity,
    ) -> Vec<[[StateChange; 2]; 2]> {
        let mut all = Vec::with_capacity(states.nodes());
        self.each_step(states, true, |_, maps, l| {
            let inputs = match quantity {
                InputQuantity::Force => &maps.forces[0],
                InputQuantity::BaseAcceleration => &maps.bases[0],
            };
            let by_input = [&inputs[0], &inputs[1]].map(|rows| [rows[0][l], rows[1][l]]);
            all.push([by_state(maps, l), by_input]);
        });
        all
    }
}
