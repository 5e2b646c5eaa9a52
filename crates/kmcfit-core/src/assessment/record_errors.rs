//! Errors of a record that no parameter of the model explains: a delay between input and response, clocks that run at different rates, an
//! input of the wrong sign, and a channel off by a factor.
//!
//! Small errors are [candidates](crate::candidates); large ones are found by a search from which a refit starts. An error is named where a
//! refit with it explains the residuals.

use super::at_once;
use super::record_error::RecordError;
use crate::alternatives::{
    Clock, POOR, RecordParameter, Refit, on_best_clock, on_clock, predict, with_clock, with_gain,
    without_correlation, worst_fit,
};
use crate::functions::CoefficientKind;
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::signal::{Spectrum, median_spacing};
use crate::simd::sum::rms;
use crate::threads::{analyses_at_once, map};

/// Share of a record over which clocks are taken as equal in the search for their rate.
const BEGINNING: f64 = 0.2;
/// Distance of the rates and delays that are tried, in periods at the end of the record.
const APART: f64 = 0.1;
/// Largest difference of the rates that is tried, and largest delay in periods.
const LARGEST_RATE: f64 = 0.03;
const LARGEST_DELAY: f64 = 2.0;
/// Largest number of rates or delays that are tried on either side.
const MOST: usize = 100;
/// Smallest ratio of a factor, or of its inverse, to 1 that is named.
const FACTOR: f64 = 1.05;
/// Largest factor or inverse: a million is that between m and um.
const MOST_FACTOR: f64 = 2e6;

fn is_factor(gain: f64) -> bool {
    (1.0 / MOST_FACTOR..=MOST_FACTOR).contains(&gain.abs())
        && !(1.0 / FACTOR..=FACTOR).contains(&gain)
}

fn delay(problem: &Problem, e: usize, clock: Clock) -> RecordError {
    let experiment = &problem.experiments[e];
    let spacing = experiment
        .channels
        .first()
        .map(|c| median_spacing(c.times()));
    RecordError::Delay {
        experiment: experiment.name.clone(),
        delay: clock.delay,
        samples: spacing.map_or(f64::NAN, |spacing| clock.delay / spacing),
    }
}

fn difference(problem: &Problem, e: usize, clock: Clock) -> RecordError {
    RecordError::ClockDifference {
        experiment: problem.experiments[e].name.clone(),
        percent: 100.0 * clock.rate,
    }
}

fn factor(problem: &Problem, e: usize, c: usize, gain: f64) -> RecordError {
    let experiment = &problem.experiments[e];
    RecordError::ChannelFactor {
        experiment: experiment.name.clone(),
        channel: experiment.channels[c].kind().name().to_owned(),
        factor: gain,
        beside_others: experiment.channels.len() > 1,
    }
}

/// Refit with the gain of a channel estimated.
fn with_best_gain(
    problem: &Problem,
    theta: &[f64],
    e: usize,
    c: usize,
    start: f64,
) -> Option<(f64, Refit)> {
    let changed = with_gain(problem, e, c, start)?;
    let refit = Refit::of(changed, &[theta, &[start]].concat())?;
    Some((*refit.fit.best.parameters.last()?, refit))
}

/// The error of a record that explains a poor fit.
pub(super) fn large_error(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<RecordError> {
    if let Some(e) = (0..problem.experiments.len()).find(|e| is_reversed(problem, evaluation, *e)) {
        let experiment = problem.experiments[e].name.clone();
        return Some(RecordError::InputSign { experiment });
    }
    let is_few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
    let is_poor = worst_fit(problem, evaluation) < POOR;
    let is_likelihood = problem.channels().all(|c| c.weighting().is_sigma());
    (is_few && is_poor && is_likelihood).then_some(())?;
    let each = 0..problem.experiments.len();
    let first = |of: &dyn Fn(usize) -> Option<RecordError>| each.clone().find_map(of);
    first(&|e| reversed_input(problem, evaluation, e))
        .or_else(|| first(&|e| factor_of_channel(problem, theta, evaluation, e)))
        .or_else(|| first(&|e| large_clock(problem, theta, evaluation, e)))
}

/// True for an experiment with an input in which mass and stiffness are negative at most times.
fn is_reversed(problem: &Problem, evaluation: &Evaluation, e: usize) -> bool {
    let experiment = &problem.experiments[e];
    let set = problem
        .functions
        .coefficient_set(experiment.coefficient_set);
    let values = evaluation.nodal_of(experiment.coefficient_set).functions();
    let mut kinds = set
        .iter()
        .map(|f| problem.functions.get(*f).quantity)
        .zip(values);
    let is_passive = [CoefficientKind::MASS, CoefficientKind::STIFFNESS];
    let is_negative =
        |values: &[f64]| 2 * values.iter().filter(|v| **v < 0.0).count() > values.len();
    !experiment.is_free()
        && kinds.all(|(kind, values)| !is_passive.contains(&kind) || is_negative(values))
}

/// The input of an experiment against its sign: with the samples of its channels negated the fit from the start is good.
fn reversed_input(problem: &Problem, evaluation: &Evaluation, e: usize) -> Option<RecordError> {
    let experiment = &problem.experiments[e];
    (!experiment.is_free() && experiment.begins_known()).then_some(())?;
    let changed = problem.clone().with(|parts| {
        without_correlation(&mut parts.experiments);
        for channel in &mut parts.experiments[e].channels {
            let negated = channel.observed().iter().map(|y| -y).collect();
            *channel = channel.clone().with_samples(negated);
        }
    });
    let refit = Refit::of(changed.ok()?, &problem.start())?;
    refit
        .explains(problem, evaluation)
        .then(|| RecordError::InputSign {
            experiment: experiment.name.clone(),
        })
}

/// A channel of an experiment off by a factor: with its gain estimated the fit is good.
fn factor_of_channel(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    e: usize,
) -> Option<RecordError> {
    let experiment = &problem.experiments[e];
    (experiment.channels.len() > 1 || !experiment.is_free()).then_some(())?;
    for (start, at) in [(theta.to_vec(), Some(evaluation)), (problem.start(), None)] {
        let evaluated = match at {
            Some(_) => None,
            None => problem.evaluate(&start).ok(),
        };
        let Some(at) = at.or(evaluated.as_ref()) else {
            continue;
        };
        for (c, channel) in experiment.channels.iter().enumerate() {
            let predicted = &at.predictions[e][c];
            let product = |a: &[f64]| a.iter().zip(predicted).map(|(a, b)| a * b).sum::<f64>();
            let gain = product(channel.observed()) / product(predicted);
            let is_open = channel.sensor().gain.index().is_none() && gain.is_normal();
            let Some((gain, refit)) =
                (is_open.then_some(())).and_then(|()| with_best_gain(problem, &start, e, c, gain))
            else {
                continue;
            };
            if gain > 0.0 && is_factor(gain) && refit.explains(problem, evaluation) {
                return Some(factor(problem, e, c, gain));
            }
        }
    }
    None
}

/// Clocks of an experiment that differ by much: the fit of the beginning predicts the record on another clock.
fn large_clock(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    e: usize,
) -> Option<RecordError> {
    let experiment = &problem.experiments[e];
    let channel = experiment
        .channels
        .first()
        .filter(|c| !experiment.is_free() && !c.sensor().is_delayed())?;
    let spectrum = Spectrum::of(channel.observed(), median_spacing(channel.times()))?;
    let period = 1.0 / spectrum.dominant();
    let duration = problem.system.grid.time(experiment.nodes - 1) - problem.system.grid.start();
    let beginning = problem
        .truncated(BEGINNING)
        .with(|parts| without_correlation(&mut parts.experiments));
    let beginning = beginning.ok()?;
    let (own, other) = at_once(
        problem,
        || Refit::of(beginning.clone(), theta),
        || Refit::of(beginning.clone(), &problem.start()),
    );
    let beginning = own.into_iter().chain(other);
    let beginning = beginning.min_by(|a, b| a.worst_misfit().total_cmp(&b.worst_misfit()))?;
    let beginning = beginning.fit.best.parameters;
    let in_beginning = problem.evaluate(&beginning).ok()?;
    let step = APART * period / duration;
    let rate = best(problem, &in_beginning, e, LARGEST_RATE, step, |rate| {
        Clock { rate, delay: 0.0 }
    });
    let delay_of = |delay: f64| Clock { rate: 0.0, delay };
    let step = APART * period;
    let late = best(
        problem,
        evaluation,
        e,
        LARGEST_DELAY * period,
        step,
        delay_of,
    );
    // A refit takes several arrays of all samples, and is not kept.
    let explaining = |(clock, refit): (Clock, Refit)| {
        let explains = refit.explains(problem, evaluation);
        explains.then_some(clock)
    };
    let (rate, late) = at_once(
        problem,
        || on_best_clock(problem, &beginning, RecordParameter::Rate(e), rate?).and_then(explaining),
        || on_best_clock(problem, theta, RecordParameter::Delay(e), late?).and_then(explaining),
    );
    if let Some(clock) = rate {
        return Some(difference(problem, e, clock));
    }
    let late = late.or_else(|| late_by_refits(problem, e, period).and_then(explaining));
    late.map(|clock| delay(problem, e, clock))
}

/// The delay up to half a period with the best fit from the start, refined: a poor fit may have parameters that correlate best with another
/// one.
fn late_by_refits(problem: &Problem, e: usize, period: f64) -> Option<(Clock, Refit)> {
    let eighths = [-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0];
    let fits = map(
        eighths.len(),
        analyses_at_once(problem.sample_count()),
        |i| {
            let clock = Clock {
                delay: 0.125 * period * eighths[i],
                rate: 0.0,
            };
            let refit = Refit::of(with_clock(problem, e, clock)?, &problem.start())?;
            Some((refit.worst_misfit(), clock, refit.fit.best.parameters))
        },
    );
    let fits = fits.into_iter().flatten();
    let (_, clock, start) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    on_best_clock(problem, &start, RecordParameter::Delay(e), clock)
}

/// The clock other than that of the record, up to `most` in steps, with the largest correlation of samples and predictions.
fn best(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    most: f64,
    step: f64,
    clock: impl Fn(f64) -> Clock,
) -> Option<Clock> {
    let experiment = &problem.experiments[e];
    let channel = experiment.channels.first()?;
    let count = ((most / step) as usize).min(MOST) as i64;
    let clocks = (-count..=count)
        .filter(|i| *i != 0)
        .map(|i| clock(step * i as f64));
    let each = clocks.filter_map(|clock| {
        let moved = on_clock(experiment, channel, &problem.system.grid, clock)?;
        let predicted = predict(problem, evaluation, e, &moved);
        let pairs = predicted.iter().zip(moved.observed());
        let product = pairs.map(|(a, b)| a * b).sum::<f64>();
        let correlation = product / (rms(&predicted) * rms(moved.observed()) * moved.len() as f64);
        correlation.is_finite().then_some((clock, correlation))
    });
    let found = each.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (found.1 > 0.0).then_some(found.0)
}
