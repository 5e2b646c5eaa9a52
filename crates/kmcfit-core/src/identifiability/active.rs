//! Active constraints: the rows that hold with equality at a point, cones linearised.

use crate::constraints::{Cone, RowGroup};
use crate::problem::Problem;

/// Largest distance from the bound of an active row, relative to its scale ([`crate::solvers::active_constraints`] uses the
/// same).
const NEAR: f64 = 1e-6;

/// Row `a^T theta` of an active constraint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveRow {
    /// Columns and coefficients; for an inequality the row points inwards.
    pub entries: Vec<(usize, f64)>,
    /// True for an equality.
    pub equality: bool,
    /// Name of its group.
    pub name: String,
}

/// All active rows; cones are linearised.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::constraints::Constraint;
    use crate::model::CoefficientSpec;

    fn problem(statement: Constraint) -> Problem {
        let times: Vec<f64> = (0..=50).map(|i| 0.1 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| (2.0 * t).cos()).collect();
        let record = Record::new("decay")
            .from_state(1.0, 0.0)
            .displacement(&times, &samples);
        let parts = [
            CoefficientSpec::constant(1.0),
            CoefficientSpec::constant(0.4),
            CoefficientSpec::constant(4.0).max(5.0),
        ];
        let builder = Builder::new(parts).record(record).constrain(statement);
        builder.build().unwrap()
    }

    fn at_most(max: f64) -> Constraint {
        Constraint::DampingRatio { max }
    }

    #[test]
    fn the_row_of_a_cone_is_the_slope_of_its_slack() {
        let problem = problem(at_most(0.1));
        // c = 2 zeta sqrt(m k) with zeta = 0.1.
        let theta = [1.0, 0.4, 4.0];
        let rows = active_rows(&problem, &theta);
        let cones = || {
            problem
                .constraints
                .cones
                .iter()
                .flat_map(|group| &group.cones)
        };
        assert!(!rows.is_empty() && rows.len() == cones().count());
        let slack = |cone: &Cone, theta: &[f64]| {
            let parts = cone.rows.multiply(theta);
            let parts: Vec<f64> = parts
                .iter()
                .zip(cone.rows.right())
                .map(|(v, r)| v - r)
                .collect();
            parts[0] - parts[1..].iter().map(|p| p * p).sum::<f64>().sqrt()
        };
        for (row, cone) in rows.iter().zip(cones()) {
            assert!(!row.equality);
            assert!(slack(cone, &theta).abs() < 1e-12);
            for j in 0..3 {
                let along = |step: f64| {
                    let mut moved = theta;
                    moved[j] += step;
                    slack(cone, &moved)
                };
                let difference = (along(1e-5) - along(-1e-5)) / 2e-5;
                let entries = row.entries.iter().filter(|(column, _)| *column == j);
                let slope: f64 = entries.map(|(_, a)| a).sum();
                assert!(
                    (slope - difference).abs() < 1e-8,
                    "{j}: {slope} {difference}"
                );
            }
        }
    }

    #[test]
    fn rows_point_inwards_and_only_active_ones_are_listed() {
        let problem = problem(at_most(0.5));
        assert_eq!(active_rows(&problem, &[1.0, 0.4, 4.0]), []);
        let rows = active_rows(&problem, &[1.0, 0.4, 5.0]);
        let [row] = rows.as_slice() else {
            panic!("{rows:?}");
        };
        assert!(!row.equality);
        assert_eq!(row.entries, [(2, -1.0)]);
    }
}
