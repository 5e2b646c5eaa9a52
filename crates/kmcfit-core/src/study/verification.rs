//! Values of a fit computed again by the reference simulation and from normal equations, to verify stored results.
//!
//! The cost is a sum of squares of the reference response ([`EngineMode::Reference`]), the gradient `J^T s` with the slopes `s` of the
//! misfit and the Jacobian `J` by one reference tangent for each parameter, the covariance
//!
//! ```text
//! C = N^-1 + d d^T,    N = J^T W J + diag(1/s_prior^2),    d = -N^-1 J^T W e
//! ```
//!
//! by a Cholesky factorisation of the scaled normal equations, with the discretisation error `e` of the predictions. A fit computes the
//! same numbers by other simulations, by adjoints, and by an orthogonal factorisation.

use crate::identifiability::{CovarianceKind, has_equality_rows, step_error};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Loss, Weighting};
use crate::simd::sum::rms;
use crate::simulate::{EngineMode, SimulationError};
use nalgebra::{DMatrix, DVector};

/// Most products of parameters and nodes of a gradient by tangents: some seconds.
const MOST_WORK: usize = 200_000_000;

/// Values of a fit by the reference simulation.
#[derive(Debug, Clone)]
pub struct ReferenceValues {
    /// Cost and predictions.
    pub evaluation: Evaluation,
    /// Cost `J` from the sums of squares.
    pub cost: f64,
    /// Gradient `dJ/dtheta`; `None` for large problems.
    pub gradient: Option<Vec<f64>>,
    /// Covariance of the parameters, where it is the inverse of the information; `None` otherwise.
    pub covariance: Option<DMatrix<f64>>,
    /// Standard deviation of each channel from its residuals, in its SI unit, with the degrees of freedom of the parameters; `None` where
    /// it is given, and for correlated noise and robust losses, which have other estimates.
    pub sigmas: Vec<Option<f64>>,
}

impl ReferenceValues {
    /// Computes the values at the parameters `theta` of a fit of a simulated response, whose covariance has the kind `kind`.
    ///
    /// # Errors
    /// A [`SimulationError`] if the reference simulation fails.
    pub fn at(
        problem: &Problem,
        theta: &[f64],
        kind: Option<CovarianceKind>,
    ) -> Result<Self, SimulationError> {
        let mut evaluation = problem.workspace();
        problem.evaluate_for(EngineMode::Reference, theta, &mut evaluation)?;
        let is_small = theta.len().saturating_mul(problem.functions.nodes()) <= MOST_WORK;
        Ok(Self {
            cost: cost(problem, theta, &evaluation),
            gradient: is_small.then(|| gradient(problem, theta, &evaluation)),
            covariance: (kind == Some(CovarianceKind::Information))
                .then(|| covariance(problem, theta, &evaluation))
                .flatten(),
            sigmas: sigmas(problem, &evaluation),
            evaluation,
        })
    }
}

/// Sum of squares and regularisation; a robust loss has its own cost.
fn cost(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> f64 {
    let misfits = problem.predicted(evaluation).map(|(channel, predicted)| {
        match channel.loss() == Loss::Squares {
            true => {
                let weighted = channel.majorant(predicted).weighted;
                weighted.iter().map(|r| r * r).sum::<f64>()
            }
            false => channel.cost(predicted),
        }
    });
    misfits.sum::<f64>() + problem.regularisation(theta)
}

/// Change of all predictions along each parameter.
fn tangents<'a>(
    problem: &'a Problem,
    evaluation: &'a Evaluation,
) -> impl Iterator<Item = Vec<Vec<f64>>> + 'a {
    let n = problem.parameters();
    (0..n).map(move |j| {
        let mut unit = vec![0.0; n];
        unit[j] = 1.0;
        let change = problem.predictions_tangent(evaluation, &unit);
        change.into_iter().flatten().collect()
    })
}

fn gradient(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Vec<f64> {
    let predicted = problem.predicted(evaluation);
    let slopes: Vec<Vec<f64>> = predicted
        .map(|(c, predicted)| c.slopes(predicted))
        .collect();
    let mut gradient = problem.penalty_gradient(theta);
    for (g, change) in gradient.iter_mut().zip(tangents(problem, evaluation)) {
        let pairs = slopes.iter().flatten().zip(change.iter().flatten());
        *g += pairs.map(|(s, c)| s * c).sum::<f64>();
    }
    gradient
}

fn covariance(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Option<DMatrix<f64>> {
    let n = problem.parameters();
    let is_likelihood = problem.channels().all(|c| c.weighting().is_sigma());
    let is_small = n > 0 && n <= FEW_PARAMETERS;
    (is_small && is_likelihood && !has_equality_rows(problem, theta)).then_some(())?;
    let mut roots = Vec::with_capacity(problem.sample_count());
    for (channel, predicted) in problem.predicted(evaluation) {
        let factor = channel.information_root(predicted);
        let majorant = channel.majorant(predicted);
        roots.extend(majorant.roots.iter().map(|root| factor * root));
    }
    let columns = tangents(problem, evaluation).map(|mut change| {
        for (channel, change) in problem.channels().zip(&mut change) {
            channel.whiten_rows(change);
        }
        let rows = change.iter().flatten().zip(&roots);
        DVector::from_iterator(roots.len(), rows.map(|(a, root)| a * root))
    });
    let jacobian = DMatrix::from_columns(&columns.collect::<Vec<_>>());
    let mut normal = jacobian.tr_mul(&jacobian);
    for (index, prior) in problem.functions.priors() {
        normal[(index, index)] += 1.0 / (prior.sigma * prior.sigma);
    }
    let sizes = normal.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (sizes[i] * sizes[j]));
    let inverse = scaled.cholesky()?.inverse();
    let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (sizes[i] * sizes[j]));
    Some(match step_error(problem, evaluation, &roots) {
        None => inverse,
        Some(error) => {
            let shift = &inverse * jacobian.tr_mul(&error);
            inverse + &shift * shift.transpose()
        }
    })
}

fn sigmas(problem: &Problem, evaluation: &Evaluation) -> Vec<Option<f64>> {
    let share = (problem.parameters() as f64 / problem.sample_count() as f64).min(0.5);
    let each = problem.predicted(evaluation).map(|(channel, predicted)| {
        let is_estimated = matches!(channel.weighting(), Weighting::Estimated { .. });
        let is_plain = channel.correlation().is_none() && channel.loss() == Loss::Squares;
        (is_estimated && is_plain).then(|| {
            let residuals: Vec<f64> = channel.residuals(predicted).collect();
            rms(&residuals) / (1.0 - share).sqrt()
        })
    });
    each.collect()
}
