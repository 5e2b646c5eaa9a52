//! Linear free response in eight blocks at once.
//!
//! A step of the midpoint rule is a linear map of the state as long as the terms are linear. So the
//! record can be cut into blocks that do not wait for each other: a first pass finds the map of
//! each block, from these the states between blocks follow one after the other, and a second
//! pass computes the response in all blocks at once. The adjoint is done the same way from the end. One
//! step after the other, each waits for the one before; in eight lanes the processor has always
//! something to do.
//!
//! Responses, adjoints and least squares equal [`forward`](crate::simulate::reference::forward()) and
//! [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()) to 40 machine precisions of the largest value for
//! each step: each step adds an increment of the state, as there, and the relative error of a block's map
//! is that of its few steps.

mod adjoint;
mod forward;
mod least_squares;
mod step;
#[cfg(test)]
mod tests;
mod tile;
mod workspace;

use crate::simd::{self, Arithmetic};
use crate::simulate::Trajectory;
use crate::system::{NodalCoefficients, State, System, SystemTangent};
use step::{Constants, NodeCoefficients, StepRates};
use tile::Tile;
use workspace::{Workspace, with_workspace};

/// A mass outside this range meets its own square near the ends of the range of numbers.
const MASSES: std::ops::Range<f64> = 1e-150..1e150;

/// A system with damping and stiffness alone, and the step `h` (s).
#[derive(Clone, Copy)]
pub(crate) struct LinearSystem<'a> {
    mass: &'a [f64],
    damping: &'a [f64],
    stiffness: &'a [f64],
    h: f64,
}

impl<'a> LinearSystem<'a> {
    /// `None` if a mass is so large or small that the arithmetic of the blocks would not be safe. The system must have
    /// the terms damping and stiffness.
    pub fn of(system: &System, nodal: &'a NodalCoefficients, nodes: usize) -> Option<Self> {
        let [damping, stiffness] = nodal.coefficients.as_slice() else {
            return None;
        };
        let functions = [nodal.mass.as_slice(), damping, stiffness];
        Self::new(functions, system.grid.step(), nodes)
    }

    /// The same from mass, damping and stiffness, and the step `h` (s).
    pub fn new([mass, damping, stiffness]: [&'a [f64]; 3], h: f64, nodes: usize) -> Option<Self> {
        let nodal = Self {
            mass: &mass[..nodes],
            damping,
            stiffness,
            h,
        };
        // Also behind the end of a record that is shorter than the grid.
        simd::run(MassRange(mass)).then_some(nodal)
    }

    /// The cost `sum_i w_i (y_i - reading_i)^2` of one sample a node with the weights of the inner
    /// nodes and of both ends, and its gradient: with respect to the functions into `gradient`,
    /// with respect to the initial state returned.
    pub fn least_squares(
        self,
        initial: State,
        samples: &[f64],
        weights: [f64; 2],
        gradient: [&mut [f64]; 3],
    ) -> (f64, State) {
        least_squares::LeastSquares {
            nodal: self,
            initial,
            samples,
            weights,
        }
        .solve(gradient)
    }

    /// Brings the functions into lanes.
    #[inline(always)]
    fn gather<A: Arithmetic>(&self, arithmetic: A, tile: Tile, workspace: &mut Workspace) {
        let functions = [self.mass, self.damping, self.stiffness];
        for (values, rows) in functions.into_iter().zip(&mut workspace.functions) {
            tile.gather_with_end(arithmetic, values, rows);
        }
    }

    fn constants(&self) -> Constants<f64> {
        Constants::new(self.h)
    }

    #[inline(always)]
    fn rates(&self, i: usize) -> StepRates<f64> {
        let at = |i: usize| NodeCoefficients {
            m: self.mass[i],
            c: self.damping[i],
            hk: self.h * self.stiffness[i],
        };
        StepRates::new(at(i), at(i + 1), self.constants())
    }

    /// One step of the adjoint by itself: carries `x` from node `i + 1` to node `i` and adds the
    /// step's share to the gradient, which is overwritten at node `i`.
    #[inline(always)]
    fn step_back(
        &self,
        i: usize,
        response: [f64; 2],
        source: [f64; 2],
        x: &mut [f64; 2],
        gradient: &mut [&mut [f64]; 3],
    ) {
        let (rates, of) = (self.rates(i), self.constants());
        let (node, middle) = rates.shares(response, *x, of);
        let scale = [of.per_h, 1.0, of.h];
        for (f, g) in gradient.iter_mut().enumerate() {
            g[i] = (node[f] + middle[f]) * scale[f];
            g[i + 1] += middle[f] * scale[f];
        }
        let [y, w] = rates.backward(*x, of);
        *x = [y + source[0], w + source[1]];
    }

    /// The response from `initial`, over as many nodes as `trajectory` has. Where it, or a block's map,
    /// leaves the finite numbers, the last state is not finite.
    pub fn forward(self, initial: State, trajectory: &mut Trajectory) {
        with_workspace(|workspace| {
            simd::run(forward::BlockForward {
                nodal: self,
                initial,
                displacement: &mut trajectory.displacement,
                velocity: &mut trajectory.velocity,
                workspace,
            });
        });
    }

    /// [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()).
    pub fn gradient(self, trajectory: &Trajectory, source: &Trajectory) -> SystemTangent {
        let by_velocity = source.velocity.iter().any(|s| *s != 0.0);
        let source = [
            Some(source.displacement.as_slice()),
            by_velocity.then_some(source.velocity.as_slice()),
        ];
        let nodes = trajectory.nodes();
        let mut gradient = NodalCoefficients::zeros(self.damping.len(), 2);
        let [damping, stiffness] = gradient.coefficients.as_mut_slice() else {
            unreachable!("two terms")
        };
        let parts = [&mut gradient.mass, damping, stiffness].map(|g| &mut g[..nodes]);
        let initial = with_workspace(|workspace| {
            simd::run(adjoint::BlockAdjoint {
                nodal: self,
                displacement: &trajectory.displacement,
                velocity: &trajectory.velocity,
                source,
                gradient: parts,
                workspace,
            })
        });
        SystemTangent {
            nodal: gradient,
            initial,
        }
    }
}

/// Whether all masses are positive, and neither so large nor so small that a product of two leaves
/// the range of numbers.
struct MassRange<'a>(&'a [f64]);

impl simd::Kernel for MassRange<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) -> bool {
        let within = |m: &f64| (*m >= MASSES.start) & (*m < MASSES.end);
        self.0.iter().fold(true, |all, m| all & within(m))
    }
}
