//! Projection of a start onto the constraints, or the infeasible subset if there is no feasible point.

use super::infeasible_subset::{conflict, feasibility};
use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::problem::Problem;
use crate::qp::{ConicStatus, StageLayout, Subproblem, project, project_by};

/// Smallest positive mass, as a share of the start's largest: a lighter system oscillates a thousand times faster than the
/// start, which a grid suitable for the start does not resolve.
const POSITIVE: f64 = 1e-6;

/// Result of projecting a start.
#[derive(Debug, Clone, PartialEq)]
pub enum StartProjection {
    /// The start is feasible.
    Kept(Vec<f64>),
    /// The start was moved to the nearest feasible point.
    Moved {
        /// Feasible point.
        parameters: Vec<f64>,
        /// Name of the constraint with the largest violation.
        constraint: String,
    },
    /// No point is feasible: these constraints contradict each other, and removing any one of them resolves it.
    Contradiction(Vec<String>),
    /// No point is feasible: the contradiction is among these constraints, some of which may not take part in it.
    ContradictionAmong(Vec<String>),
    /// The projection could not be solved.
    Unsolved(ConicStatus),
}

impl Problem {
    /// The starting point `parameters`, projected onto the constraints if its program violates them, which rows of very different
    /// scales cause; `otherwise` if the projection fails.
    pub(super) fn feasible_or(&self, parameters: Vec<f64>, otherwise: &[f64]) -> Vec<f64> {
        if self.constraints.hold(&parameters, TOLERANCE) {
            return parameters;
        }
        match self.feasible_start(&parameters) {
            StartProjection::Kept(inside) => inside,
            StartProjection::Moved { parameters, .. } => parameters,
            _ => otherwise.to_vec(),
        }
    }

    /// Projects `start` onto the constraint set, in the L2 metric relative to the functions' sizes.
    pub fn feasible_start(&self, start: &[f64]) -> StartProjection {
        let worst = match self.constraints.largest_violation(start) {
            Some(violation) if violation.relative > 0.0 => violation,
            _ => return StartProjection::Kept(start.to_vec()),
        };
        let nodal = self.functions.nodal(start);
        let sizes: Vec<f64> = (nodal.functions())
            .map(|f| f.iter().fold(0.0f64, |most, p| most.max(p.abs())))
            .collect();
        let metric = self
            .functions
            .relative_metric(&sizes, self.system.grid.duration());
        let mut moved = start.to_vec();
        self.constraints.clip(&mut moved);
        // Coefficients of a constant differ by their rounding, which a shape of the function sees.
        if !self.constraints.hold(&moved, TOLERANCE) {
            match self.inside(start, &metric) {
                Ok(theta) => moved = theta,
                Err(status) => return self.contradiction(start, &metric, status),
            }
        }
        match self.constraints.hold(&moved, TOLERANCE) {
            true => StartProjection::Moved {
                parameters: self.with_mass(start, &metric, moved),
                constraint: worst.name,
            },
            // Clipping to contradictory bounds leaves a violation that no projection removes.
            false => self.contradiction(start, &metric, ConicStatus::Stalled),
        }
    }

    /// Projection of `start`. If the program fails, any feasible point that it reached, or the projection in another metric,
    /// serves as well.
    fn inside(&self, start: &[f64], metric: &[f64]) -> Result<Vec<f64>, ConicStatus> {
        let mut first = None;
        for metric in [
            metric,
            &self.functions.gram_diagonal(),
            &vec![1.0; start.len()],
        ] {
            let layout = StageLayout::of(&self.functions);
            let (constraints, solve) = (&self.constraints, Subproblem::solve);
            let projection = project_by(constraints, start, metric, layout, solve);
            if self.constraints.hold(&projection.theta, TOLERANCE) {
                return Ok(projection.theta);
            }
            let status = *first.get_or_insert(projection.status);
            if status == ConicStatus::Infeasible {
                break;
            }
        }
        Err(first.unwrap_or(ConicStatus::Stalled))
    }

    /// `moved`, or where its mass is not positive the nearest point to `start` with positive mass, if one is feasible.
    fn with_mass(&self, start: &[f64], metric: &[f64], moved: Vec<f64>) -> Vec<f64> {
        let positive = |theta: &[f64]| {
            let masses = self.functions.nodal(theta).inertias;
            masses.iter().flatten().all(|m| *m > 0.0)
        };
        if positive(&moved) || !positive(start) {
            return moved;
        }
        let constraints = self.constraints_with_mass(start);
        let nearest = project(&constraints, start, metric);
        match constraints.hold(&nearest.theta, TOLERANCE) && positive(&nearest.theta) {
            true => nearest.theta,
            false => moved,
        }
    }

    /// Infeasible subset of constraints for a `start` whose projection ended with `status`.
    fn contradiction(&self, start: &[f64], metric: &[f64], status: ConicStatus) -> StartProjection {
        let judge = |candidate: &Constraints| feasibility(candidate, start, metric);
        match conflict(&self.constraints, &judge) {
            Some(found) if found.minimal => StartProjection::Contradiction(found.names),
            Some(found) => StartProjection::ContradictionAmong(found.names),
            None => StartProjection::Unsolved(status),
        }
    }

    /// Constraints plus positive masses at every node, relative to those of `start`.
    fn constraints_with_mass(&self, start: &[f64]) -> Constraints {
        let nodal = self.functions.nodal(start);
        let mut group = RowGroup::new("mass > 0");
        for (&f, values) in (self.functions.coefficient_set(0).iter()).zip(&nodal.inertias) {
            let (mass, range) = (self.functions.get(f), &self.functions.ranges()[f]);
            let least = POSITIVE * values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for i in 0..self.system.grid.nodes() {
                let row = mass.design.row(i).map(|(j, b)| (range.start + j, b));
                let time = self.system.grid.time(i);
                let bounds = [least - mass.fixed_at(i), f64::INFINITY];
                group.push(row, bounds, [time, time]);
            }
        }
        let mut constraints = self.constraints.clone();
        constraints.groups.push(group);
        constraints
    }
}
