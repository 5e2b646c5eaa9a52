//! The equation of motion as rows in the parameters, for the covariance of the estimates.

use super::dense_rows::DenseRows;
use super::equation::Equations;
use super::{scale_row, widths};
use crate::identifiability::EquationRows;
use crate::problem::Problem;
use crate::record::Measurements;
use nalgebra::DVector;
use std::sync::Arc;

/// Largest work of a covariance, rows x parameters^2: some seconds, and memory for 120,000 rows of 64 parameters.
const MOST_WORK: f64 = 5e8;

/// Reason why the minimum of an equation error has no confidence intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoEquationRows {
    /// A record does not provide a response.
    UnsupportedRecord,
    /// More samples and parameters than a covariance is computed for.
    ManySamples,
    /// The common scale of the functions is undetermined at every time.
    ScaleOverTime,
}

/// Rows and residuals of the equation of motion at the minimum `theta`, in the form in which the equation error is minimised and in
/// units of the root of the cost. With a robust loss each row and residual has the root of its weight, and the rows have the factor by
/// which the curvature of the cost differs from that of the weighted squares, so that `H^-1 S H^-1` is the covariance of the M-estimator.
///
/// # Errors
/// The reason why there are none.
pub fn equation_rows(problem: &Problem, theta: &[f64]) -> Result<EquationRows, NoEquationRows> {
    let measurements = measurements_at(problem, theta)?;
    widths::choose(problem, &measurements);
    let mut equations = Equations::at(problem, &measurements, theta);
    let count: usize = equations.list.iter().map(|equation| equation.len()).sum();
    let n = problem.parameters();
    if count as f64 * (n * n) as f64 > MOST_WORK {
        return Err(NoEquationRows::ManySamples);
    }
    let mut dense = DenseRows::of(problem, &equations, theta);
    for (record, equation) in dense.records.iter().zip(&equations.list) {
        let curvature = equation
            .loss
            .curvature(&equation.residuals_at(problem, theta));
        let mut rows = dense.rows.rows_mut(record.start, record.len());
        rows *= curvature;
    }
    let scale = scale_row(problem, &problem.constraints, theta);
    let change = match problem.functions.are_constants() {
        true => widths::change(problem, &measurements, &mut equations, theta),
        false => scale.is_none().then(|| shrinkage(problem, &dense, theta)),
    };
    let change = change.map(|change| &dense.rows * change);
    let scalars = problem.functions.scalar_range();
    let held = scalars.map(|j| vec![(j, 1.0)]).chain(scale.clone());
    Ok(EquationRows {
        residuals: dense.residuals.as_slice().to_vec(),
        rows: dense.rows,
        records: dense.records,
        change,
        held: held.collect(),
        is_scale_free: scale.is_some(),
    })
}

/// Shrinkage of the estimates by the errors `D` of the rows `X`, which contain the measured response: `(X^T X)^-1 D^T D theta`. Where the
/// residuals are these errors, `D theta`, its part along the estimates is `theta |e|^2/|f|^2` with the known part `f` of the equation,
/// the force.
fn shrinkage(problem: &Problem, dense: &DenseRows, theta: &[f64]) -> DVector<f64> {
    let functions = problem.functions.scalar_range().start;
    let estimates = DVector::from_column_slice(&theta[..functions]);
    let force = &dense.residuals - dense.rows.columns(0, functions) * &estimates;
    let share = dense.residuals.norm_squared() / force.norm_squared();
    let shift = if share.is_finite() { share } else { 0.0 };
    (estimates * shift).resize_vertically(theta.len(), 0.0)
}

/// Responses of all experiments, for a minimum `theta` whose scale is determined or one number.
///
/// # Errors
/// The reason why there are none.
pub(super) fn measurements_at(
    problem: &Problem,
    theta: &[f64],
) -> Result<Arc<Measurements>, NoEquationRows> {
    let scale = scale_row(problem, &problem.constraints, theta);
    if scale.is_some() && !has_constant_mass(problem) {
        return Err(NoEquationRows::ScaleOverTime);
    }
    Measurements::with_scalars(problem, problem.scalars(theta))
        .map_err(|_| NoEquationRows::UnsupportedRecord)
}

/// True if all experiments share one constant mass: only then is the common scale one number.
fn has_constant_mass(problem: &Problem) -> bool {
    let functions = &problem.functions;
    let mut masses = functions.coefficient_sets().iter().map(|set| set[0]);
    let shared = functions.coefficient_set(0)[0];
    masses.all(|mass| mass == shared) && functions.get(shared).parameters() == 1
}
