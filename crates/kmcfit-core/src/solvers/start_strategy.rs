//! Start strategy: a safeguard against local minima that tries further starting points until a fit explains the record.
//!
//! A response whose period is off by a few per cent fits worse than the zero response, so a descent from a wrong start ends in
//! a spurious local minimum. Order of the starting points: the first steps of a long record, for constant functions; the
//! start as given; the equation error; a horizon that grows from an eighth of the record to all of it.

use super::executor::{Prepared, search, search_prepared};
use super::fit::{Attempt, Fit, measured};
use super::history::{IterationRecord, Reference};
use super::observer::Observer;
use super::settings::{FitSettings, Initial, Solver, StartStrategy};
use super::solve_counts::SolveCounts;
use super::starts::{
    Referred, equation_error_start, growing_horizon_start, reference, truncated_start,
    truncated_steps,
};
use super::termination::Status;
use super::timings::{Timings, timed};
use crate::host::Instant;
use crate::objective::GradientKind;
use crate::problem::Problem;
use crate::record::Channel;
use crate::step::SimulationError;
use std::time::Duration;

/// Misfit of a channel beyond the stated noise, as a share of its zero-response misfit, below which a fit explains the samples. Spurious minima leave per cents (a mass close to zero) to tens of per cent (a wrong period); a
/// fit in between costs another attempt.
const EXPLAINED: f64 = 1e-3;
/// Iteration limit of an attempt; Gauss–Newton from a good start takes about ten.
pub(super) const PROBING_ITERATIONS: u64 = 60;
/// Fits `problem` from `start`; `observe` is called after every iteration.
///
/// Gauss–Newton tries starting points until a fit explains the record and returns the fit with the lowest cost. The other
/// solvers use the first starting point only, and the equation error needs none.
///
/// # Errors
/// A [`SimulationError`] if no starting point can be simulated.
pub fn fit(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    observe: &mut dyn FnMut(&IterationRecord),
) -> Result<Fit, SimulationError> {
    let fit = search_from_starts(problem, start, settings, &mut Observer::new(observe))?;
    Ok(measured(problem, fit, settings))
}

/// [`fit`] without measuring the first-order condition.
pub(super) fn search_from_starts(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    if settings.solver == Solver::EquationError {
        return search(problem, start, settings, None, observer);
    }
    let mut attempts = Attempts::new(problem, start, settings, observer);
    let lead = attempts.prepare();
    for strategy in attempts.strategies() {
        if attempts.attempt(strategy) {
            break;
        }
    }
    let mut fit = attempts.finish()?;
    fit.elapsed += lead;
    Ok(fit)
}

/// Attempts from successive starting points.
struct Attempts<'a, 'w> {
    problem: &'a Problem,
    start: &'a [f64],
    settings: &'a FitSettings,
    /// Settings of one attempt. Searches in a spurious minimum converge slowly, so the other starts are tried first.
    probing: FitSettings,
    observer: &'a mut Observer<'w>,
    /// True if several starting points may be tried.
    has_several: bool,
    truncated: Option<(StartStrategy, Prepared)>,
    /// Minimum of the equation error, once it is computed.
    from_data: Option<Vec<f64>>,
    /// Cost and gradient at the start values, the reference of all attempts.
    reference: Option<Reference>,
    /// Work before and between the searches.
    counts: SolveCounts,
    timings: Timings,
    best: Option<Fit>,
    attempts: Vec<Attempt>,
    failure: Option<SimulationError>,
}

impl<'a, 'w> Attempts<'a, 'w> {
    fn new(
        problem: &'a Problem,
        start: &'a [f64],
        settings: &'a FitSettings,
        observer: &'a mut Observer<'w>,
    ) -> Self {
        let has_several = settings.has_several_starts();
        let mut probing = settings.clone();
        if has_several && settings.stopping.has_test() {
            probing.stopping.iterations = settings.stopping.iterations.min(PROBING_ITERATIONS);
        }
        Self {
            problem,
            start,
            settings,
            probing,
            observer,
            has_several,
            truncated: None,
            from_data: None,
            reference: None,
            counts: SolveCounts::default(),
            timings: Timings::default(),
            best: None,
            attempts: Vec::new(),
            failure: None,
        }
    }

    /// Computes cost and gradient at the start values, and a truncated start; an attempt from the start values computes the former
    /// itself. Returns the time, including that before an interrupt.
    fn prepare(&mut self) -> Duration {
        let (problem, start, settings) = (self.problem, self.start, self.settings);
        let is_discrete = settings.gradient == GradientKind::Discrete;
        let can_truncate = self.has_several && is_discrete && settings.stopping.has_test();
        let steps = can_truncate.then(|| truncated_steps(problem)).flatten();
        let clock = Instant::now();
        match (settings.initial, steps) {
            (Initial::Near, _) | (Initial::Functions, None) => Duration::ZERO,
            (Initial::Functions, Some(steps)) => {
                let found = truncated_start(problem, steps, start, settings, self.observer);
                self.refer(found.referred);
                self.counts += found.counts;
                self.timings += found.timings;
                let strategy = StartStrategy::Truncated { steps };
                self.truncated = found.start.map(|start| (strategy, start));
                clock.elapsed().max(found.elapsed)
            }
            (Initial::Data, _) => {
                self.refer(reference(problem, start, settings));
                clock.elapsed()
            }
        }
    }

    fn refer(&mut self, referred: Referred) {
        self.counts.forward += 1;
        self.counts.adjoint += u64::from(referred.reference.is_some());
        self.timings += referred.timings;
        self.reference = referred.reference;
    }

    /// Strategies in the order of the attempts.
    fn strategies(&self) -> Vec<StartStrategy> {
        use StartStrategy::{EquationError, GrowingHorizon, StartValues};
        let first = match self.settings.initial {
            Initial::Functions | Initial::Near => [StartValues, EquationError],
            Initial::Data => [EquationError, StartValues],
        };
        let truncated = self.truncated.iter().map(|(strategy, _)| *strategy);
        let order = truncated.chain(first).chain([GrowingHorizon]);
        let has_equation = self.problem.system.structure.is_one();
        order
            .filter(|s| has_equation || *s != EquationError)
            .collect()
    }

    /// Searches from one starting point; returns true after the last attempt.
    fn attempt(&mut self, strategy: StartStrategy) -> bool {
        let clock = Instant::now();
        self.observer.begin_attempt(strategy);
        let prepared = self.starting_point(strategy);
        let found = search_prepared(
            self.problem,
            prepared,
            &self.probing,
            self.reference,
            self.observer,
        );
        match found {
            Ok(mut fit) => {
                // Including the work of the starting point, and that before an interrupt.
                fit.elapsed = fit.elapsed.max(clock.elapsed());
                self.take(strategy, fit)
            }
            Err(breakdown) => {
                self.attempts.push(Attempt::failed(strategy, breakdown));
                self.failure.get_or_insert(breakdown);
                !self.has_several
            }
        }
    }

    /// Adds the result of an attempt; returns true after the last one.
    fn take(&mut self, strategy: StartStrategy, fit: Fit) -> bool {
        self.attempts.push(Attempt::of(strategy, &fit));
        self.reference.get_or_insert(Reference {
            cost: fit.initial_cost,
            norm_squared: fit.initial_norm_squared,
        });
        let outcome = fit.outcome.clone();
        let is_ended = matches!(outcome.status, Status::Interrupted | Status::TimeLimit);
        let is_last = !self.has_several || is_ended || explains(self.problem, &fit);
        let mut lower = better(self.best.take(), fit);
        if outcome.status == Status::Interrupted {
            // An earlier attempt may be better, but the remaining ones were not made.
            lower.outcome = outcome;
        }
        self.best = Some(lower);
        is_last
    }

    /// Minimum of the equation error, which two strategies start from.
    fn equation_error_start(&mut self) -> Vec<f64> {
        let (problem, start) = (self.problem, self.start);
        let find = || {
            timed(&mut self.timings.start, || {
                equation_error_start(problem, start)
            })
        };
        self.from_data.get_or_insert_with(find).clone()
    }

    fn starting_point(&mut self, strategy: StartStrategy) -> Prepared {
        let (problem, start) = (self.problem, self.start);
        let parameters = match strategy {
            StartStrategy::Truncated { .. } => match self.truncated.take() {
                Some((_, prepared)) => return prepared,
                None => start.to_vec(),
            },
            StartStrategy::StartValues
            | StartStrategy::FrequencyScan
            | StartStrategy::WithoutOutliers
            | StartStrategy::Continued => start.to_vec(),
            StartStrategy::EquationError => {
                let found = self.equation_error_start();
                problem.feasible_or(found, start)
            }
            StartStrategy::GrowingHorizon => {
                let from = self.equation_error_start();
                let (found, counts, timings) =
                    growing_horizon_start(problem, from, &self.probing, self.observer);
                self.counts += counts;
                self.timings += timings;
                problem.feasible_or(found, start)
            }
        };
        Prepared {
            parameters,
            evaluation: None,
            workspace: None,
        }
    }

    /// Best fit, continued if it reached the iteration limit of an attempt, with all work.
    fn finish(mut self) -> Result<Fit, SimulationError> {
        let Some(mut fit) = self.best else {
            return Err(self
                .failure
                .expect("every attempt ends with a fit or a breakdown"));
        };
        let is_limited = self.has_several && self.settings.stopping.has_test();
        if is_limited && fit.outcome.status == Status::MaxIterations {
            let (problem, settings, reference) = (self.problem, self.settings, self.reference);
            fit = continued(
                problem,
                fit,
                settings,
                reference,
                &mut self.attempts,
                self.observer,
            )?;
        }
        fit.attempts = self.attempts;
        Ok(fit.with_work_of(self.counts, self.timings, Duration::ZERO))
    }
}

/// Continues the best fit with the iterations beyond the limit of an attempt.
fn continued(
    problem: &Problem,
    fit: Fit,
    settings: &FitSettings,
    reference: Option<Reference>,
    attempts: &mut Vec<Attempt>,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    let mut settings = settings.clone();
    let taken = fit.history.len() as u64;
    settings.stopping.iterations = settings.stopping.iterations.saturating_sub(taken);
    if settings.stopping.iterations == 0 {
        return Ok(fit);
    }
    let start = &fit.best.parameters;
    observer.begin_attempt(StartStrategy::Continued);
    let mut more = search(problem, start, &settings, reference, observer)?;
    attempts.push(Attempt::of(StartStrategy::Continued, &more));
    let mut history = fit.history;
    let rows = std::mem::take(&mut more.history);
    history.extend(rows.into_iter().map(|row| IterationRecord {
        iteration: row.iteration + taken,
        ..row
    }));
    Ok(Fit {
        history,
        snapshots: fit.snapshots,
        ..more.with_work_of(fit.counts, fit.timings, fit.elapsed)
    })
}

/// Fit with the lower cost, with the work of both.
fn better(best: Option<Fit>, fit: Fit) -> Fit {
    let Some(best) = best else {
        return fit;
    };
    let (winner, other) = match fit.best.evaluation.cost < best.best.evaluation.cost {
        true => (fit, best),
        false => (best, fit),
    };
    winner.with_work_of(other.counts, other.timings, other.elapsed)
}

/// Tests each channel separately: in a joint sum, the velocity of a stiff system would hide its displacement.
fn explains(problem: &Problem, fit: &Fit) -> bool {
    let evaluation = &fit.best.evaluation;
    let noise = problem.largest_chi_square();
    let mut channels = problem.predicted(evaluation);
    noise.is_some_and(|noise| evaluation.misfit <= noise)
        || channels.all(|(channel, predicted)| {
            let silence = channel.cost(&vec![0.0; channel.len()]);
            let noise = channel.largest_chi_square();
            let misfit = channel.cost(predicted);
            misfit <= EXPLAINED * silence + noise.unwrap_or(0.0)
        })
}

impl Problem {
    /// Largest chi-square explained by noise alone, its mean plus two standard deviations, `n + 2 sqrt(2 n)`; `None` unless all
    /// samples have a sigma.
    pub fn largest_chi_square(&self) -> Option<f64> {
        let known = self.channels().all(|c| c.weighting().is_sigma());
        known.then(|| largest_chi_square(self.sample_count()))
    }
}

impl Channel {
    /// [`Problem::largest_chi_square`] of the channel's samples; `None` unless they have a sigma.
    pub fn largest_chi_square(&self) -> Option<f64> {
        let known = self.weighting().is_sigma();
        known.then(|| largest_chi_square(self.len()))
    }
}

fn largest_chi_square(samples: usize) -> f64 {
    let n = samples as f64;
    n + 2.0 * (2.0 * n).sqrt()
}

#[cfg(test)]
mod tests;
