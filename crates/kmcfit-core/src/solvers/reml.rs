//! Estimates noise standard deviations, noise correlations and penalty weights by restricted maximum likelihood (REML,
//! [`RestrictedLikelihood`]) from the linearisation at the optimum of a fit.

use super::linearization::{add_penalties, add_priors};
use crate::functions::{Penalty, WeightRule};
use crate::identifiability::{Factorisation, stacked};
use crate::noise::{ChannelMoments, NoiseCoordinates, PenaltyMoments, RestrictedLikelihood};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::qp::Subproblem;
use crate::record::{Channel, Loss, NoiseEstimate, ScoreCovariance, Weighting};
use nalgebra::DMatrix;

/// Ratio `tau/T` of the smoothing time of the initial penalty weight to the duration of the grid, dimensionless.
const SMOOTHING_SHARE: f64 = 0.1;

/// True if the weight of a penalty is estimated by restricted likelihood.
pub(super) fn is_estimated(penalty: &Penalty) -> bool {
    penalty.rule == Some(WeightRule::RestrictedLikelihood)
}

/// True if the weight of some penalty is estimated by restricted likelihood.
pub(super) fn estimates_weights(problem: &Problem) -> bool {
    problem.penalties.iter().any(is_estimated)
}

/// Sets each weight estimated by restricted likelihood to `w = |A u|^2 tau^(2q) / T`.
///
/// `A` is the sqrt-weighted Jacobian of the predictions, `u` the parameters of the constant function 1, `q` the order of the
/// penalty, `T` the duration of the grid (s), and `tau = T/10` ([`SMOOTHING_SHARE`]). With this weight, a uniform unit change of
/// the function costs as much misfit as a derivative of order `q` of size `1/tau^q` throughout the grid (a unit change over `tau`)
/// costs penalty. Weights are left as they are if the simulation at `start` fails or the formula gives no positive finite number.
pub(super) fn start_weights(problem: &mut Problem, start: &[f64]) {
    let Ok(evaluation) = problem.evaluate(start) else {
        return;
    };
    let grid = &problem.system.grid;
    let duration = (grid.nodes() - 1) as f64 * grid.step();
    let weights: Vec<f64> = (problem.penalties.iter())
        .map(|penalty| {
            let function = problem.functions.get(penalty.function);
            let Some(basis) = function.basis.as_ref().filter(|_| is_estimated(penalty)) else {
                return penalty.weight;
            };
            let mut along = vec![0.0; problem.parameters()];
            let range = problem.functions.ranges()[penalty.function].clone();
            along[range].copy_from_slice(&basis.constant(grid, 1.0));
            let information = information(problem, &evaluation, &along);
            let time = SMOOTHING_SHARE * duration;
            let weight = information * time.powi(2 * penalty.order as i32) / duration;
            match weight.is_finite() && weight > 0.0 {
                true => weight,
                false => penalty.weight,
            }
        })
        .collect();
    let penalties = problem.parts_mut().penalties.iter_mut();
    for (penalty, weight) in penalties.zip(weights) {
        penalty.weight = weight;
    }
}

/// Returns `sum w_i z_i^2`, in units of J, where `z` is the derivative of the predictions along `along`; noise correlation and
/// robust losses are ignored.
fn information(problem: &Problem, evaluation: &Evaluation, along: &[f64]) -> f64 {
    let derivatives = problem.predictions_tangent(evaluation, along);
    let channels = problem.channels().zip(derivatives.iter().flatten());
    let each = channels.map(|(channel, derivatives)| {
        let weight = |i: usize| channel.weighting().weight(i, channel.len());
        let squares = derivatives
            .iter()
            .enumerate()
            .map(|(i, z)| weight(i) * z * z);
        squares.sum::<f64>()
    });
    each.sum()
}

/// Returns a copy of the problem with the noise parameters and penalty weights that maximise the restricted likelihood
/// linearised at `theta`; each channel stores the covariance of its noise coordinates. Channels with a robust loss keep their
/// noise parameters. `None` with more than [`FEW_PARAMETERS`] parameters, if nothing is to be estimated, or if the likelihood has
/// no maximum.
pub(super) fn refined(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<Problem> {
    if problem.parameters() > FEW_PARAMETERS {
        return None;
    }
    let found = likelihood(problem, theta, evaluation).0.fit()?;
    let mut next = problem.clone();
    let parts = next.parts_mut();
    let channels = parts.experiments.iter_mut().flat_map(|e| &mut e.channels);
    for (channel, noise) in channels.zip(found.channels.iter().zip(found.covariances)) {
        if channel.loss() == Loss::Squares {
            *channel = with_coordinates(channel, noise.0, noise.1);
        }
    }
    let penalties = parts.penalties.iter_mut().filter(|p| is_estimated(p));
    for (penalty, log_weight) in penalties.zip(&found.log_weights) {
        penalty.weight = log_weight.exp();
    }
    Some(next)
}

/// Builds the restricted likelihood of noise and weights in the q parameter combinations determined by data, priors and
/// penalties, scaled so that their Gram matrix (at the current weights) is the identity; with the matrix that scales them
/// ([`determined`]).
fn likelihood(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> (RestrictedLikelihood, DMatrix<f64>) {
    let known = known_rows(problem, theta);
    let penalties: Vec<(&Penalty, DMatrix<f64>)> = (problem.penalties.iter())
        .filter(|p| is_estimated(p))
        .map(|p| (p, rows_of(problem, theta, p)))
        .collect();
    let rows = residual_rows(problem, evaluation);
    let weighted = penalties.iter().map(|(p, rows)| rows * p.weight.sqrt());
    let all = weighted.fold(stacked(&rows, &known), |all, more| stacked(&all, &more));
    let map = determined(&all);
    let (rows, known) = (rows * &map, known * &map);
    let mut first = 0;
    let moments = problem.channels().map(|channel| {
        let own = rows.rows(first, channel.len()).into_owned();
        first += channel.len();
        let is_robust = channel.loss() != Loss::Squares;
        let estimates = matches!(channel.weighting(), Weighting::Estimated { .. }) && !is_robust;
        // For a robust loss the rows are already whitened and weighted by its quadratic majorant, so no correlation is applied
        // here.
        let correlation = channel.correlation().filter(|_| !is_robust);
        ChannelMoments::new(&own, correlation, estimates)
    });
    let moments = moments.collect();
    let penalties = penalties.into_iter().map(|(penalty, rows)| {
        let rank = Factorisation::of(&rows.columns(0, rows.ncols() - 1).into_owned()).rank;
        let rows = rows * &map;
        PenaltyMoments {
            gram: rows.tr_mul(&rows),
            rank,
            log_weight: penalty.weight.ln(),
        }
    });
    let penalties = penalties.collect();
    let likelihood = RestrictedLikelihood::new(moments, known.tr_mul(&known));
    (likelihood.with_penalties(penalties), map)
}

/// Returns samples x (n+1) rows `sqrt(w_i) [dprediction_i/dtheta, r_i]` with `r` = prediction minus sample; rows of channels with
/// a robust loss are whitened and reweighted.
fn residual_rows(problem: &Problem, evaluation: &Evaluation) -> DMatrix<f64> {
    let n = problem.parameters();
    let mut rows = (problem.predictions_jacobian(evaluation)).insert_column(n, 0.0);
    let mut first = 0;
    for (channel, predicted) in problem.predicted(evaluation) {
        let count = channel.len();
        if channel.loss() == Loss::Squares {
            for (i, r) in channel.residuals(predicted).enumerate() {
                rows[(first + i, n)] = r;
                let root = channel.weighting().weight(i, count).sqrt();
                rows.row_mut(first + i).scale_mut(root);
            }
        } else {
            let mut own = rows.rows(first, count).into_owned();
            for mut column in own.column_iter_mut() {
                channel.whiten_rows(column.as_mut_slice());
            }
            let majorant = channel.majorant(predicted);
            for (i, (root, r)) in majorant
                .weight_roots
                .iter()
                .zip(&majorant.weighted)
                .enumerate()
            {
                own.row_mut(i).scale_mut(*root);
                own[(i, n)] = *r;
            }
            rows.rows_mut(first, count).copy_from(&own);
        }
        first += count;
    }
    rows
}

/// Returns the rows of priors and of penalties with fixed weights as a rows x (n+1) matrix; the last column is their residual at
/// `theta`.
fn known_rows(problem: &Problem, theta: &[f64]) -> DMatrix<f64> {
    let mut given = problem.clone();
    given.parts_mut().penalties.retain(|p| !is_estimated(p));
    let mut subproblem = Subproblem::new(problem.parameters());
    add_penalties(&given, theta, &mut subproblem);
    add_priors(problem, theta, &mut subproblem);
    dense(&subproblem, problem.parameters())
}

/// Returns the rows of a penalty without its weight as a rows x (n+1) matrix; the last column is their residual at `theta`.
fn rows_of(problem: &Problem, theta: &[f64], penalty: &Penalty) -> DMatrix<f64> {
    let n = problem.parameters();
    let range = problem.functions.ranges()[penalty.function].clone();
    let residuals = penalty.residuals(&theta[range.clone()]);
    let mut rows = DMatrix::zeros(residuals.len(), n + 1);
    for (i, r) in residuals.iter().enumerate() {
        let entries = penalty.rows.row(i);
        entries.for_each(|(j, a)| rows[(i, range.start + j)] += a);
        rows[(i, n)] = *r;
    }
    rows
}

/// Returns the residual rows as a dense rows x (n+1) matrix; the last column is the residual at `z = 0`, i.e. `-b`.
fn dense(subproblem: &Subproblem, n: usize) -> DMatrix<f64> {
    let residuals = &subproblem.residuals;
    let mut rows = DMatrix::zeros(residuals.len(), n + 1);
    for i in 0..residuals.len() {
        (residuals.row(i)).for_each(|(j, a)| rows[(i, j)] += a);
        rows[(i, n)] = -residuals.right()[i];
    }
    rows
}

/// Returns the (n+1) x (q+1) matrix `M` for which the first q columns of `rows * M` are orthonormal and the last column is
/// unchanged; q is the rank of the n parameter columns, scaled to unit length because parameters have different units.
fn determined(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = rows.ncols() - 1;
    let mut scaled = rows.columns(0, n).into_owned();
    let mut sizes = Vec::with_capacity(n);
    for mut column in scaled.column_iter_mut() {
        let size = column.norm().max(f64::MIN_POSITIVE);
        column /= size;
        sizes.push(size);
    }
    let root = Factorisation::of(&scaled).inverse_root();
    let q = root.ncols();
    DMatrix::from_fn(n + 1, q + 1, |i, j| match (i < n, j < q) {
        (true, true) => root[(i, j)] / sizes[i],
        (false, false) => 1.0,
        _ => 0.0,
    })
}

/// Returns the channel with the noise of `coordinates`: sigma is multiplied by `exp(log_sigma)`, and the correlation model takes
/// the parameters `correlation_parameters`.
fn with_coordinates(
    channel: &Channel,
    coordinates: &NoiseCoordinates,
    covariance: DMatrix<f64>,
) -> Channel {
    let mut next = channel.clone();
    if let (Weighting::Estimated { sigma }, Some(log)) =
        (channel.weighting(), coordinates.log_sigma)
    {
        let sigma = sigma * log.exp();
        next = next.with_weighting(Weighting::Estimated { sigma });
    }
    let correlation = (channel.correlation()).map(|c| c.at(&coordinates.correlation_parameters));
    next.with_noise(NoiseEstimate {
        correlation,
        covariance,
        scores: ScoreCovariance::Model,
    })
}
