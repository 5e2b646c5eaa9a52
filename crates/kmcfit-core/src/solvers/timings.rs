//! Wall-clock time of a fit by kind of work.

use crate::host::Instant;
use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign};
use std::time::Duration;

/// Wall-clock time by kind of work, without overlap; the rest of the elapsed time is overhead.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timings {
    /// Forward solves: responses, predictions and costs.
    pub forward: Duration,
    /// Adjoint solves: gradients.
    pub adjoint: Duration,
    /// Tangent solves, and step Jacobians, which replace them for many parameters.
    pub tangent: Duration,
    /// Quadratic programs.
    pub qp: Duration,
    /// Plain Gauss–Newton steps (assembly, factorisation, solution), the recursion of L-BFGS, the plain solution of the equation
    /// error.
    pub linear_algebra: Duration,
    /// Starting points from the samples.
    pub start: Duration,
}

impl Timings {
    /// Sum of all.
    pub fn sum(&self) -> Duration {
        self.forward + self.adjoint + self.tangent + self.qp + self.linear_algebra + self.start
    }
}

impl Add for Timings {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            forward: self.forward + other.forward,
            adjoint: self.adjoint + other.adjoint,
            tangent: self.tangent + other.tangent,
            qp: self.qp + other.qp,
            linear_algebra: self.linear_algebra + other.linear_algebra,
            start: self.start + other.start,
        }
    }
}

impl AddAssign for Timings {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Result of `work`; adds its duration to `sum`.
pub fn timed<T>(sum: &mut Duration, work: impl FnOnce() -> T) -> T {
    let clock = Instant::now();
    let result = work();
    *sum += clock.elapsed();
    result
}
