//! The constraint rows that hold with equality at a point.

use crate::constraints::{Cone, RowGroup};
use crate::problem::Problem;

/// A row is active if it is this near to its bound, relative to its scale
/// ([`crate::solvers::active_constraints`] uses the same).
const NEAR: f64 = 1e-6;

/// A row `a^T theta` that cannot change, or only to one side.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveRow {
    /// Columns and coefficients; pointing inwards for an inequality.
    pub entries: Vec<(usize, f64)>,
    /// Whether it is an equality.
    pub equality: bool,
    /// Name of its group.
    pub name: String,
}

/// All active rows; those of cones linearised.
pub(super) fn active_rows(problem: &Problem, theta: &[f64]) -> Vec<ActiveRow> {
    let groups = problem.constraints.groups.iter();
    let rows = groups.flat_map(|g| (0..g.rows.len()).filter_map(move |i| row(g, i, theta)));
    let cones = problem.constraints.cones.iter().flat_map(|group| {
        let active = move |cone: &Cone| {
            let entries = cone_row(cone, theta)?;
            Some(ActiveRow {
                entries,
                equality: false,
                name: group.name.clone(),
            })
        };
        group.cones.iter().filter_map(active)
    });
    rows.chain(cones).collect()
}

fn row(group: &RowGroup, i: usize, theta: &[f64]) -> Option<ActiveRow> {
    let [lower, upper] = group.bounds(i);
    let equality = lower == upper;
    if !equality && group.relative_violation(i, theta) < -NEAR {
        return None;
    }
    let value: f64 = group.rows.row(i).map(|(j, a)| a * theta[j]).sum();
    let inwards = if value - lower <= upper - value {
        1.0
    } else {
        -1.0
    };
    Some(ActiveRow {
        entries: group.rows.row(i).map(|(j, a)| (j, inwards * a)).collect(),
        equality,
        name: group.name.clone(),
    })
}

/// The inward normal of a cone that is active: `a_0 - sum_i (u_i/|u|) a_i`.
fn cone_row(cone: &Cone, theta: &[f64]) -> Option<Vec<(usize, f64)>> {
    if cone.violation(theta) < -NEAR {
        return None;
    }
    let values = cone.rows.multiply(theta);
    let parts: Vec<f64> = (values.iter().zip(cone.rows.right()))
        .map(|(v, r)| v - r)
        .collect();
    let norm = parts.iter().skip(1).map(|p| p * p).sum::<f64>().sqrt();
    let mut entries: Vec<(usize, f64)> = cone.rows.row(0).collect();
    for (i, part) in parts.iter().enumerate().skip(1) {
        if norm > 0.0 {
            entries.extend(cone.rows.row(i).map(|(j, a)| (j, -a * part / norm)));
        }
    }
    Some(entries)
}
