//! A start that satisfies the constraints, or the constraints that contradict each other.

use crate::constraints::{Constraints, TOLERANCE};
use crate::problem::Problem;
use crate::qp::{ConicStatus, project};

/// What became of a start.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// It satisfies the constraints as it is.
    Kept(Vec<f64>),
    /// It was moved to the nearest point that does.
    Moved {
        /// That point.
        parameters: Vec<f64>,
        /// Name of the constraint that was violated most.
        constraint: String,
    },
    /// No point does: these constraints contradict each other, and would not without any one of
    /// them.
    Contradiction(Vec<String>),
    /// The projection could not be solved.
    Unsolved(ConicStatus),
}

impl Problem {
    /// Moves `start` into the constraint set, in the L2 metric relative to the functions' sizes.
    pub fn feasible_start(&self, start: &[f64]) -> Start {
        let worst = match self.constraints.largest_violation(start) {
            Some(violation) if violation.relative > 0.0 => violation,
            _ => return Start::Kept(start.to_vec()),
        };
        let device = self.functions.device(start);
        let sizes: Vec<f64> = (device.functions())
            .map(|f| f.iter().fold(0.0f64, |most, p| most.max(p.abs())))
            .collect();
        let metric = self
            .functions
            .relative_metric(&sizes, self.oscillator.grid.duration());
        let mut moved = start.to_vec();
        self.constraints.clip(&mut moved);
        if !self.constraints.hold(&moved, 0.0) {
            let projection = project(&self.constraints, start, &metric);
            match projection.status {
                ConicStatus::Solved | ConicStatus::Almost => moved = projection.theta,
                ConicStatus::Infeasible => {
                    return Start::Contradiction(conflict(&self.constraints, start, &metric));
                }
                status => return Start::Unsolved(status),
            }
        }
        match self.constraints.hold(&moved, TOLERANCE) {
            true => Start::Moved {
                parameters: moved,
                constraint: worst.name,
            },
            // Clipping to contradictory bounds leaves a violation that no projection removes.
            false => Start::Contradiction(conflict(&self.constraints, start, &metric)),
        }
    }
}

/// Names of constraints that contradict each other, none of which could be left out: each group is
/// left out in turn, for good where the rest still contradicts itself.
fn conflict(constraints: &Constraints, start: &[f64], metric: &[f64]) -> Vec<String> {
    let contradicts = |candidate: &Constraints| {
        project(candidate, start, metric).status == ConicStatus::Infeasible
    };
    let mut left = constraints.clone();
    let mut i = 0;
    while i < left.groups.len() {
        let mut without = left.clone();
        without.groups.remove(i);
        if contradicts(&without) {
            left = without;
        } else {
            i += 1;
        }
    }
    let mut i = 0;
    while i < left.cones.len() {
        let mut without = left.clone();
        without.cones.remove(i);
        if contradicts(&without) {
            left = without;
        } else {
            i += 1;
        }
    }
    let groups = left.groups.into_iter().map(|g| g.name);
    groups
        .chain(left.cones.into_iter().map(|c| c.name))
        .collect()
}
