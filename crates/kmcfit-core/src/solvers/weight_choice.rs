//! Choice of a penalty weight together with the noise: path of weights and estimation of the noise in alternation.

use super::checkpoint::Observer;
use super::correlation_estimation::{
    correlated, is_likelihood, is_white, mark_misspecified, may_correlate, orders,
};
use super::executor::search;
use super::fit::Fit;
use super::history::IterationRecord;
use super::jumps::choose_jumps;
use super::noise_estimation::{add_sigma_variances, estimates_sigma, update};
use super::path::WeightPath;
use super::reml::refined;
use super::rounds::{counted, is_ended, with_round};
use super::settings::FitSettings;
use super::weight_path::choose_weight_at_noise;
use crate::functions::WeightRule;
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// Largest number of further paths.
const ROUNDS: usize = 4;
/// Relative change of a sigma below which it has converged; the factors of a path are a multiple of that apart.
const SETTLED: f64 = 1e-3;
/// Number of paths in which the orders of correlations are chosen anew.
const FREE_ROUNDS: usize = 2;

/// Fits `problem` along a path of factors on the penalties `which`, each fit started from its neighbour, and again at the
/// factor chosen by `rule`. Sigmas ([`Weighting::Estimated`](crate::record::Weighting::Estimated)) and correlations are estimated from
/// the residuals at the chosen factor, with `n - q` degrees of freedom for `q` effective parameters, and the path is repeated with them until
/// they are at rest; correlations then by restricted likelihood at that factor. Returns the path, the problem at the chosen factor with its noise, and its fit. For the rule `bic`, `which` is the index
/// of one total-variation penalty, and the last fit is that without the penalty on the jumps found.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the start of the first fit, at the middle weight, fails.
pub fn choose_weight(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    rule: WeightRule,
    which: &[usize],
    observe: &mut dyn FnMut(&IterationRecord),
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    let watch = &mut Observer::new(observe);
    choose_weight_watched(problem, start, settings, rule, which, watch)
}

/// [`choose_weight`] with an observer, which may hold checkpoints.
///
/// # Errors
/// As [`choose_weight`].
pub fn choose_weight_watched(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    rule: WeightRule,
    which: &[usize],
    watch: &mut Observer,
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    if let (WeightRule::Bic, [which]) = (rule, which) {
        return choose_jumps(problem, start, settings, *which, watch);
    }
    let mut base = problem.clone();
    let choice = (rule, which);
    let (mut path, mut weighted, mut found) =
        choose_weight_at_noise(&base, start, settings, choice, watch)?;
    if !is_likelihood(settings) {
        return Ok((path, weighted, found));
    }
    for round in 0..ROUNDS {
        let is_frozen = round >= FREE_ROUNDS;
        let moved = counted(&mut found, |found| {
            estimate_noise(&mut base, &weighted, found, &path, is_frozen)
        });
        if is_ended(&found) || !moved {
            break;
        }
        let from = found.best.parameters.clone();
        let initial_cost = found.initial_cost;
        let next;
        (path, weighted, next) = choose_weight_at_noise(&base, &from, settings, choice, watch)?;
        found = Fit {
            initial_cost: weighted.evaluate(start).map_or(initial_cost, |at| at.cost),
            ..with_round(found, next, false)
        };
    }
    if !is_white(&weighted) && !is_ended(&found) {
        let next = counted(&mut found, |found| {
            refined(&weighted, &found.best.parameters, &found.best.evaluation)
        });
        if let Some(next) = next {
            weighted = next;
            let initial_cost = weighted.evaluate(start).map(|at| at.cost);
            let from = found.best.parameters.clone();
            let fit = search(&weighted, &from, settings, None, watch)?;
            found = Fit {
                initial_cost: initial_cost.unwrap_or(found.initial_cost),
                ..with_round(found, fit, false)
            };
        }
    }
    add_sigma_variances(&mut weighted);
    mark_misspecified(&mut weighted, &found);
    Ok((path, weighted, found))
}

/// Sets sigmas and correlations of `base` to those of the residuals of a fit at the chosen weight; true if they have changed.
fn estimate_noise(
    base: &mut Problem,
    weighted: &Problem,
    found: &Fit,
    path: &WeightPath,
    is_frozen: bool,
) -> bool {
    let mut next = weighted.clone();
    let mut has_changed = false;
    if may_correlate(weighted, &FitSettings::default())
        && let Some(with_correlation) = correlated(weighted, found, is_frozen)
    {
        has_changed = is_white(weighted) || orders(&with_correlation) != orders(weighted);
        next = with_correlation;
    }
    if estimates_sigma(weighted) {
        let parameters = path.points[path.chosen].degrees_of_freedom;
        let share = (parameters / weighted.sample_count() as f64).min(0.5);
        has_changed |= update(&mut next, found, share, |_| true) > SETTLED;
    }
    let own = base.parts_mut().experiments.iter_mut();
    for (own, next) in own.zip(&next.experiments) {
        own.channels.clone_from(&next.channels);
    }
    has_changed
}
