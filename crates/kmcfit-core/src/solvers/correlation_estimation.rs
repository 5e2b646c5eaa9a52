//! Estimation of the correlation of noise from the residuals of a fit.

use super::fit::Fit;
use super::settings::{FitSettings, Solver};
use crate::diagnostics::{SIGNIFICANCE, Whiteness, standard_deviation};
use crate::noise::{
    Autoregression, Correlation, CorrelationLaw, HIGHEST_ORDER, burg, select_exponential,
    select_order, uninterrupted_runs,
};
use crate::objective::diagnostics;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, NoiseEstimate, NoiseModel, ScoreCovariance, Weighting};
use crate::simd::sum::rms;
use crate::threads::{available_for, map};

/// Smallest number of samples per parameter for which an order is chosen and whiteness judged: with fewer, the correlation of residuals
/// differs from that of the noise. At 10 per parameter intervals of 95 % under white noise cover 91 % with a chosen order, 95 % without
/// (200 seeds).
const SAMPLES_PER_PARAMETER: usize = 16;
/// Range of the residuals, as a share of the variation of the samples, in which they may be noise: smaller ones are rounding
/// and step-size errors, larger ones those of a model that does not explain the record.
const NOISE: [f64; 2] = [1e-4, 0.2];
/// Residuals larger than this many stated sigmas are those of an incomplete model.
const BEYOND_SIGMA: f64 = 3.0;
/// Largest growth of the residuals, root mean square, by a correlation. Least squares absorbs narrowband noise at the resonance,
/// up to half of it; a correlation that stands for a missing term can leave residuals several times as large.
const GROWTH: f64 = 2.0;

/// True if the method of the fit converges to a minimum of the misfit of a simulated response.
pub(super) fn is_likelihood(settings: &FitSettings) -> bool {
    !matches!(
        settings.solver,
        Solver::SteepestDescent | Solver::EquationError
    )
}

/// True if the noise of some channel may be correlated.
pub(super) fn may_correlate(problem: &Problem, settings: &FitSettings) -> bool {
    is_likelihood(settings)
        && problem.parameters() > 0
        && problem.channels().any(|c| asks(problem, c))
}

/// True if the noise model of a channel asks for a correlation that its samples can show.
fn asks(problem: &Problem, channel: &Channel) -> bool {
    let is_long = is_long(problem);
    match channel.noise_model() {
        NoiseModel::White => false,
        NoiseModel::Auto => channel.weighting().is_sigma() && is_long,
        NoiseModel::Autoregressive { .. } => channel.weighting().is_sigma(),
    }
}

fn is_long(problem: &Problem) -> bool {
    problem.sample_count() >= SAMPLES_PER_PARAMETER * problem.parameters()
}

/// The problem with correlations estimated from the residuals of `found`; with `is_frozen`, orders stay as they are. `None` where
/// all noise is white and was so before.
pub(super) fn correlated(problem: &Problem, found: &Fit, is_frozen: bool) -> Option<Problem> {
    let of_channel = |channel: &Channel, predicted: &[f64]| match asks(problem, channel) {
        true => estimate(channel, predicted, is_frozen),
        false => None,
    };
    let estimated = of_channels(problem, found, of_channel);
    if is_white(problem) && estimated.iter().all(Option::is_none) {
        return None;
    }
    let mut next = problem.clone();
    let experiments = next.parts_mut().experiments.iter_mut();
    let channels = experiments.flat_map(|e| &mut e.channels);
    for (channel, correlation) in channels.zip(estimated) {
        let noise = NoiseEstimate {
            correlation,
            ..NoiseEstimate::default()
        };
        *channel = channel.clone().with_noise(noise);
    }
    Some(next)
}

/// Results of `work` for all channels with their predictions.
fn of_channels<T: Send>(
    problem: &Problem,
    found: &Fit,
    work: impl Fn(&Channel, &[f64]) -> T + Sync,
) -> Vec<T> {
    let channels: Vec<_> = problem.predicted(&found.best.evaluation).collect();
    let of_channel = |i: usize| {
        let (channel, predicted) = channels[i];
        work(channel, predicted)
    };
    let threads = available_for(problem.sample_count());
    map(channels.len(), threads, of_channel)
}

/// True if the noise of all channels is uncorrelated.
pub(super) fn is_white(problem: &Problem) -> bool {
    problem.channels().all(|c| c.correlation().is_none())
}

/// Correlation of the residuals of a channel; `None` for white ones.
fn estimate(channel: &Channel, predicted: &[f64], is_frozen: bool) -> Option<Correlation> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let sigma = |i: usize| channel.weighting().sigma(i).unwrap_or(1.0);
    let each = residuals.iter().enumerate();
    let normalised: Vec<f64> = each.map(|(i, r)| r / sigma(i)).collect();
    if channel.noise_model() == NoiseModel::Auto && !are_noise(channel, &residuals, &normalised) {
        return None;
    }
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

/// True if the residuals of a channel are larger than rounding errors, small beside the variation of the samples, and consistent
/// with a stated sigma; `normalised` are the residuals over sigma.
fn are_noise(channel: &Channel, residuals: &[f64], normalised: &[f64]) -> bool {
    let share = rms(residuals) / standard_deviation(channel.observed());
    let is_estimated = matches!(channel.weighting(), Weighting::Estimated { .. });
    (NOISE[0]..NOISE[1]).contains(&share) && (is_estimated || rms(normalised) <= BEYOND_SIGMA)
}

/// The test of the residuals of a channel, whitened for its correlation, if they are not white, and their size relative to that of the
/// samples. Residuals at rounding and step-size errors have no distribution.
pub(super) fn misspecification(channel: &Channel, predicted: &[f64]) -> Option<(Whiteness, f64)> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let share = rms(&residuals) / standard_deviation(channel.observed());
    let is_noise = channel.weighting().is_sigma() && share >= NOISE[0];
    let whiteness = is_noise.then(|| diagnostics(channel, predicted).whiteness)?;
    (whiteness.p_value < SIGNIFICANCE).then_some((whiteness, share))
}

/// Marks the channels whose innovations are not white: the covariance of their scores is that of a kernel.
pub(super) fn mark_misspecified(problem: &mut Problem, found: &Fit) {
    if !(1..=FEW_PARAMETERS).contains(&problem.parameters()) || !is_long(problem) {
        return;
    }
    let is_marked =
        |channel: &Channel, predicted: &[f64]| misspecification(channel, predicted).is_some();
    let marks = of_channels(problem, found, is_marked);
    let experiments = problem.parts_mut().experiments.iter_mut();
    let channels = experiments.flat_map(|e| &mut e.channels);
    for (channel, _) in channels.zip(marks).filter(|(_, is_marked)| *is_marked) {
        let noise = NoiseEstimate {
            scores: ScoreCovariance::Kernel,
            ..channel.noise().clone()
        };
        *channel = channel.clone().with_noise(noise);
    }
}

/// True if the residuals of a channel with a chosen order are larger in `fit` than in the fit `white` with uncorrelated noise by more
/// than noise explains: the correlation then stands for a term missing from the model.
pub(super) fn is_worse(problem: &Problem, fit: &Fit, white: &Fit) -> bool {
    let now = problem.predicted(&fit.best.evaluation);
    let before = white.best.evaluation.predictions.iter().flatten();
    let mut channels = now.zip(before);
    channels.any(|((channel, now), before)| {
        let size = |predicted: &[f64]| {
            let residuals: Vec<f64> = channel.residuals(predicted).collect();
            rms(&residuals)
        };
        channel.noise_model() == NoiseModel::Auto && size(now) > GROWTH * size(before)
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
