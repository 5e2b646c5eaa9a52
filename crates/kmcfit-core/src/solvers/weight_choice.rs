//! Choice of a penalty weight.

use super::correlation_estimation::{is_likelihood, mark_misspecified};
use super::fit::Fit;
use super::history::IterationRecord;
use super::jumps::choose_jumps;
use super::observer::Observer;
use super::path::WeightPath;
use super::settings::FitSettings;
use super::weight_path::choose_by_discrepancy;
use crate::functions::WeightRule;
use crate::problem::Problem;
use crate::step::SimulationError;

/// Fits `problem` along a path of factors on the penalties `which`, each fit started from its neighbour, and again at the
/// factor chosen by `rule`. Returns the path, the problem at the chosen factor, and its fit. For the rule `bic`, `which` is the index
/// of one total-variation penalty, and the last fit is that without the penalty on the jumps found, with its noise.
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
    let observer = &mut Observer::new(observe);
    choose_weight_watched(problem, start, settings, rule, which, observer)
}

/// [`choose_weight`] with an observer.
///
/// # Errors
/// As [`choose_weight`].
pub fn choose_weight_watched(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    rule: WeightRule,
    which: &[usize],
    observer: &mut Observer,
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    if let (WeightRule::Bic, [which]) = (rule, which) {
        return choose_jumps(problem, start, settings, *which, observer);
    }
    let (path, mut weighted, found) =
        choose_by_discrepancy(problem, start, settings, which, observer)?;
    if is_likelihood(settings) {
        mark_misspecified(&mut weighted, &found);
    }
    Ok((path, weighted, found))
}
