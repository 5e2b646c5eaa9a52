//! The ladder against local minima: if a fit from one start does not explain the record, the next
//! start is tried.
//!
//! A motion whose period is off by a few per cent fits worse than no motion at all, so descent from
//! a wrong start ends in a minimum that means nothing. The rungs: for constants and a long record, what its
//! beginning says; the start as given; the equation-error start; a horizon that grows from an eighth of the record to all of it; states and
//! functions together, from a motion near the readings.

use super::all_at_once::all_at_once;
use super::beginning::{begin, beginning, reference};
use super::executor::{Prepared, search, search_prepared};
use super::optimality::measured;
use super::recorder::Reference;
use super::timings::timed;
use super::{
    Counts, Fit, FitSettings, Outcome, Row, Solver, Status, Timings, Watch, equation_error,
};
use crate::dynamics::Breakdown;
use crate::objective::GradientKind;
use crate::problem::Problem;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A fit explains the readings of a channel if its misfit is below this share of that of no motion at
/// all, or if noise of the given sigma alone would leave as much. False minima leave per cents (a mass that
/// goes near zero) to tens of per cent (a wrong period); a fit in between costs another rung.
const EXPLAINED: f64 = 1e-3;
/// Most iterations of a rung before the next is tried: Gauss-Newton from a good start takes some ten.
const PROBING_ITERATIONS: u64 = 60;
/// Parts of the record that the growing horizon fits in turn, before all of it.
const HORIZONS: [f64; 3] = [0.125, 0.25, 0.5];
/// Most iterations on each part.
const HORIZON_ITERATIONS: u64 = 20;

/// Name of the rung that goes on with the one that came furthest.
pub const CONTINUED: &str = "best of these, continued";

/// Where a fit starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// From the start values of the functions.
    Functions,
    /// From the equation error of the readings.
    Data,
}

impl Initial {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Initial::Functions => "functions",
            Initial::Data => "data",
        }
    }
}

/// One attempt of the ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// Where it started.
    pub name: &'static str,
    /// J at its start; NaN if the start had no motion.
    pub initial_cost: f64,
    /// J at its end; NaN if the start had no motion.
    pub cost: f64,
    /// Iterations it took.
    pub iterations: u64,
    /// How it ended.
    pub outcome: Outcome,
}

enum Attempt {
    /// From what the beginning of the record says.
    Beginning(Box<Prepared>),
    Functions,
    Data,
    GrowingHorizon,
    AllAtOnce,
}

impl Attempt {
    fn name(&self) -> &'static str {
        match self {
            Attempt::Beginning(_) => "beginning of the record",
            Attempt::Functions => "start values",
            Attempt::Data => "equation error",
            Attempt::GrowingHorizon => "growing horizon",
            Attempt::AllAtOnce => "motion of the readings",
        }
    }
}

/// Fits `problem` from `start`; `observe` is called after every iteration.
///
/// Gauss–Newton climbs the ladder until a rung explains the record; the rung with the lowest cost
/// is returned. The other solvers take the first rung only, and the equation error has no use for one.
///
/// # Errors
/// A [`Breakdown`] if no rung has a motion at its start.
pub fn fit(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    observe: &mut dyn FnMut(&Row),
) -> Result<Fit, Breakdown> {
    fit_watched(problem, start, settings, &mut Watch::new(observe))
}

/// [`fit`], and where `watch` has a [`Keeper`](super::Keeper), one that goes on from what was kept.
///
/// # Errors
/// As [`fit`].
pub fn fit_watched(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    watch: &mut Watch,
) -> Result<Fit, Breakdown> {
    let fit = climb(problem, start, settings, watch)?;
    Ok(measured(problem, fit, settings))
}

/// [`fit_watched`] without a measurement of its end.
pub(super) fn climb(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    watch: &mut Watch,
) -> Result<Fit, Breakdown> {
    if settings.solver == Solver::EquationError {
        return search(problem, start, settings, None, watch);
    }
    let first = match settings.initial {
        Initial::Functions => [Attempt::Functions, Attempt::Data],
        Initial::Data => [Attempt::Data, Attempt::Functions],
    };
    let attempts = first
        .into_iter()
        .chain([Attempt::GrowingHorizon, Attempt::AllAtOnce]);
    let mut before = Before::default();
    let clock = Instant::now();
    let climbs = settings.solver == Solver::GaussNewton;
    let is_discrete = settings.gradient == GradientKind::Discrete;
    let can_begin = climbs && is_discrete && settings.stopping.has_test();
    // To cost and gradient at the start values all rungs are compared; if the first one begins there, it finds out
    // for itself.
    let steps = can_begin.then(|| beginning(problem)).flatten();
    let (mut reference, begun, begun_in) = match (settings.initial, steps) {
        (Initial::Functions, Some(steps)) => {
            let begun = begin(problem, steps, start, settings, &mut before, watch);
            (begun.reference, begun.start, begun.elapsed)
        }
        (Initial::Functions, None) => (None, None, Duration::ZERO),
        (Initial::Data, _) => {
            let (reference, timings, _) = reference(problem, start, settings);
            before.counts.forward += 1;
            before.counts.adjoint += u64::from(reference.is_some());
            before.timings += timings;
            (reference, None, Duration::ZERO)
        }
    };
    // What was done before an interrupt is part of it.
    let lead = clock.elapsed().max(begun_in);
    let attempts = begun
        .map(Box::new)
        .map(Attempt::Beginning)
        .into_iter()
        .chain(attempts);
    // A rung that gets stuck in a false valley creeps: the others are tried before it goes on.
    let mut probing = settings.clone();
    let capped = climbs && settings.stopping.has_test();
    if capped {
        probing.stopping.iterations = settings.stopping.iterations.min(PROBING_ITERATIONS);
    }
    let mut best: Option<Fit> = None;
    let mut rungs = Vec::new();
    let mut trouble = None;
    for attempt in attempts {
        let clock = Instant::now();
        let name = attempt.name();
        watch.climb(name);
        let result = run(
            problem,
            start,
            &probing,
            attempt,
            reference,
            &mut before,
            watch,
        );
        match result {
            Ok(mut fit) => {
                // With the work that made the start, and what was done before it went on.
                fit.elapsed = fit.elapsed.max(clock.elapsed());
                rungs.push(Rung {
                    name,
                    initial_cost: fit.started_from,
                    cost: fit.best.evaluation.cost,
                    iterations: fit.history.len() as u64,
                    outcome: fit.outcome.clone(),
                });
                // The later rungs are compared to the start values too.
                reference = reference.or(Some(Reference {
                    cost: fit.initial_cost,
                    norm_squared: fit.initial_norm_squared,
                }));
                let ended = matches!(fit.outcome.status, Status::Interrupted | Status::TimeLimit);
                let enough = !climbs || ended || explains(problem, &fit);
                let interrupted = fit.outcome.status == Status::Interrupted;
                let outcome = fit.outcome.clone();
                let mut lower = better(best, fit);
                if interrupted {
                    // An earlier rung may have come further, but the ladder was not climbed to its end.
                    lower.outcome = outcome;
                }
                best = Some(lower);
                if enough {
                    break;
                }
            }
            Err(breakdown) => {
                rungs.push(Rung {
                    name,
                    initial_cost: f64::NAN,
                    cost: f64::NAN,
                    iterations: 0,
                    outcome: Outcome::new(Status::Failed, breakdown.to_string()),
                });
                trouble = trouble.or(Some(breakdown));
                if !climbs {
                    break;
                }
            }
        }
    }
    match (best, trouble) {
        (Some(fit), _) => {
            let fit = match fit.outcome.status {
                Status::MaxIterations if capped => {
                    gone_on(problem, fit, settings, reference, &mut rungs, watch)?
                }
                _ => fit,
            };
            Ok(Fit {
                rungs,
                counts: before.counts + fit.counts,
                timings: before.timings + fit.timings,
                elapsed: lead + fit.elapsed,
                ..fit
            })
        }
        (None, Some(breakdown)) => Err(breakdown),
        (None, None) => {
            unreachable!("there is at least one attempt, and it ends one way or the other")
        }
    }
}

/// The work that was done before and between the searches.
#[derive(Default)]
pub(super) struct Before {
    pub counts: Counts,
    pub timings: Timings,
}

/// The fit that came furthest, given the iterations that it was not given as one rung of several.
fn gone_on(
    problem: &Problem,
    fit: Fit,
    settings: &FitSettings,
    reference: Option<Reference>,
    rungs: &mut Vec<Rung>,
    watch: &mut Watch,
) -> Result<Fit, Breakdown> {
    let mut settings = settings.clone();
    let taken = fit.history.len() as u64;
    settings.stopping.iterations = settings.stopping.iterations.saturating_sub(taken);
    if settings.stopping.iterations == 0 {
        return Ok(fit);
    }
    let start = &fit.best.parameters;
    watch.climb(CONTINUED);
    let more = search(problem, start, &settings, reference, watch)?;
    rungs.push(Rung {
        name: CONTINUED,
        initial_cost: more.started_from,
        cost: more.best.evaluation.cost,
        iterations: more.history.len() as u64,
        outcome: more.outcome.clone(),
    });
    let mut history = fit.history;
    history.extend(more.history.into_iter().map(|row| Row {
        iteration: row.iteration + taken,
        ..row
    }));
    Ok(Fit {
        history,
        snapshots: fit.snapshots,
        counts: fit.counts + more.counts,
        timings: fit.timings + more.timings,
        elapsed: fit.elapsed + more.elapsed,
        ..more
    })
}

/// The fit with the lower cost, with the work of both.
fn better(best: Option<Fit>, fit: Fit) -> Fit {
    let Some(best) = best else {
        return fit;
    };
    let counts = best.counts + fit.counts;
    let timings = best.timings + fit.timings;
    let elapsed = best.elapsed + fit.elapsed;
    let winner = if fit.best.evaluation.cost < best.best.evaluation.cost {
        fit
    } else {
        best
    };
    Fit {
        counts,
        timings,
        elapsed,
        ..winner
    }
}

/// Each channel for itself: beside the velocity of a stiff device its displacement weighs nothing.
fn explains(problem: &Problem, fit: &Fit) -> bool {
    let evaluation = &fit.best.evaluation;
    let noise = problem.largest_chi_square();
    let predictions = evaluation.predictions.iter().flatten();
    let mut channels = problem.channels().zip(predictions);
    noise.is_some_and(|noise| evaluation.misfit <= noise)
        || channels.all(|(channel, predicted)| {
            let silence = channel.cost(&vec![0.0; channel.len()]);
            let noise = channel.largest_chi_square();
            let misfit = channel.cost(predicted);
            misfit <= EXPLAINED * silence || noise.is_some_and(|noise| misfit <= noise)
        })
}

fn run(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    attempt: Attempt,
    reference: Option<Reference>,
    before: &mut Before,
    watch: &mut Watch,
) -> Result<Fit, Breakdown> {
    let clock = &mut before.timings.start;
    let parameters = match attempt {
        Attempt::Beginning(prepared) => {
            return search_prepared(problem, *prepared, settings, reference, watch);
        }
        Attempt::Functions => start.to_vec(),
        Attempt::Data => from_data(problem, start, clock),
        Attempt::GrowingHorizon => over_growing_parts(problem, start, settings, before, watch),
        Attempt::AllAtOnce => {
            let flag = settings.interrupt.as_ref();
            let interrupted = || flag.is_some_and(|flag| flag.load(Ordering::Relaxed));
            watch.piece(start.len(), &interrupted, || {
                timed(clock, || all_at_once(problem, start, &interrupted))
                    .unwrap_or_else(|| from_data(problem, start, clock))
            })
        }
    };
    search(problem, &parameters, settings, reference, watch)
}

/// The equation-error start, fitted to growing parts of the record.
fn over_growing_parts(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    before: &mut Before,
    watch: &mut Watch,
) -> Vec<f64> {
    let mut parameters = from_data(problem, start, &mut before.timings.start);
    let mut short = settings.clone();
    short.stopping.iterations = HORIZON_ITERATIONS;
    for share in HORIZONS {
        let part = problem.first_part(share);
        let found = watch.unseen(|watch| search(&part, &parameters, &short, None, watch));
        if let Ok(fit) = found {
            before.counts += fit.counts;
            before.timings += fit.timings;
            parameters = fit.best.parameters;
        }
    }
    parameters
}

/// The equation-error start; where it has no motion, the start as given.
fn from_data(problem: &Problem, start: &[f64], clock: &mut Duration) -> Vec<f64> {
    let found = timed(clock, || {
        let theta = equation_error(problem, start).ok()?;
        problem.evaluate(&theta).is_ok().then_some(theta)
    });
    found.unwrap_or_else(|| start.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Part, Record};
    use crate::dynamics::Grid;
    use crate::solvers::{Stopping, fit_from};

    /// Iterations, work and time of both parts, and the numbers of the iterations one after the other.
    #[test]
    fn a_fit_that_is_gone_on_with_has_the_work_of_both() {
        let times = Grid::new(0.0, 10.0, 101).unwrap().times();
        let readings: Vec<f64> = times.iter().map(|t| t.cos()).collect();
        let record = Record::new("free decay")
            .from_state(1.0, 0.0)
            .displacement(&times, &readings);
        let parts = [Part::fixed(1.0), Part::constant(0.5), Part::constant(2.0)];
        let problem = Builder::new(parts).record(record).build().unwrap();
        let settings = |iterations| FitSettings {
            solver: Solver::SteepestDescent,
            stopping: Stopping::exactly(iterations),
            ..FitSettings::default()
        };
        let mut first = fit_from(&problem, &problem.start(), &settings(2)).unwrap();
        let hours = Duration::from_secs(36_000);
        first.timings.start = hours;
        first.elapsed = hours;
        let (before, cost) = (first.counts, first.best.evaluation.cost);
        let snapshots = first.snapshots.clone();
        assert!(!snapshots.is_empty());
        let mut rungs = Vec::new();
        let mut observe = |_: &Row| {};
        let mut watch = Watch::new(&mut observe);
        let whole = gone_on(&problem, first, &settings(5), None, &mut rungs, &mut watch).unwrap();
        let numbers: Vec<u64> = whole.history.iter().map(|row| row.iteration).collect();
        assert_eq!(numbers, [1, 2, 3, 4, 5]);
        assert!(whole.best.evaluation.cost < cost);
        assert_eq!(whole.snapshots, snapshots);
        let [rung] = rungs.as_slice() else {
            panic!("{rungs:?}");
        };
        assert_eq!((rung.iterations, rung.initial_cost), (3, cost));
        // Every iteration of steepest descent has one gradient at least.
        assert!(whole.counts.adjoint >= before.adjoint + 3);
        assert!(whole.timings.start >= hours && whole.timings.adjoint > Duration::ZERO);
        assert!(whole.elapsed > hours);
    }
}
