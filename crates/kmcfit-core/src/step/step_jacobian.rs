//! Linearisation of single steps, for methods with the states as unknowns.

use super::Trajectory;
use super::assembled::StepRow;
use super::engine::{Driven, Maps};
use crate::system::InputQuantity;
use nalgebra::{DMatrix, DVector};

/// The steps `x_{i+1} = Phi_i(x_i, p)` of a record and their derivatives; functions in the order of
/// [`NodalCoefficients::functions`](crate::system::NodalCoefficients::functions), inertias first.
#[derive(Debug, Clone, PartialEq)]
pub struct StepJacobians {
    components: usize,
    functions: usize,
    /// For each step `Phi_i`, then its derivatives by the components at the left node, by each function's value at the left node, and by
    /// each function's value at the right node.
    values: Vec<f64>,
}

/// One step: values and derivatives of all components of the state at its right node.
#[derive(Debug, Clone, Copy)]
pub struct StepJacobian<'a> {
    components: usize,
    functions: usize,
    values: &'a [f64],
}

impl StepJacobians {
    /// All steps in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = StepJacobian<'_>> {
        let rows = 1 + self.components + 2 * self.functions;
        let steps = self.values.chunks_exact(rows * self.components);
        steps.map(|values| StepJacobian {
            components: self.components,
            functions: self.functions,
            values,
        })
    }
}

impl StepJacobian<'_> {
    fn row(&self, row: usize, end: usize) -> f64 {
        self.values[row * self.components + end]
    }

    /// Component `end` of `Phi_i`.
    pub fn end(&self, end: usize) -> f64 {
        self.row(0, end)
    }

    /// Derivative of component `end` by component `start` at the left node.
    pub fn by_state(&self, start: usize, end: usize) -> f64 {
        self.row(1 + start, end)
    }

    /// Derivative of component `end` by a function's value at the left node (side 0) or the right node.
    pub fn by_function(&self, function: usize, side: usize, end: usize) -> f64 {
        self.row(1 + self.components + side * self.functions + function, end)
    }
}

/// Derivative of component `end` after the step in lane `l` by component `start` before it.
fn by_state(maps: &Maps, l: usize, start: usize, end: usize) -> f64 {
    f64::from(u8::from(start == end)) + maps.growth[end][start][l]
}

impl Driven<'_> {
    /// Linearises all steps about the node states `states`, which need not satisfy the equation of motion.
    pub fn step_jacobians(self, states: &Trajectory) -> StepJacobians {
        let (components, functions) = (states.components(), self.system.structure.functions());
        let size = (1 + components + 2 * functions) * components;
        let mut values = Vec::with_capacity(size * (states.nodes() - 1));
        if self.is_assembled() {
            self.each_assembled_step(states, |end, rows| {
                values.extend_from_slice(end);
                for start in 0..components {
                    values.extend(rows.iter().map(|row| row.state[start]));
                }
                for side in 0..2 {
                    for f in 0..functions {
                        values.extend(rows.iter().map(|row| row.functions[f][side]));
                    }
                }
            });
            return StepJacobians {
                components,
                functions,
                values,
            };
        }
        self.each_step(states, false, |i, maps, l| {
            let ends = || 0..components;
            values.extend(ends().map(|end| states.component(end)[i] + maps.increment[end][l]));
            for start in ends() {
                values.extend(ends().map(|end| by_state(maps, l, start, end)));
            }
            for rows in [&maps.left, &maps.right] {
                for by_function in &rows[..functions] {
                    values.extend(ends().map(|end| by_function[end][l]));
                }
            }
        });
        StepJacobians {
            components,
            functions,
            values,
        }
    }

    /// Derivatives of the state after every step by that before it, and by the input `quantity` at both nodes, between which it is linear.
    pub fn input_derivatives(
        self,
        states: &Trajectory,
        quantity: InputQuantity,
    ) -> Vec<(DMatrix<f64>, [DVector<f64>; 2])> {
        let count = states.components();
        let mut all = Vec::with_capacity(states.nodes());
        if self.is_assembled() {
            let acting = self.acting(quantity);
            self.each_assembled_step(states, |_, rows| {
                let inputs = |row: &StepRow, side: usize| -> f64 {
                    let by = match quantity {
                        InputQuantity::Force => &row.forces,
                        InputQuantity::BaseAcceleration => &row.frames,
                    };
                    acting.iter().map(|j| by[*j][side]).sum()
                };
                all.push((
                    DMatrix::from_fn(count, count, |end, start| rows[end].state[start]),
                    [0, 1].map(|side| DVector::from_fn(count, |end, _| inputs(&rows[end], side))),
                ));
            });
            return all;
        }
        self.each_step(states, true, |_, maps, l| {
            let inputs = match quantity {
                InputQuantity::Force => &maps.forces[0],
                InputQuantity::BaseAcceleration => &maps.bases[0],
            };
            all.push((
                DMatrix::from_fn(count, count, |end, start| by_state(maps, l, start, end)),
                [0, 1].map(|side| DVector::from_fn(count, |end, _| inputs[side][end][l])),
            ));
        });
        all
    }

    /// The coordinates on which an input acts, the first one where there is none.
    fn acting(self, quantity: InputQuantity) -> Vec<usize> {
        self.excitation.map_or(vec![0], |e| e.acting(quantity))
    }
}
