//! Wall-clock time of a fit by kind of work.

use crate::host::Instant;
use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign};
use std::time::Duration;

/// Wall-clock time by what it was spent on. No time is in two of them; what is in none of them is
/// bookkeeping.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timings {
    /// Forward solves: responses, predictions and costs.
    pub forward: Duration,
    /// Adjoint solves: gradients.
    pub adjoint: Duration,
    /// Tangent solves, and the step Jacobians that stand for them where there are many parameters.
    pub tangent: Duration,
    /// Quadratic programs.
    pub qp: Duration,
    /// The plain Gauss-Newton step (assembled, factored and solved), the recursion of L-BFGS, the
    /// plain solution of the equation error.
    pub linear_algebra: Duration,
    /// Starts from the samples, with all that is solved for them.
    pub start: Duration,
    /// Checkpoints, and where the search stood at its end; not the lines of its iterations.
    #[serde(default)]
    pub keeping: Duration,
}

impl Timings {
    /// The sum of all.
    pub fn sum(&self) -> Duration {
        self.forward
            + self.adjoint
            + self.tangent
            + self.qp
            + self.linear_algebra
            + self.start
            + self.keeping
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
            keeping: self.keeping + other.keeping,
        }
    }
}

impl AddAssign for Timings {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// What `work` gives; the time that it takes is added to `sum`.
pub fn timed<T>(sum: &mut Duration, work: impl FnOnce() -> T) -> T {
    let clock = Instant::now();
    let result = work();
    *sum += clock.elapsed();
    result
}
