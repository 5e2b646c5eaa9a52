//! Covariance of the estimates of a fit with many parameters, from the banded factor of its normal matrix.
//!
//! The covariance is that of [`Bands`](crate::identifiability::Bands): `H^-1 M H^-1` with penalties, where `H = J^T W J + R` and `M` is
//! the part of the samples and priors, `H^-1` where the rule of the penalties gives coverage; equality constraints hold exactly,
//! inequalities are neglected. A combination `g` of the parameters takes two substitutions: with `a = H^-1 g` its variance is
//! `g^T a`, or the squared norm of the rows of samples and priors times `a`. The shift of the estimates by the discretisation error of
//! the time steps is added as there.

use crate::identifiability::{CovarianceKind, Quantities, Quantity, is_bayesian, step_error};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::qp::{BandedFactor, Subproblem};
use crate::record::{Loss, ScoreCovariance};
use crate::solvers::{add_penalties, add_priors, add_soft, linear_predictions};

/// Quantities at the minimum `theta`, evaluated in `evaluation`, of a fit with more than 64 parameters. `None` for others; for samples without
/// sigma, with a robust loss or residuals that their noise model does not make white; and where the normal matrix has no banded factor: it is
/// singular, or functions with many parameters overlap in time.
pub fn quantities_of_many(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<Quantities> {
    let is_gaussian = problem.channels().all(|channel| {
        channel.weighting().is_sigma()
            && channel.loss() == Loss::Squares
            && channel.noise().scores == ScoreCovariance::Model
    });
    (problem.parameters() > FEW_PARAMETERS && is_gaussian).then_some(())?;
    let normal = NormalMatrix::of(problem, theta, evaluation)?;
    let shift = normal.shift(problem, evaluation);
    let mut quantities = Quantities {
        kind: normal.kind,
        ..Quantities::at(problem, theta)
    };
    for quantity in quantities.all_mut() {
        let variance = normal.variance(&quantity.gradient, &shift);
        quantity.standard_error = variance.max(0.0).sqrt().hypot(quantity.basis_error);
    }
    let is_known = |scalar: &Quantity| scalar.standard_error.is_finite();
    quantities
        .scalars
        .iter()
        .all(is_known)
        .then_some(quantities)
}

/// Linearised rows at a minimum, in parameters and states, and the factor of their normal matrix.
struct NormalMatrix {
    sub: Subproblem,
    factor: BandedFactor,
    parameters: usize,
    samples: usize,
    /// Number of rows of samples and priors, which come first.
    measured: usize,
    kind: CovarianceKind,
}

impl NormalMatrix {
    fn of(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Option<Self> {
        let mut sub = linear_predictions(problem, evaluation);
        let samples = sub.residuals.len();
        add_priors(problem, theta, &mut sub);
        let measured = sub.residuals.len();
        add_penalties(problem, theta, &mut sub);
        add_soft(problem, theta, &mut sub);
        sub.constrain(&problem.constraints, theta);
        let is_pulled = sub.residuals.len() > measured;
        Some(Self {
            factor: BandedFactor::of(&sub)?,
            sub,
            parameters: problem.parameters(),
            samples,
            measured,
            kind: match (is_pulled, is_bayesian(problem)) {
                (false, _) => CovarianceKind::Information,
                (true, true) => CovarianceKind::Bayesian,
                (true, false) => CovarianceKind::Penalised,
            },
        })
    }

    /// Product of the covariance and the combination `gradient` of the parameters.
    fn times(&self, gradient: &[(usize, f64)]) -> Vec<f64> {
        let entries = |vector: &[f64]| -> Vec<(usize, f64)> {
            let all = vector.iter().copied().enumerate();
            all.filter(|(_, a)| *a != 0.0).collect()
        };
        let (mut product, _) = self.factor.times(gradient);
        if self.kind == CovarianceKind::Penalised {
            let mut rows = self.sub.residuals.multiply(&product);
            rows[self.measured..].fill(0.0);
            let mut moments = vec![0.0; self.sub.variables];
            (self.sub.residuals).transpose_multiply_add(&rows, &mut moments);
            product = self.factor.times(&entries(&moments)).0;
        }
        product.truncate(self.parameters);
        product
    }

    /// Shift of the parameters by the discretisation error of the time steps; zero without one.
    fn shift(&self, problem: &Problem, evaluation: &Evaluation) -> Vec<f64> {
        let predicted = problem.predicted(evaluation);
        let weight_roots: Vec<f64> = predicted
            .flat_map(|(channel, predicted)| channel.majorant(predicted).weight_roots)
            .collect();
        let error =
            step_error(problem, evaluation, &weight_roots).filter(|e| e.len() == self.samples);
        let Some(error) = error else {
            return vec![0.0; self.parameters];
        };
        let mut rows = vec![0.0; self.sub.residuals.len()];
        let samples = rows[..self.samples].iter_mut();
        samples.zip(error.iter()).for_each(|(row, e)| *row = -e);
        let mut moments = vec![0.0; self.sub.variables];
        (self.sub.residuals).transpose_multiply_add(&rows, &mut moments);
        let entries: Vec<(usize, f64)> = moments.into_iter().enumerate().collect();
        let (mut shift, _) = self.factor.times(&entries);
        shift.truncate(self.parameters);
        shift
    }

    /// Variance of a combination of the parameters.
    fn variance(&self, gradient: &[(usize, f64)], shift: &[f64]) -> f64 {
        let dot = |a: &[f64]| gradient.iter().map(|(j, b)| a[*j] * b).sum::<f64>();
        dot(&self.times(gradient)) + dot(shift).powi(2)
    }
}
