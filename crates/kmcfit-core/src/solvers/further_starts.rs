//! Further searches after a fit: where it ends above the noise, and from it without its outliers.
//!
//! The residuals of a fit at the minimum are noise: their squares, over the squares of stated sigmas, have a mean of one, and
//! with estimated sigmas they are white unless the noise is correlated. Where they are not, the fit may be in a local minimum,
//! and the search of a scan of the natural frequency ([`scan_start`]) is made. Values of mass and stiffness far from the median
//! of their function, which the record hardly determines, are moved towards it, and the search is repeated.

use super::correlation_estimation::misspecification;
use super::executor::search;
use super::fit::{Attempt, Fit};
use super::observer::Observer;
use super::rounds::{is_ended, with_round};
use super::settings::{FitSettings, StartStrategy};
use super::start_strategy::PROBING_ITERATIONS;
use super::starts::{is_dominant, scan_start};
use super::termination::Status;
use super::timings::timed;
use crate::functions::CoefficientKind;
use crate::host::Instant;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Weighting};
use crate::signal::median;
use crate::step::SimulationError;

/// Largest mean square of the residuals, in units of the stated sigma, of a fit at the noise.
const LARGEST_MEAN_SQUARE: f64 = 1.1;
/// Ratio of a value to the median of its function beyond which it is an outlier, and the ratio to which outliers are moved. A search
/// that has the right frequency can still end with values at the ends of the record of another sign or size.
const OUTLYING: f64 = 1.8;
const MOVED: f64 = 1.2;
/// Most nodes of all records for a scan, which simulates them some three hundred times.
const MOST_NODES: usize = 500_000;
/// Most searches from a fit without outliers.
const MOST_MOVES: usize = 3;
/// Residual, relative to the samples, and sum of its squared autocorrelations of a fit that has the right natural frequency.
const SMALL_RESIDUAL: f64 = 0.3;
const SMALL_CORRELATION: f64 = 0.02;
/// Relative decrease of the cost by which another minimum is lower.
const LOWER: f64 = 1e-6;

/// The fit `found`, or one of lower cost from further starts.
///
/// # Errors
/// A [`SimulationError`] if a search cannot be continued.
pub(super) fn with_further_starts(
    problem: &Problem,
    start: &[f64],
    found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    let searches = settings.has_several_starts() && settings.stopping.has_test();
    if !searches || problem.parameters() == 0 {
        return Ok(found);
    }
    let mut further = FurtherStarts {
        problem,
        settings,
        observer,
        found,
    };
    further.scan(start)?;
    further.move_outliers()?;
    Ok(further.found)
}

/// Searches from further starts, and the best fit of all.
struct FurtherStarts<'a, 'w> {
    problem: &'a Problem,
    settings: &'a FitSettings,
    observer: &'a mut Observer<'w>,
    found: Fit,
}

impl FurtherStarts<'_, '_> {
    /// Searches from a scan of the natural frequency where the residuals are not noise and the frequency may be wrong.
    fn scan(&mut self, start: &[f64]) -> Result<(), SimulationError> {
        let problem = self.problem;
        let nodes = problem.system.grid.nodes() * problem.experiments.len();
        let is_found =
            is_noise(problem, &self.found) || is_dominant(problem, &self.found.best.evaluation);
        if nodes > MOST_NODES || is_found {
            return Ok(());
        }
        let clock = Instant::now();
        let timings = &mut self.found.timings;
        let from = timed(&mut timings.start, || scan_start(problem, start));
        self.found.elapsed += clock.elapsed();
        if let Some(from) = from.filter(|_| !is_ended(&self.found)) {
            self.search(StartStrategy::FrequencyScan, &from)?;
        }
        Ok(())
    }

    /// Searches from the fit with the outliers of mass and stiffness moved, if there are any, as long as the cost falls.
    fn move_outliers(&mut self) -> Result<(), SimulationError> {
        let is_few = self.problem.parameters() <= FEW_PARAMETERS;
        if !is_few || !has_likelihood(self.problem) {
            return Ok(());
        }
        for _ in 0..MOST_MOVES {
            let before = self.found.best.evaluation.cost;
            let from = without_outliers(self.problem, &self.found.best.parameters);
            let Some(from) = from.filter(|_| !is_ended(&self.found)) else {
                break;
            };
            self.search(StartStrategy::WithoutOutliers, &from)?;
            if self.found.best.evaluation.cost >= before {
                break;
            }
        }
        Ok(())
    }

    /// Searches from one start. An interrupt or the time limit ends all further searches, whichever fit is the better one.
    fn search(&mut self, strategy: StartStrategy, from: &[f64]) -> Result<(), SimulationError> {
        let Self {
            problem, settings, ..
        } = *self;
        self.observer.begin_attempt(strategy);
        let from = problem.feasible_or(from.to_vec(), &self.found.best.parameters);
        let mut probing = settings.clone();
        probing.stopping.iterations = settings.stopping.iterations.min(PROBING_ITERATIONS);
        let mut next = match search(problem, &from, &probing, None, self.observer) {
            Ok(next) => next,
            Err(breakdown) => {
                self.found
                    .attempts
                    .push(Attempt::failed(strategy, breakdown));
                return Ok(());
            }
        };
        let is_lower = next.best.evaluation.cost < self.found.best.evaluation.cost;
        if is_lower && next.outcome.status == Status::MaxIterations {
            let start = next.best.parameters.clone();
            let rest = search(problem, &start, settings, None, self.observer)?;
            next = with_round(next, rest, false);
        }
        self.found.attempts.push(Attempt::of(strategy, &next));
        let found = self.found.clone();
        let outcome = next.outcome.clone();
        let was_ended = is_ended(&next);
        let least = (1.0 - LOWER) * found.best.evaluation.cost;
        self.found = match next.best.evaluation.cost < least {
            true => with_round(found, next, false),
            false => found.with_work_of(next.counts, next.timings, next.elapsed),
        };
        if was_ended {
            self.found.outcome = outcome;
        }
        Ok(())
    }
}

/// Parameters `theta` where a mass or stiffness has values beyond [`OUTLYING`] times its median, with its values moved to [`MOVED`] times the
/// median at most; `None` if there are none.
fn without_outliers(problem: &Problem, theta: &[f64]) -> Option<Vec<f64>> {
    let functions = &problem.functions;
    let mut moved = theta.to_vec();
    let mut has_any = false;
    for (f, values) in functions.values(theta).into_iter().enumerate() {
        let function = functions.get(f);
        let is_wanted = matches!(
            function.quantity,
            CoefficientKind::MASS | CoefficientKind::STIFFNESS
        );
        let median = median(&*values);
        let range = median / OUTLYING..=median * OUTLYING;
        if !is_wanted || median <= 0.0 || values.iter().all(|value| range.contains(value)) {
            continue;
        }
        let inside = values
            .iter()
            .enumerate()
            .map(|(i, value)| value.clamp(median / MOVED, median * MOVED) - function.fixed_at(i));
        let inside: Vec<f64> = inside.collect();
        let basis = function.basis.as_ref();
        if let Some(own) = basis.and_then(|b| b.project(&problem.system.grid, &inside)) {
            moved[functions.ranges()[f].clone()].copy_from_slice(&own);
            has_any = true;
        }
    }
    has_any.then_some(moved)
}

fn has_likelihood(problem: &Problem) -> bool {
    problem.channels().all(|c| c.weighting().is_sigma())
}

/// True if the residuals of a channel are correlated as those of a fit with another natural frequency, which oscillate with the response.
/// In long records the test of whiteness finds much smaller correlations.
fn oscillates(channel: &Channel, predicted: &[f64]) -> bool {
    misspecification(channel, predicted).is_some_and(|(whiteness, share)| {
        share > SMALL_RESIDUAL || whiteness.statistic > SMALL_CORRELATION * channel.len() as f64
    })
}

/// True if the residuals of a fit are noise, or no likelihood says what noise is.
fn is_noise(problem: &Problem, found: &Fit) -> bool {
    let mut channels = problem.predicted(&found.best.evaluation);
    channels.all(|(channel, predicted)| match channel.weighting() {
        Weighting::Sigma(_) | Weighting::Sigmas(_) => {
            channel.cost(predicted) <= LARGEST_MEAN_SQUARE * channel.len() as f64
        }
        Weighting::Estimated { .. } => !oscillates(channel, predicted),
        Weighting::Integral { .. } | Weighting::Trapezoid(_) => true,
    })
}
