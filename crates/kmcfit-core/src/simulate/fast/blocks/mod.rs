//! Parallel-in-time integration of linear free responses, in eight SIMD lanes.
//!
//! A step of the midpoint rule is a linear map of the state if the terms are linear. The record is divided into blocks. A
//! first pass computes the map of each block; the states between blocks follow by a recursion over the maps; a second pass
//! computes the response in all blocks in parallel. The adjoint is computed likewise, backwards. Sequential integration has
//! one chain of dependent operations, eight lanes have eight independent ones.
//!
//! Responses, adjoints and least squares agree with [`forward`](crate::simulate::reference::forward()) and
//! [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()) to 40 machine precisions of the largest value per
//! step: steps are increments of the state, as in the reference, and the relative error of a block's map is that of its
//! few steps.

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

/// Range of masses whose square is safely within the floating-point range.
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
    /// Constructs the system; `None` if a mass is outside the safe range. The terms must be damping and stiffness.
    pub fn of(system: &System, nodal: &'a NodalCoefficients, nodes: usize) -> Option<Self> {
        let [damping, stiffness] = nodal.coefficients.as_slice() else {
            return None;
        };
        let functions = [nodal.mass.as_slice(), damping, stiffness];
        Self::new(functions, system.grid.step(), nodes)
    }

    /// Constructs the system from mass, damping and stiffness, and the step `h` (s).
    pub fn new([mass, damping, stiffness]: [&'a [f64]; 3], h: f64, nodes: usize) -> Option<Self> {
        let nodal = Self {
            mass: &mass[..nodes],
            damping,
            stiffness,
            h,
        };
        // Nodes beyond the end of a short record are included.
        simd::run(MassRange(mass)).then_some(nodal)
    }

    /// Cost `sum_i w_i (y_i - sample_i)^2` of one sample per node with the weights of inner nodes and of both ends. Overwrites
    /// `gradient` with the gradient with respect to the functions and returns that with respect to the initial state.
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

    /// Copies the functions to SIMD layout.
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

    /// One sequential step of the adjoint: advances `x` from node `i + 1` to node `i` and adds the step's contribution to the
    /// gradient, which is overwritten at node `i`.
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

    /// Response from `initial` over the nodes of `trajectory`. If it, or a block's map, is not finite, the last state is not
    /// finite.
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

    /// Adjoint, as [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()).
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

/// Check that all masses are within the safe range.
struct MassRange<'a>(&'a [f64]);

impl simd::Kernel for MassRange<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) -> bool {
        let within = |m: &f64| (*m >= MASSES.start) & (*m < MASSES.end);
        self.0.iter().fold(true, |all, m| all & within(m))
    }
}
