//! Numbers of solves of a fit.

use crate::problem::Problem;
use serde::{Deserialize, Serialize};

/// Numbers of solves; one count is one pass over all experiments, or over the part of them used for a starting point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SolveCounts {
    /// Forward solves.
    pub forward: u64,
    /// Adjoint solves.
    pub adjoint: u64,
    /// Tangent solves, one for each parameter.
    pub tangent: u64,
    /// Quadratic programs.
    pub qp: u64,
}

pub(super) const FORWARD: &str = "forward_count";
pub(super) const ADJOINT: &str = "adjoint_count";
pub(super) const TANGENT: &str = "tangent_count";
pub(super) const QP: &str = "qp_count";

impl std::ops::Add for SolveCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            forward: self.forward + other.forward,
            adjoint: self.adjoint + other.adjoint,
            tangent: self.tangent + other.tangent,
            qp: self.qp + other.qp,
        }
    }
}

impl std::ops::AddAssign for SolveCounts {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SolveCounts {
    pub(super) fn of(problem: &argmin::core::Problem<&Problem>) -> Self {
        let count = |key| problem.counts.get(key).copied().unwrap_or(0);
        Self {
            forward: count(FORWARD),
            adjoint: count(ADJOINT),
            tangent: count(TANGENT),
            qp: count(QP),
        }
    }
}
