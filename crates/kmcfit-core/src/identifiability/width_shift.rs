//! Shifts of the estimates by the width of Coulomb friction.
//!
//! Smoothed friction `F v / sqrt(v^2 + w^2)` lets a mass creep that Coulomb friction holds, so that estimates depend on the width `w`. One
//! Gauss-Newton step from the optimum gives their shift where the width is halved:
//!
//! ```text
//! delta = -H^+ J^T W (z_(w/2) - z_w)
//! ```
//!
//! Both predictions are those on half the step, on which half the width is as stable as the width on the whole step.

use crate::objective::Evaluation;
use crate::problem::Problem;

impl Problem {
    /// Change of the predictions of each channel where the width is halved. `None` without friction, and where half the step cannot be
    /// simulated.
    pub(crate) fn changes_by_width(&self, evaluation: &Evaluation) -> Option<Vec<Vec<f64>>> {
        let [wide, narrow] = [self, &narrower(self)?].map(|problem| changes(problem, evaluation));
        let pairs = narrow?.into_iter().zip(wide?);
        let differences = pairs.map(|(narrow, wide)| {
            let pairs = narrow.iter().zip(&wide);
            pairs.map(|(a, b)| a - b).collect()
        });
        Some(differences.collect())
    }
}

/// The problem with half the width; `None` without friction.
fn narrower(problem: &Problem) -> Option<Problem> {
    let width = problem.system.friction_width()?;
    let mut narrow = problem.clone();
    narrow
        .parts_mut()
        .system
        .structure
        .set_friction_width(0.5 * width);
    Some(narrow)
}

/// Predictions of each channel on half the step less those of the evaluation.
fn changes(problem: &Problem, evaluation: &Evaluation) -> Option<Vec<Vec<f64>>> {
    let refined = problem.on_half_step(evaluation).ok()??;
    Some(refined.changes.into_iter().flatten().collect())
}
