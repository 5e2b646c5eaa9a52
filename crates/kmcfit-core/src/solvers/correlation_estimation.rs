//! Estimation of the correlation of noise from the residuals of a fit.

use super::fit::Fit;
use super::settings::{FitSettings, Solver};
use crate::identifiability::Factorisation;
use crate::noise::{
    Autoregression, ChannelMoments, Correlation, CorrelationLaw, HIGHEST_ORDER, NoiseCoordinates,
    RestrictedLikelihood, burg, select_exponential, select_order, uninterrupted_runs,
};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, NoiseEstimate, NoiseModel, Weighting};
use crate::simd::sum::rms;
use nalgebra::DMatrix;

/// Smallest number of samples per parameter for which an order is chosen: with fewer, the residuals are much whiter than the
/// noise.
const SAMPLES_PER_PARAMETER: usize = 8;
/// Range of the residuals, as a share of the variation of the samples, in which they may be noise: smaller ones are rounding
/// and step-size errors, larger ones those of a model that does not explain the record.
const NOISE: [f64; 2] = [1e-4, 0.2];
/// Residuals larger than this many stated sigmas are those of an incomplete model.
const BEYOND_SIGMA: f64 = 3.0;
/// Largest growth of the residuals, root mean square, by a correlation. Least squares absorbs narrowband noise at the resonance,
/// up to half of it; a correlation that stands for a missing term can leave residuals several times as large.
const GROWTH: f64 = 2.0;

/// True if the noise of some channel may be correlated.
pub(super) fn may_correlate(problem: &Problem, settings: &FitSettings) -> bool {
    let is_likelihood = !matches!(
        settings.solver,
        Solver::SteepestDescent | Solver::EquationError
    );
    is_likelihood && problem.parameters() > 0 && problem.channels().any(|c| asks(problem, c))
}

/// True if the noise model of a channel asks for a correlation that its samples can show.
fn asks(problem: &Problem, channel: &Channel) -> bool {
    let is_long = problem.sample_count() >= SAMPLES_PER_PARAMETER * problem.parameters();
    match channel.noise_model() {
        NoiseModel::White => false,
        NoiseModel::Auto => channel.weighting().is_sigma() && is_long,
        NoiseModel::Autoregressive { .. } => channel.weighting().is_sigma(),
    }
}

/// The problem with correlations estimated from the residuals of `found`; with `is_frozen`, orders stay as they are.
pub(super) fn correlated(problem: &Problem, found: &Fit, is_frozen: bool) -> Problem {
    let mut next = problem.clone();
    let judged: Vec<bool> = problem.channels().map(|c| asks(problem, c)).collect();
    let mut judged = judged.into_iter();
    let experiments = next.parts_mut().experiments.iter_mut();
    for (experiment, predictions) in experiments.zip(&found.best.evaluation.predictions) {
        for (channel, predicted) in experiment.channels.iter_mut().zip(predictions) {
            if judged.next() == Some(true) {
                let correlation = estimate(channel, predicted, is_frozen);
                let noise = NoiseEstimate {
                    correlation,
                    ..NoiseEstimate::default()
                };
                *channel = channel.clone().with_noise(noise);
            }
        }
    }
    next
}

/// Correlation of the residuals of a channel; `None` for white ones.
fn estimate(channel: &Channel, predicted: &[f64], is_frozen: bool) -> Option<Correlation> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    if channel.noise_model() == NoiseModel::Auto && !are_noise(channel, &residuals) {
        return None;
    }
    let sigma = |i: usize| channel.weighting().sigma(i).unwrap_or(1.0);
    let each = residuals.iter().enumerate();
    let normalised: Vec<f64> = each.map(|(i, r)| r / sigma(i)).collect();
    let times = channel.times();
    let before = channel.correlation().map(Correlation::order);
    let process = match (uninterrupted_runs(times), channel.noise_model(), before) {
        (None, _, _) => {
            let time = select_exponential(&normalised, times)?;
            return Correlation::new(CorrelationLaw::Exponential { time }, times);
        }
        (Some(runs), NoiseModel::Autoregressive { order }, _) => burg(&normalised, &runs, order),
        (Some(runs), _, Some(order)) if is_frozen => burg(&normalised, &runs, order),
        (Some(_), _, None) if is_frozen => return None,
        (Some(runs), _, _) => select_order(&normalised, &runs, HIGHEST_ORDER),
    };
    autoregressive(process, times)
}

fn autoregressive(process: Autoregression, times: &[f64]) -> Option<Correlation> {
    let law = CorrelationLaw::Autoregressive(process);
    Correlation::new(law, times).filter(|c| c.order() > 0)
}

/// True if residuals are larger than rounding errors, small beside the variation of the samples, and consistent with a stated
/// sigma.
fn are_noise(channel: &Channel, residuals: &[f64]) -> bool {
    let observed = channel.observed();
    let mean = observed.iter().sum::<f64>() / observed.len() as f64;
    let about: Vec<f64> = observed.iter().map(|y| y - mean).collect();
    let share = rms(residuals) / rms(&about);
    let is_stated = !matches!(channel.weighting(), Weighting::Estimated { .. });
    let sigma = |i: usize| channel.weighting().sigma(i).unwrap_or(1.0);
    let each = residuals.iter().enumerate();
    let normalised: Vec<f64> = each.map(|(i, r)| r / sigma(i)).collect();
    (NOISE[0]..NOISE[1]).contains(&share) && !(is_stated && rms(&normalised) > BEYOND_SIGMA)
}

/// True if the residuals of a channel with a chosen order are larger in `fit` than in the fit `white` with uncorrelated noise by more
/// than noise explains: the correlation then stands for a term missing from the model.
pub(super) fn is_worse(problem: &Problem, fit: &Fit, white: &Fit) -> bool {
    let predictions = |of: &Fit| of.best.evaluation.predictions.concat();
    let pairs = predictions(fit).into_iter().zip(predictions(white));
    let mut channels = problem.channels().zip(pairs);
    channels.any(|(channel, (now, before))| {
        let size = |predicted: &[f64]| {
            let residuals: Vec<f64> = channel.residuals(predicted).collect();
            rms(&residuals)
        };
        channel.noise_model() == NoiseModel::Auto && size(&now) > GROWTH * size(&before)
    })
}

/// Orders of the correlations of all channels.
pub(super) fn orders(problem: &Problem) -> Vec<usize> {
    let order = |c: &Channel| c.correlation().map_or(0, Correlation::order);
    problem.channels().map(order).collect()
}

/// Largest change of a parameter in its standard errors; infinite where the parameters are undetermined.
pub(super) fn movement(problem: &Problem, from: &[f64], found: &Fit) -> f64 {
    let Some(covariance) = problem.covariance(&found.best.evaluation) else {
        return f64::INFINITY;
    };
    let pairs = from.iter().zip(&found.best.parameters).enumerate();
    let moved = pairs.map(|(j, (a, b))| (a - b).abs() / covariance[(j, j)].sqrt());
    moved.fold(0.0, f64::max)
}

/// The problem with sigmas and correlations of the largest restricted likelihood at an evaluated point, and their covariance;
/// `None` with more than [`FEW_PARAMETERS`] parameters or where the likelihood has no maximum.
pub(super) fn refined(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<Problem> {
    if problem.parameters() > FEW_PARAMETERS {
        return None;
    }
    let (moments, known) = moments(problem, theta, evaluation)?;
    let found = RestrictedLikelihood::new(moments, known).fit()?;
    let mut next = problem.clone();
    let mut each = found.channels.iter().zip(found.covariances);
    for experiment in &mut next.parts_mut().experiments {
        for channel in &mut experiment.channels {
            let (coordinates, covariance) = each.next()?;
            *channel = with_coordinates(channel, coordinates, covariance)?;
        }
    }
    Some(next)
}

/// Moments of all channels, and the Gram matrix of priors and penalties, in the combinations of parameters that the rows
/// determine, normalised.
fn moments(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<(Vec<ChannelMoments>, DMatrix<f64>)> {
    let n = problem.parameters();
    let jacobian = problem.predictions_jacobian(evaluation);
    let mut rows = jacobian.insert_column(n, 0.0);
    let mut first = 0;
    for (channel, predicted) in problem.predicted(evaluation) {
        let roots = channel.majorant(predicted).roots;
        for (i, r) in channel.residuals(predicted).enumerate() {
            rows[(first + i, n)] = r;
            // Under a robust loss the innovations have weights; the samples take those of their own innovations.
            let root = match (channel.correlation(), channel.weighting().sigma(i)) {
                (Some(_), Some(sigma)) => roots[i] / sigma,
                _ => roots[i],
            };
            rows.row_mut(first + i).iter_mut().for_each(|x| *x *= root);
        }
        first += channel.len();
    }
    let mut rest = crate::qp::Subproblem::new(n);
    super::linearization::add_penalties(problem, theta, &mut rest);
    super::linearization::add_priors(problem, theta, &mut rest);
    let rest = rest.residuals;
    let mut known = DMatrix::zeros(rest.len(), n + 1);
    for i in 0..rest.len() {
        (rest.row(i)).for_each(|(j, a)| known[(i, j)] += a);
        known[(i, n)] = -rest.right()[i];
    }
    // Columns of unit length first: parameters have different units.
    let mut all = rows
        .clone()
        .resize_vertically(rows.nrows() + known.nrows(), 0.0);
    all.rows_mut(rows.nrows(), known.nrows()).copy_from(&known);
    let all = all.columns(0, n).into_owned();
    let sizes: Vec<f64> = all
        .column_iter()
        .map(|c| c.norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(all.nrows(), n, |i, j| all[(i, j)] / sizes[j]);
    let root = Factorisation::of(&scaled).inverse_root();
    let q = root.ncols();
    let mut map = DMatrix::zeros(n + 1, q + 1);
    map.view_mut((0, 0), (n, q))
        .copy_from(&DMatrix::from_fn(n, q, |i, j| root[(i, j)] / sizes[i]));
    map[(n, q)] = 1.0;
    let rows = rows * &map;
    let known = known * &map;
    let mut first = 0;
    let mut list = Vec::new();
    for channel in problem.channels() {
        let own = rows.rows(first, channel.len()).into_owned();
        first += channel.len();
        let estimates = matches!(channel.weighting(), Weighting::Estimated { .. });
        let correlation = channel.correlation();
        list.push(ChannelMoments::new(
            &own,
            channel.times(),
            correlation,
            estimates,
        ));
    }
    Some((list, known.tr_mul(&known)))
}

/// The channel with noise at `coordinates`, sigma relative to its present value.
fn with_coordinates(
    channel: &Channel,
    coordinates: &NoiseCoordinates,
    covariance: DMatrix<f64>,
) -> Option<Channel> {
    let mut next = channel.clone();
    if let (Weighting::Estimated { sigma }, Some(log)) =
        (channel.weighting(), coordinates.log_sigma)
    {
        let sigma = sigma * log.exp();
        next = next.with_weighting(Weighting::Estimated { sigma });
    }
    let times = channel.times();
    let correlation = match channel.correlation().map(Correlation::law) {
        None => None,
        Some(CorrelationLaw::Autoregressive(_)) => {
            let process = Autoregression::from_coordinates(&coordinates.law);
            Some(autoregressive(process, times)?)
        }
        Some(CorrelationLaw::Exponential { .. }) => {
            let time = coordinates.law.first()?.exp();
            Some(Correlation::new(
                CorrelationLaw::Exponential { time },
                times,
            )?)
        }
    };
    Some(next.with_noise(NoiseEstimate {
        correlation,
        covariance,
        ..channel.noise().clone()
    }))
}
