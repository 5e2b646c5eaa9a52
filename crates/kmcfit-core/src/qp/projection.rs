//! Constraints of a problem as rows of a subproblem, and the projection onto them.

use super::{ConicStatus, Solution, StageLayout, Subproblem};
use crate::constraints::{Cone, Constraints, RowGroup, Rows};

/// Row of a subproblem that represents a row of a group, for the assignment of its multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowPosition {
    /// Index of an equality.
    Equality(usize),
    /// Index of an inequality.
    Inequality(usize),
}

impl Subproblem {
    /// Adds `constraints` for the step from `theta`; the first variables of the subproblem are the changes of the parameters. Returns the place of
    /// each group's rows.
    pub fn constrain(&mut self, constraints: &Constraints, theta: &[f64]) -> Vec<Vec<RowPosition>> {
        let positions = (constraints.groups.iter())
            .map(|group| self.constrain_group(group, theta))
            .collect();
        for cone in constraints.cones.iter().flat_map(|group| &group.cones) {
            let values = cone.rows.multiply(theta);
            let mut rows = Rows::new();
            for (i, value) in values.iter().enumerate() {
                rows.push(cone.rows.row(i), cone.rows.right()[i] - value);
            }
            self.cones.push(Cone { rows });
        }
        positions
    }

    fn constrain_group(&mut self, group: &RowGroup, theta: &[f64]) -> Vec<RowPosition> {
        let values = group.rows.multiply(theta);
        let rows = values.iter().enumerate().map(|(i, value)| {
            let [lower, upper] = group.bounds(i);
            if lower == upper {
                self.equalities.push(group.rows.row(i), lower - value);
                RowPosition::Equality(self.equalities.len() - 1)
            } else {
                self.bound(group.rows.row(i), lower - value, upper - value);
                RowPosition::Inequality(self.inequalities.len() - 1)
            }
        });
        rows.collect()
    }
}

impl Solution {
    /// Multipliers by group and row.
    pub fn by_group(&self, positions: &[Vec<RowPosition>]) -> Vec<Vec<f64>> {
        let multiplier = |position: &RowPosition| match *position {
            RowPosition::Equality(i) => self.equality_multipliers[i],
            RowPosition::Inequality(i) => self.multipliers[i],
        };
        let group = |rows: &Vec<RowPosition>| rows.iter().map(multiplier).collect();
        positions.iter().map(group).collect()
    }
}

/// Point of the constraint set nearest to `theta`, with the multipliers of all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// Status of the quadratic program.
    pub status: ConicStatus,
    /// Nearest point.
    pub theta: Vec<f64>,
    /// Multipliers by group and row, of `1/2 |theta' - theta|^2` in the metric.
    pub multipliers: Vec<Vec<f64>>,
}

/// Projects `theta` onto the constraints in the diagonal metric `metric`:
/// minimises `sum_j metric_j (theta'_j - theta_j)^2`.
pub fn project(constraints: &Constraints, theta: &[f64], metric: &[f64]) -> Projection {
    project_by(constraints, theta, metric, None, Subproblem::solve)
}

/// [`project`] by a solver of the quadratic program, with the parameters in time where they are known.
pub fn project_by(
    constraints: &Constraints,
    theta: &[f64],
    metric: &[f64],
    layout: Option<StageLayout>,
    solve: impl FnOnce(&Subproblem) -> Solution,
) -> Projection {
    let mut sub = Subproblem::new(theta.len());
    sub.layout = layout;
    sub.proximal.copy_from_slice(metric);
    let positions = sub.constrain(constraints, theta);
    let solution = solve(&sub);
    Projection {
        status: solution.status,
        theta: constraints.moved(theta, &solution.z),
        multipliers: solution.by_group(&positions),
    }
}
