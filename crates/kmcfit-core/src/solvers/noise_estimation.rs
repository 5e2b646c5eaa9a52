//! Estimation of sigmas and correlations of the noise and of penalty weights, in alternation with fits.

use super::correlation_estimation::{
    correlated, is_likelihood, is_white, is_worse, mark_misspecified, may_correlate, movement,
    orders,
};
use super::executor::search;
use super::fit::{Fit, measured};
use super::further_starts::with_further_starts;
use super::history::IterationRecord;
use super::input_errors::{has_input_errors, with_input_errors};
use super::observer::Observer;
use super::reml::{estimates_weights, refined, start_weights};
use super::reml_by_traces::with_reml_weights;
use super::rounds::{counted, is_ended, with_round};
use super::settings::FitSettings;
use super::start_strategy::search_from_starts;
use super::timings::Timings;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Loss, NoiseEstimate, Weighting};
use crate::simd::sum::rms;
use crate::step::SimulationError;
use nalgebra::DMatrix;

/// Largest number of rounds of fit and estimation.
const ROUNDS: usize = 20;
/// Largest number of rounds of fit and estimation of correlations by Burg's method.
const PASSES: usize = 15;
/// Number of the first of these rounds, in which the orders are chosen anew.
const FREE_PASSES: usize = 5;
/// Largest number of rounds of fit and restricted likelihood.
const REFINEMENTS: usize = 3;
/// Largest number of rounds of fit and estimation of penalty weights.
const WEIGHT_ROUNDS: usize = 40;
/// Change of the logarithm of a weight below which weights are at rest; its standard error is about 0.5.
const WEIGHTS_AT_REST: f64 = 0.02;
/// Change of the parameters, in standard errors, below which correlations are at rest.
const AT_REST: f64 = 0.01;
/// Relative change of a sigma below which it has converged; chi-square changes by twice that.
const SETTLED: f64 = 1e-6;
/// Ratio of the standard deviation to the median absolute value, for Gaussian noise.
const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// [`fit`](super::fit()) with estimation of each sigma ([`Weighting::Estimated`]): fit and estimation alternate until the
/// sigmas converge. The result is the maximum of the likelihood except for the factor `n / (n - p)` that makes each squared
/// sigma unbiased, with `p` the share of the parameters in proportion to the channel's samples. Returns the problem with its
/// sigmas.
///
/// With a robust loss, sigma describes the majority of the samples: it follows from the median absolute residual.
///
/// Weights of the rule [`WeightRule::RestrictedLikelihood`](crate::functions::WeightRule::RestrictedLikelihood) are estimated
/// together with the noise; the returned problem has them.
///
/// # Errors
/// As [`fit`](super::fit()).
pub fn fit_with_noise(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    observe: &mut dyn FnMut(&IterationRecord),
) -> Result<(Problem, Fit), SimulationError> {
    fit_with_noise_watched(problem, start, settings, &mut Observer::new(observe))
}

/// [`fit_with_noise`] with an observer.
///
/// # Errors
/// As [`fit_with_noise`].
pub fn fit_with_noise_watched(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<(Problem, Fit), SimulationError> {
    let mut problem = problem.clone();
    let chooses = estimates_weights(&problem);
    if chooses {
        start_weights(&mut problem, start);
    }
    let mut found = search_from_starts(&problem, start, settings, observer)?;
    found = match chooses {
        true => with_weights(&mut problem, found, settings, observer)?,
        false => with_sigmas(&mut problem, found, settings, observer)?,
    };
    let before = found.best.evaluation.cost;
    found = with_further_starts(&problem, start, found, settings, observer)?;
    if found.best.evaluation.cost < before {
        found = match chooses {
            true => with_weights(&mut problem, found, settings, observer)?,
            false => with_sigmas(&mut problem, found, settings, observer)?,
        };
    }
    if has_input_errors(&problem) {
        found = with_input_errors(&mut problem, found, settings, observer)?;
    } else if may_correlate(&problem, settings) {
        found = with_correlations(&mut problem, found, settings, observer)?;
    }
    add_sigma_variances(&mut problem);
    if is_likelihood(settings) {
        mark_misspecified(&mut problem, &found);
    }
    let is_as_stated = !estimates_sigma(&problem) && is_white(&problem) && !chooses;
    // All costs refer to the final noise.
    if let (false, Ok(evaluation)) = (is_as_stated, problem.evaluate(start)) {
        found.initial_cost = evaluation.cost;
    }
    let found = measured(&problem, found, settings);
    Ok((problem, found))
}

pub(super) fn estimates_sigma(problem: &Problem) -> bool {
    let mut channels = problem.channels();
    channels.any(|c| matches!(c.weighting(), Weighting::Estimated { .. }))
}

/// Fit and estimation of the sigmas in alternation, until these converge.
pub(super) fn with_sigmas(
    problem: &mut Problem,
    mut found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    if !estimates_sigma(problem) {
        return Ok(found);
    }
    for _ in 0..ROUNDS {
        let change = update(problem, &found, parameter_share(problem), |_| true);
        let ended = is_ended(&found);
        let next = search(problem, &found.best.parameters, settings, None, observer)?;
        found = with_round(found, next, ended);
        if ended || change < SETTLED {
            break;
        }
    }
    Ok(found)
}

/// Fit and estimation of weights and sigmas in alternation, until these rest.
fn with_weights(
    problem: &mut Problem,
    mut found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    update(problem, &found, parameter_share(problem), |_| true);
    for _ in 0..WEIGHT_ROUNDS {
        if is_ended(&found) {
            break;
        }
        let next = match problem.parameters() > FEW_PARAMETERS {
            true => counted(&mut found, |found| {
                with_reml_weights(problem, found, &mut Timings::default())
            }),
            false => counted(&mut found, |found| {
                refined(problem, &found.best.parameters, &found.best.evaluation)
            }),
        };
        let Some(next) = next else {
            break;
        };
        let change = weight_change(problem, &next);
        *problem = next;
        let share = parameter_share(problem);
        let sigmas = update(problem, &found, share, |c| c.loss() != Loss::Squares);
        let fit = search(problem, &found.best.parameters, settings, None, observer)?;
        found = with_round(found, fit, false);
        if change.max(sigmas) < WEIGHTS_AT_REST {
            break;
        }
    }
    Ok(found)
}

/// Largest change of the logarithm of a weight.
fn weight_change(before: &Problem, after: &Problem) -> f64 {
    let pairs = before.penalties.iter().zip(&after.penalties);
    let changes = pairs.map(|(a, b)| (b.weight / a.weight).ln().abs());
    changes.fold(0.0, f64::max)
}

/// Fit and estimation of the correlations in alternation, from the residuals by Burg's method until orders and parameters
/// rest, then by restricted likelihood. The fit with uncorrelated noise is returned where the correlations stand for a term missing
/// from the model.
fn with_correlations(
    problem: &mut Problem,
    mut found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    let mut white = None;
    for pass in 0..PASSES {
        if is_ended(&found) {
            break;
        }
        let next = counted(&mut found, |found| {
            correlated(problem, found, pass >= FREE_PASSES)
        });
        let Some(next) = next else {
            break;
        };
        white.get_or_insert_with(|| (problem.clone(), found.clone()));
        let rests = orders(&next) == orders(problem);
        let moved;
        (found, moved) = refitted(problem, next, found, settings, observer)?;
        if rests && moved < AT_REST {
            break;
        }
    }
    let Some((as_white, white)) = white else {
        return Ok(found);
    };
    for _ in 0..REFINEMENTS {
        if is_ended(&found) || is_white(problem) {
            break;
        }
        let next = counted(&mut found, |found| {
            refined(problem, &found.best.parameters, &found.best.evaluation)
        });
        let Some(next) = next else {
            break;
        };
        let moved;
        (found, moved) = refitted(problem, next, found, settings, observer)?;
        if moved < AT_REST {
            break;
        }
    }
    if is_worse(problem, &found, &white) {
        *problem = as_white;
        return Ok(without_correlations(found, white));
    }
    Ok(found)
}

/// The fit `white` with uncorrelated noise, from which the rejected fit `found` continued, with the work of `found`, which includes
/// that of `white`. A fit that was ended from outside keeps that outcome.
fn without_correlations(found: Fit, white: Fit) -> Fit {
    Fit {
        outcome: match is_ended(&found) {
            true => found.outcome,
            false => white.outcome,
        },
        counts: found.counts,
        timings: found.timings,
        elapsed: found.elapsed,
        ..white
    }
}

/// Fit with the noise of `next`, which becomes the problem; also the largest change of a parameter in standard errors. Sigmas
/// keep the values of `next` where these have a covariance, that is, are estimates of the restricted likelihood.
fn refitted(
    problem: &mut Problem,
    next: Problem,
    found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<(Fit, f64), SimulationError> {
    *problem = next;
    let before = found.best.parameters.clone();
    let fit = search(problem, &before, settings, None, observer)?;
    let mut found = with_round(found, fit, false);
    let is_refined = problem.channels().any(|c| !c.noise().covariance.is_empty());
    if !is_refined {
        found = with_sigmas(problem, found, settings, observer)?;
    }
    let moved = movement(problem, &before, &found);
    Ok((found, moved))
}

/// Sets the sigmas of the residuals of the channels `which`, with `share` parameters per sample; returns the largest relative change.
pub(super) fn update(
    problem: &mut Problem,
    found: &Fit,
    share: f64,
    which: impl Fn(&Channel) -> bool,
) -> f64 {
    let mut largest = 0.0f64;
    let experiments = problem.parts_mut().experiments.iter_mut();
    for (experiment, predictions) in experiments.zip(&found.best.evaluation.predictions) {
        for (channel, predicted) in experiment.channels.iter_mut().zip(predictions) {
            let Weighting::Estimated { sigma: before } = *channel.weighting() else {
                continue;
            };
            if !which(channel) {
                continue;
            }
            let sigma = spread(channel, predicted) / (1.0 - share).sqrt();
            // Samples that are fitted exactly still need a scale.
            let sigma = sigma.max(f64::EPSILON * rms(channel.observed()));
            // The variance of the quantisation error is part of that of a sample.
            let sigma = sigma.max(channel.resolution() / 12.0f64.sqrt());
            if sigma > 0.0 {
                largest = largest.max((sigma / before).ln().abs());
                *channel = channel
                    .clone()
                    .with_weighting(Weighting::Estimated { sigma });
            }
        }
    }
    largest
}

/// Sets the variance `1/(2 (n - p))` of the logarithm of each estimated sigma that has none, with `p` the channel's share of the
/// parameters: intervals then have Student's t distribution. A robust sigma, from the median, keeps the normal distribution.
pub(super) fn add_sigma_variances(problem: &mut Problem) {
    let share = parameter_share(problem);
    let channels = (problem.parts_mut().experiments.iter_mut()).flat_map(|e| &mut e.channels);
    for channel in channels {
        let is_estimated = matches!(channel.weighting(), Weighting::Estimated { .. });
        let has_none = channel.noise().covariance.is_empty() && channel.correlation().is_none();
        if is_estimated && has_none && channel.loss() == Loss::Squares {
            let left = channel.len() as f64 * (1.0 - share);
            let noise = NoiseEstimate {
                covariance: DMatrix::from_element(1, 1, 0.5 / left),
                ..NoiseEstimate::default()
            };
            *channel = channel.clone().with_noise(noise);
        }
    }
}

/// Parameters per sample, at most a half.
fn parameter_share(problem: &Problem) -> f64 {
    (problem.parameters() as f64 / problem.sample_count() as f64).min(0.5)
}

fn spread(channel: &Channel, predicted: &[f64]) -> f64 {
    let mut residuals = channel.innovations(predicted);
    match channel.loss() {
        Loss::Squares => rms(&residuals),
        Loss::Huber { .. } | Loss::StudentT { .. } => {
            residuals.iter_mut().for_each(|r| *r = r.abs());
            residuals.sort_by(f64::total_cmp);
            MEDIAN_TO_SIGMA * residuals[residuals.len() / 2]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;
    use crate::solvers::{Solver, Status, Stopping, fit_from};
    use crate::system::Grid;
    use std::time::Duration;

    fn problem() -> Problem {
        let times = Grid::new(0.0, 10.0, 101).unwrap().times();
        let samples: Vec<f64> = times.iter().map(|t| t.cos()).collect();
        let record = Record::new("free decay")
            .from_state(1.0, 0.0)
            .displacement(&times, &samples);
        let parts = [
            CoefficientSpec::fixed(1.0),
            CoefficientSpec::constant(0.5),
            CoefficientSpec::constant(2.0),
        ];
        Builder::new(parts).record(record).build().unwrap()
    }

    fn settings() -> FitSettings {
        FitSettings {
            solver: Solver::SteepestDescent,
            stopping: Stopping::exactly(2),
            ..FitSettings::default()
        }
    }

    /// The work and time of both rounds, the initial values of the first, and the point of the second.
    #[test]
    fn a_fit_with_another_round_has_the_work_of_both() {
        crate::host::provide_clock();
        let (problem, settings) = (problem(), settings());
        let mut first = fit_from(&problem, &problem.start(), &settings).unwrap();
        let next = fit_from(&problem, &first.best.parameters, &settings).unwrap();
        first.timings.start = Duration::from_secs(3600);
        first.elapsed = Duration::from_secs(7200);
        assert_ne!(first.snapshots, next.snapshots);
        assert!(!next.elapsed.is_zero() && next.timings.adjoint > Duration::ZERO);
        for ended in [false, true] {
            let whole = with_round(first.clone(), next.clone(), ended);
            assert_eq!(whole.counts, first.counts + next.counts);
            assert_eq!(whole.elapsed, first.elapsed + next.elapsed);
            assert_eq!(
                whole.timings.sum(),
                first.timings.sum() + next.timings.sum()
            );
            assert_eq!(whole.snapshots, first.snapshots);
            assert_eq!(whole.best.parameters, next.best.parameters);
            assert_eq!(whole.initial_cost, next.initial_cost);
        }
    }

    /// The point and history of the fit with uncorrelated noise, and the work of the rounds that were rejected.
    #[test]
    fn a_rejected_correlation_leaves_its_work() {
        let (problem, settings) = (problem(), settings());
        let mut white = fit_from(&problem, &problem.start(), &settings).unwrap();
        white.elapsed = Duration::from_secs(1);
        white.timings.adjoint = Duration::from_secs(1);
        let next = fit_from(&problem, &white.best.parameters, &settings).unwrap();
        let mut found = with_round(white.clone(), next, false);
        assert_ne!(found.best.parameters, white.best.parameters);
        for status in [Status::Completed, Status::TimeLimit] {
            found.outcome.status = status;
            let fit = without_correlations(found.clone(), white.clone());
            assert_eq!(fit.best.parameters, white.best.parameters);
            assert_eq!(fit.history, white.history);
            assert_eq!(fit.counts, found.counts);
            assert_eq!(fit.timings, found.timings);
            assert_eq!(fit.elapsed, found.elapsed);
            assert_eq!(fit.outcome.status, status);
        }
    }
}
