//! Linear free motion in eight blocks at once.
//!
//! A step of the midpoint rule is a linear map of the state as long as the terms are linear. So the
//! record can be cut into blocks that do not wait for each other: a first pass finds the map of
//! each block, from these the states between blocks follow one after the other, and a second
//! pass computes the motion in all blocks at once. The adjoint is done the same way from the end. One
//! step after the other, each waits for the one before; in eight lanes the processor has always
//! something to do.
//!
//! Against [`Oscillator::forward`](super::Oscillator::forward) step by step the results differ by
//! rounding: each step adds an increment of the state, as there, and the relative error of a block's map
//! is that of its few steps.

mod adjoint;
mod forward;
mod scratch;
mod squares;
mod step;
#[cfg(test)]
mod tests;
mod tile;

use super::{Device, Excitation, Method, Oscillator, State, Term, Trajectory};
use crate::lanes::{self, Arithmetic};
use scratch::{Scratch, with_scratch};
use step::{Coefficients, Constants, Rates};
use tile::Tile;

/// Up to so many nodes a record is not worth cutting.
const SHORTEST: usize = 64;

/// A mass outside this range meets its own square near the ends of the range of numbers.
const MASSES: std::ops::Range<f64> = 1e-150..1e150;

/// A device with damping and stiffness alone, and the step `h` (s).
#[derive(Clone, Copy)]
pub(super) struct LinearDevice<'a> {
    mass: &'a [f64],
    damping: &'a [f64],
    stiffness: &'a [f64],
    h: f64,
}

impl<'a> LinearDevice<'a> {
    /// `None` where there are other terms, a force or another stepper, where the record is too short to be
    /// cut, or if a mass is so large or small that the blocks' arithmetic would not be safe.
    pub fn of(
        oscillator: &Oscillator,
        device: &'a Device,
        excitation: Option<&Excitation>,
        nodes: usize,
    ) -> Option<Self> {
        let [damping, stiffness] = device.coefficients.as_slice() else {
            return None;
        };
        let functions = [device.mass.as_slice(), damping, stiffness];
        let free = excitation.is_none_or(Excitation::is_zero);
        free.then(|| Self::new(oscillator, functions, nodes))?
    }

    /// The same from mass, damping and stiffness in free motion.
    pub fn new(
        oscillator: &Oscillator,
        [mass, damping, stiffness]: [&'a [f64]; 3],
        nodes: usize,
    ) -> Option<Self> {
        let fits = oscillator.method == Method::Midpoint
            && oscillator.terms == [Term::Damping, Term::Stiffness]
            && nodes > SHORTEST;
        let device = Self {
            mass: &mass[..nodes],
            damping,
            stiffness,
            h: oscillator.grid.step(),
        };
        // Also behind the end of a record that is shorter than the grid.
        (fits && lanes::run(Within(mass))).then_some(device)
    }

    /// The cost `sum_i w_i (y_i - reading_i)^2` of one reading a node with the weights of the inner
    /// nodes and of both ends, and its gradient: with respect to the functions into `gradient`,
    /// with respect to the initial state returned.
    pub fn squares(
        self,
        initial: State,
        readings: &[f64],
        weights: [f64; 2],
        gradient: [&mut [f64]; 3],
    ) -> (f64, State) {
        squares::Squares {
            device: self,
            initial,
            readings,
            weights,
        }
        .solve(gradient)
    }

    /// Brings the functions into lanes.
    #[inline(always)]
    fn gather<A: Arithmetic>(&self, arithmetic: A, tile: Tile, scratch: &mut Scratch) {
        let functions = [self.mass, self.damping, self.stiffness];
        for (values, rows) in functions.into_iter().zip(&mut scratch.functions) {
            tile.gather_with_end(arithmetic, values, rows);
        }
    }

    fn constants(&self) -> Constants<f64> {
        Constants::new(self.h)
    }

    #[inline(always)]
    fn rates(&self, i: usize) -> Rates<f64> {
        let at = |i: usize| Coefficients {
            m: self.mass[i],
            c: self.damping[i],
            hk: self.h * self.stiffness[i],
        };
        Rates::new(at(i), at(i + 1), self.constants())
    }

    /// One step of the adjoint by itself: carries `x` from node `i + 1` to node `i` and adds the
    /// step's share to the gradient, which is overwritten at node `i`.
    #[inline(always)]
    fn step_back(
        &self,
        i: usize,
        motion: [f64; 2],
        source: [f64; 2],
        x: &mut [f64; 2],
        gradient: &mut [&mut [f64]; 3],
    ) {
        let (rates, of) = (self.rates(i), self.constants());
        let (node, middle) = rates.shares(motion, *x, of);
        let scale = [of.per_h, 1.0, of.h];
        for (f, g) in gradient.iter_mut().enumerate() {
            g[i] = (node[f] + middle[f]) * scale[f];
            g[i + 1] += middle[f] * scale[f];
        }
        let [y, w] = rates.backward(*x, of);
        *x = [y + source[0], w + source[1]];
    }

    /// The motion from `initial`, over as many nodes as `trajectory` has. Where it, or a block's map,
    /// leaves the finite numbers, the last state is not finite.
    pub fn forward(self, initial: State, trajectory: &mut Trajectory) {
        with_scratch(|scratch| {
            lanes::run(forward::Forward {
                device: self,
                initial,
                displacement: &mut trajectory.displacement,
                velocity: &mut trajectory.velocity,
                scratch,
            });
        });
    }

    /// As [`super::adjoint::discrete::gradient`], into the functions of `gradient`, which are overwritten.
    /// Returns the gradient with respect to the initial state.
    pub fn gradient(
        self,
        trajectory: &Trajectory,
        source: &Trajectory,
        gradient: &mut Device,
    ) -> State {
        let by_velocity = source.velocity.iter().any(|s| *s != 0.0);
        let source = [
            Some(source.displacement.as_slice()),
            by_velocity.then_some(source.velocity.as_slice()),
        ];
        let [damping, stiffness] = gradient.coefficients.as_mut_slice() else {
            unreachable!("a gradient for the same functions")
        };
        let nodes = trajectory.nodes();
        let [mass, damping, stiffness] = [&mut gradient.mass, damping, stiffness].map(|g| {
            g[nodes..].fill(0.0);
            &mut g[..nodes]
        });
        with_scratch(|scratch| {
            lanes::run(adjoint::Adjoint {
                device: self,
                displacement: &trajectory.displacement,
                velocity: &trajectory.velocity,
                source,
                gradient: [mass, damping, stiffness],
                scratch,
            })
        })
    }
}

/// Whether all masses are positive, and neither so large nor so small that a product of two leaves
/// the range of numbers.
struct Within<'a>(&'a [f64]);

impl lanes::Kernel for Within<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) -> bool {
        let within = |m: &f64| (*m >= MASSES.start) & (*m < MASSES.end);
        self.0.iter().fold(true, |all, m| all & within(m))
    }
}

impl Oscillator {
    /// `J = sum_i w_i (y_i - reading_i)^2` of the free motion of a device with the functions mass, damping,
    /// stiffness, seen at every node, with the weights of the inner nodes and of both ends; its
    /// gradient with respect to the functions overwrites `gradient`, that with respect to the initial
    /// state is returned. `None` where the motion cannot be computed in blocks.
    ///
    /// # Panics
    /// If a function, the readings or a part of the gradient has another length than the grid.
    pub(crate) fn squares_in_blocks(
        &self,
        functions: [&[f64]; 3],
        initial: State,
        readings: &[f64],
        weights: [f64; 2],
        gradient: [&mut [f64]; 3],
    ) -> Option<(f64, State)> {
        let nodes = self.grid.nodes();
        assert_eq!(readings.len(), nodes, "a reading a node");
        let device = LinearDevice::new(self, functions, nodes)?;
        Some(device.squares(initial, readings, weights, gradient))
    }
}
