//! The equation of motion at the samples as rows in the parameters, for the covariance of the estimates.

use super::measured::{Measured, Measurements};
use super::{add_rows, scale_row};
use crate::identifiability::EquationRows;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::record::Experiment;
use nalgebra::DMatrix;

/// Largest work of a covariance, samples x parameters^2: some seconds, and memory for 120,000 samples of 64 parameters.
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

/// Rows and residuals of the equation of motion at the minimum `theta`, in units of the root of the cost.
///
/// # Errors
/// The reason why there are none.
pub fn equation_rows(problem: &Problem, theta: &[f64]) -> Result<EquationRows, NoEquationRows> {
    let scale = scale_row(problem, &problem.constraints, theta);
    if scale.is_some() && !has_constant_mass(problem) {
        return Err(NoEquationRows::ScaleOverTime);
    }
    let measurements = Measurements::with_scalars(problem, problem.scalars(theta))
        .map_err(|_| NoEquationRows::UnsupportedRecord)?;
    let pairs = problem.experiments.iter().zip(&measurements.experiments);
    let pairs: Vec<(&Experiment, &Measured)> = pairs
        .filter_map(|(experiment, measured)| Some((experiment, measured.as_ref()?)))
        .collect();
    let (samples, n) = (
        pairs.iter().map(|(_, m)| m.places.len()).sum::<usize>(),
        problem.parameters(),
    );
    if samples as f64 * (n * n) as f64 > MOST_WORK {
        return Err(NoEquationRows::ManySamples);
    }
    let mut sub = Subproblem::new(n);
    let mut records = Vec::new();
    for (experiment, measured) in pairs {
        let first = sub.residuals.len();
        add_rows(
            problem,
            experiment,
            measured,
            measured.weight.sqrt(),
            theta,
            &mut sub,
        );
        records.push(first..sub.residuals.len());
    }
    let mut rows = DMatrix::zeros(samples, n);
    for i in 0..samples {
        sub.residuals.row(i).for_each(|(j, x)| rows[(i, j)] += x);
    }
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

/// True if all experiments share one constant mass: only then is the common scale one number.
fn has_constant_mass(problem: &Problem) -> bool {
    let functions = &problem.functions;
    let mut masses = functions.coefficient_sets().iter().map(|set| set[0]);
    let shared = functions.coefficient_set(0)[0];
    masses.all(|mass| mass == shared) && functions.get(shared).parameters() == 1
}
