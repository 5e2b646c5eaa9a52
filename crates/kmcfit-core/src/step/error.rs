//! Errors of simulations.

use super::Trajectory;
use crate::number_format::significant;
use crate::simd::sum::are_positive;
use crate::system::{Grid, NodalCoefficients};
use thiserror::Error;

/// Cause of a failed simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The mass is zero, negative or not a number.
    Mass,
    /// The response exceeds the floating-point range.
    Overflow,
    /// An implicit step has no solution, or Newton's method does not find it.
    NoConvergence,
    /// The square of a residual exceeds the floating-point range.
    CostOverflow,
}

/// A failed simulation. Trial points of a fit may fail; line searches then shorten the step.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{}", self.sentence())]
pub struct SimulationError {
    /// Cause.
    pub cause: Cause,
    /// The first node at which the response or the mass fails; of a step without a solution the node at its left end.
    pub node: usize,
    /// Time of the node, s.
    pub time: f64,
    /// Value at the failure: the mass in kg, the last finite displacement in m, or the largest residual in its unit.
    pub value: f64,
}

impl SimulationError {
    fn sentence(&self) -> String {
        let (time, value) = (significant(self.time, 4), self.value);
        match self.cause {
            Cause::Mass if value.is_nan() => {
                format!("the mass matrix is not positive definite at t = {time} s")
            }
            Cause::Mass => format!(
                "the mass is {} kg at t = {time} s, not positive",
                significant(value, 6)
            ),
            Cause::Overflow => format!("the response overflows at t = {time} s"),
            Cause::NoConvergence => {
                format!("the implicit step from t = {time} s has no solution")
            }
            Cause::CostOverflow => {
                format!("the cost overflows: the residual at t = {time} s is {value:.3e}")
            }
        }
    }
}

/// Error if a mass is not positive at some node.
pub(super) fn require_positive_masses(
    grid: &Grid,
    nodal: &NodalCoefficients,
) -> Result<(), SimulationError> {
    for mass in nodal.inertias.iter().filter(|mass| !are_positive(mass)) {
        let broken = |m: &f64| m.is_nan() || *m <= 0.0;
        if let Some(node) = mass.iter().position(broken) {
            return Err(at(grid, Cause::Mass, node, mass[node]));
        }
    }
    Ok(())
}

/// Error if the response is not finite.
pub(super) fn require_finite(grid: &Grid, trajectory: &Trajectory) -> Result<(), SimulationError> {
    let Some(node) = trajectory.first_not_finite() else {
        return Ok(());
    };
    let last = trajectory.displacement(0)[node.saturating_sub(1)];
    Err(at(grid, Cause::Overflow, node, last))
}

pub(super) fn at(grid: &Grid, cause: Cause, node: usize, value: f64) -> SimulationError {
    SimulationError {
        cause,
        node,
        time: grid.time(node),
        value,
    }
}
