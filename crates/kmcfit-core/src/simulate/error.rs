//! Simulations that end early.

use super::Trajectory;
use crate::simd::sum::are_positive;
use crate::system::{Grid, NodalCoefficients};
use thiserror::Error;

/// Why a response could not be computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The mass is zero, negative or not a number: the equation of motion has no meaning there.
    Mass,
    /// The response left the range of floating-point numbers.
    Overflow,
    /// The response exists, but the square of a residual leaves the range of floating-point numbers.
    CostOverflow,
}

/// An evaluation that ended early: an outcome of a trial, not a misuse. Line searches step back.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{}", self.sentence())]
pub struct SimulationError {
    /// What happened.
    pub cause: Cause,
    /// Node at which it happened.
    pub node: usize,
    /// Time of that node, s.
    pub time: f64,
    /// The value found there: the mass in kg, the last finite displacement in m or the largest residual
    /// in its own unit.
    pub value: f64,
}

impl SimulationError {
    fn sentence(&self) -> String {
        let (time, value) = (self.time, self.value);
        match self.cause {
            Cause::Mass => format!("the mass is {value} kg at t = {time:.6} s, not positive"),
            Cause::Overflow => format!("the motion overflows at t = {time:.6} s"),
            Cause::CostOverflow => format!(
                "the cost overflows: the response and a sample are {value:.3e} apart at t = \
                 {time:.6} s"
            ),
        }
    }
}

/// Refuses a mass that is not positive at some node.
pub(super) fn require_positive_mass(
    grid: &Grid,
    nodal: &NodalCoefficients,
) -> Result<(), SimulationError> {
    if are_positive(&nodal.mass) {
        return Ok(());
    }
    let broken = |m: &f64| m.is_nan() || *m <= 0.0;
    match nodal.mass.iter().position(broken) {
        Some(node) => Err(at(grid, Cause::Mass, node, nodal.mass[node])),
        None => Ok(()),
    }
}

/// Refuses a response that leaves the finite numbers.
pub(super) fn require_finite(grid: &Grid, trajectory: &Trajectory) -> Result<(), SimulationError> {
    if trajectory.is_finite() {
        return Ok(());
    }
    let finite =
        |i: usize| trajectory.displacement[i].is_finite() && trajectory.velocity[i].is_finite();
    let node = (0..trajectory.nodes()).find(|&i| !finite(i)).unwrap_or(0);
    let last = trajectory.displacement[node.saturating_sub(1)];
    Err(at(grid, Cause::Overflow, node, last))
}

fn at(grid: &Grid, cause: Cause, node: usize, value: f64) -> SimulationError {
    SimulationError {
        cause,
        node,
        time: grid.time(node),
        value,
    }
}
