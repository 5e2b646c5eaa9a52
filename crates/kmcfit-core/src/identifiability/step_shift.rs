//! Largest shift of the estimates by the discretisation error, in standard errors.

use super::active::{ActiveRow, active_rows};
use super::covariance::Information;
use super::directions::Directions;
use super::sensitivity::Sensitivity;
use super::step_error::weighted;
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};

impl Problem {
    /// Largest shift of an estimate by the discretisation error of `changes`, the predictions of each channel on half the step less
    /// those on the whole step, in standard errors. `None` without parameters, with more than [`FEW_PARAMETERS`], and where
    /// the error is not finite.
    pub fn shift_by_steps(
        &self,
        theta: &[f64],
        evaluation: &Evaluation,
        changes: Vec<Vec<f64>>,
    ) -> Option<f64> {
        let n = self.parameters();
        if n == 0 || n > FEW_PARAMETERS {
            return None;
        }
        let directions = Directions::new(self, evaluation, n, n);
        let sensitivity = Sensitivity::along(self, evaluation, directions);
        let error = weighted(self, changes, &sensitivity.roots)?;
        let active = active_rows(self, theta);
        let held: Vec<&ActiveRow> = active.iter().collect();
        let information = Information::new(self, theta, sensitivity).with_error(Some(error));
        information.largest_shift(&held)
    }
}
