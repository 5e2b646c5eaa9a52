//! The equation of motion as rows in the parameters, for the covariance of the estimates.

use super::equation::Equations;
use super::scale_row;
use crate::identifiability::EquationRows;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::record::Measurements;
use nalgebra::DMatrix;
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
    let equations = Equations::at(problem, &measurements, theta);
    let count: usize = equations.list.iter().map(|equation| equation.len()).sum();
    let n = problem.parameters();
    if count as f64 * (n * n) as f64 > MOST_WORK {
        return Err(NoEquationRows::ManySamples);
    }
    let mut sub = Subproblem::new(n);
    let mut records = Vec::new();
    let mut curvatures = Vec::new();
    for equation in &equations.list {
        let first = sub.residuals.len();
        let residuals = equation.residuals_at(problem, theta);
        let root = |e: f64| (equation.weight() * equation.loss.weight(e)).sqrt();
        equation.add_rows(problem, &residuals, root, &mut sub);
        records.push(first..sub.residuals.len());
        curvatures.push(equation.loss.curvature(&residuals));
    }
    let mut rows = DMatrix::zeros(count, n);
    for (record, curvature) in records.iter().zip(curvatures) {
        for i in record.clone() {
            let row = sub.residuals.row(i);
            row.for_each(|(j, x)| rows[(i, j)] += curvature * x);
        }
    }
    let scale = scale_row(problem, &problem.constraints, theta);
    let scalars = problem.functions.scalar_range();
    let held = scalars.map(|j| vec![(j, 1.0)]).chain(scale.clone());
    Ok(EquationRows {
        rows,
        residuals: sub.residuals.right().iter().map(|e| -e).collect(),
        records,
        held: held.collect(),
        is_scale_free: scale.is_some(),
    })
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
