//! Shifts of the estimates by changes of the predictions, such as the discretisation error, beside their standard errors.

use super::active::{ActiveRow, active_rows};
use super::covariance::Information;
use super::directions::Directions;
use super::sensitivity::Sensitivity;
use super::step_error::{richardson, weighted};
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
        let shifts = self.shifts_by(theta, evaluation, changes)?;
        let in_errors = shifts.iter().map(|[shift, error]| shift.abs() / error);
        // Zero over zero for a parameter that is held or undetermined.
        let in_errors = in_errors.filter(|x| !x.is_nan());
        Some(richardson(self) * in_errors.fold(0.0, f64::max))
    }

    /// Shift of each parameter by `changes` of the predictions of each channel, by one Gauss-Newton step, and its standard error.
    /// `None` as for [`Problem::shift_by_steps`].
    pub(crate) fn shifts_by(
        &self,
        theta: &[f64],
        evaluation: &Evaluation,
        changes: Vec<Vec<f64>>,
    ) -> Option<Vec<[f64; 2]>> {
        let n = self.parameters();
        if n == 0 || n > FEW_PARAMETERS {
            return None;
        }
        let directions = Directions::new(self, evaluation, n, n);
        let sensitivity = Sensitivity::along(self, evaluation, directions);
        let error = weighted(self, changes, &sensitivity.weight_roots, 1.0)?;
        let active = active_rows(self, theta);
        let held: Vec<&ActiveRow> = active.iter().collect();
        let information = Information::new(self, theta, sensitivity);
        information.with_error(&error).shifts(&held)
    }
}
