//! Errors of a record that no parameter of the model explains: a delay between input and response, clocks that run at different rates, an
//! input of the wrong sign, and a channel off by a factor.
//!
//! With the response on its own clock, sample `i` at the time `t_i` of the record shows the system at
//!
//! ```text
//! t = t_0 + (1 + rate) (t_i - t_0) - delay
//! ```
//!
//! so that the predictions `p` have the derivatives `-p'` in the delay, `(t_i - t_0) p'` in the rate, and `p` in a gain of the channel. Small
//! errors are further candidates of the [score tests](super::score_tests); large ones are found by a search from which a refit starts. An
//! error is named where a refit with it explains the residuals.

use crate::functions::{CoefficientKind, ScalarParameter, ScalarValue};
use crate::objective::{Evaluation, SimulatedRecord, diagnostics};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Experiment, NoiseEstimate, Sensor, Weighting};
use crate::signal::{Spectrum, median_spacing};
use crate::simd::sum::rms;
use crate::solvers::{Fit, FitSettings, fit_from};
use crate::system::{Grid, InputSample};
use serde::Serialize;

use super::plausibility::POOR;
use super::score_tests::{Span, WHITE};

/// Share of a step by which the clock of the response is moved for derivatives.
const SMALL: f64 = 0.01;
/// Rounds of refits with a corrected clock.
const ROUNDS: usize = 8;
/// Change of a delay or rate in standard errors at which the rounds end.
const AT_REST: f64 = 0.1;
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
/// Ratio of the residuals with and without an error below which it explains them although they are not white.
pub(super) const EXPLAINED: f64 = 0.5;

/// An error of a record.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RecordError {
    /// The response is recorded later than the input; earlier if negative.
    Delay {
        /// Name of the experiment.
        experiment: String,
        /// The delay, s.
        delay: f64,
        /// The delay in samples of the first channel.
        samples: f64,
    },
    /// The clocks of input and response run at different rates.
    ClockDifference {
        /// Name of the experiment.
        experiment: String,
        /// Excess of the time in the system over that on the clock of the response, per cent.
        percent: f64,
    },
    /// The input acts against its sign.
    InputSign {
        /// Name of the experiment.
        experiment: String,
    },
    /// The samples of a channel are a multiple of the response.
    ChannelFactor {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
        /// Samples over the response.
        factor: f64,
        /// True if other channels of the record agree with the model without it.
        beside_others: bool,
    },
}

/// Clock of a response relative to that of its input.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Clock {
    /// Delay of the response, s.
    pub delay: f64,
    /// Relative difference of the rates.
    pub rate: f64,
}

/// A parameter of a record besides those of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RecordParameter {
    /// Delay of the response of an experiment.
    Delay(usize),
    /// Difference of the rates of the clocks of an experiment.
    Rate(usize),
    /// Gain of a channel of an experiment.
    Gain(usize, usize),
}

/// Parameters of the records that errors of the data may need: clocks of records with a measured input, and gains of channels where an
/// input or another channel shows them.
pub(super) fn parameters(problem: &Problem) -> Vec<RecordParameter> {
    let mut found = Vec::new();
    for (e, experiment) in problem.experiments.iter().enumerate() {
        if !experiment.is_free() {
            found.extend([RecordParameter::Delay(e), RecordParameter::Rate(e)]);
        }
        if !experiment.is_free() || experiment.channels.len() > 1 {
            let open = experiment.channels.iter().enumerate();
            let open = open.filter(|(_, c)| c.sensor().gain.index().is_none());
            found.extend(open.map(|(c, _)| RecordParameter::Gain(e, c)));
        }
    }
    found
}

/// Derivatives of the weighted and whitened predictions of all channels in a parameter of a record; for a gain in its logarithm.
pub(super) fn column(
    problem: &Problem,
    evaluation: &Evaluation,
    parameter: RecordParameter,
) -> Option<Vec<f64>> {
    let mut all = Vec::with_capacity(problem.sample_count());
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for (c, channel) in experiment.channels.iter().enumerate() {
            let predicted = &evaluation.predictions[e][c];
            let mut rows = match parameter {
                RecordParameter::Gain(of, which) if (of, which) == (e, c) => predicted.clone(),
                RecordParameter::Delay(of) if of == e => {
                    let slopes = slopes(problem, evaluation, e, channel, predicted)?;
                    slopes.iter().map(|slope| -slope).collect()
                }
                RecordParameter::Rate(of) if of == e => {
                    let start = problem.system.grid.start();
                    let slopes = slopes(problem, evaluation, e, channel, predicted)?;
                    let ages = channel.times().iter().map(|t| t - start);
                    slopes
                        .iter()
                        .zip(ages)
                        .map(|(slope, age)| slope * age)
                        .collect()
                }
                _ => vec![0.0; channel.len()],
            };
            channel.whiten_rows(&mut rows);
            let roots = channel.majorant(predicted).roots;
            all.extend(rows.iter().zip(roots).map(|(row, root)| row * root));
        }
    }
    Some(all)
}

/// Derivatives of the predictions of a channel in time.
fn slopes(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    channel: &Channel,
    predicted: &[f64],
) -> Option<Vec<f64>> {
    let small = SMALL * problem.system.grid.step();
    let clock = Clock {
        delay: -small,
        rate: 0.0,
    };
    let experiment = &problem.experiments[e];
    let later = on_clock(experiment, channel, &problem.system.grid, clock)?;
    let later = predict(problem, evaluation, e, &later);
    let mut slopes: Vec<f64> = (later.iter().zip(predicted))
        .map(|(later, now)| (later - now) / small)
        .collect();
    // A sample at the end of the record has no later one.
    slopes.resize(predicted.len(), slopes.last().copied()?);
    Some(slopes)
}

/// Predictions of a channel by the response of an evaluation.
fn predict(problem: &Problem, evaluation: &Evaluation, e: usize, channel: &Channel) -> Vec<f64> {
    let experiment = &problem.experiments[e];
    channel.predict(SimulatedRecord {
        system: &problem.system,
        nodal: evaluation.nodal_of(experiment.coefficient_set),
        excitation: experiment.excitation.as_ref(),
        response: &evaluation.trajectories[e],
        scalars: &evaluation.scalars,
    })
}

/// A channel with the times of its samples on another clock, without the samples before or after the response; `None` for a sensor of
/// absolute motion, and for weights or filters that do not allow it.
fn on_clock(
    experiment: &Experiment,
    channel: &Channel,
    grid: &Grid,
    clock: Clock,
) -> Option<Channel> {
    let is_possible = channel.base().is_empty()
        && matches!(
            channel.weighting(),
            Weighting::Sigma(_) | Weighting::Estimated { .. }
        );
    let plain = channel.before_filter().filter(|_| is_possible)?;
    let (start, end) = (grid.start(), grid.time(experiment.nodes - 1));
    let at = |t: &f64| start + (1.0 + clock.rate) * (t - start) - clock.delay;
    let samples = plain
        .times()
        .iter()
        .map(at)
        .zip(plain.observed().iter().copied());
    let (times, values): (Vec<f64>, Vec<f64>) =
        samples.filter(|(t, _)| (start..=end).contains(t)).unzip();
    let inputs = times.iter().map(|t| InputSample {
        force: experiment.input.force_at(*t),
        base: experiment.input.base_acceleration_at(*t),
    });
    let inputs: Vec<InputSample> = inputs.collect();
    let weighting = plain.weighting().clone();
    let moved = Channel::new(
        plain.kind(),
        times,
        values,
        weighting,
        grid,
        experiment.nodes,
    )?;
    let moved = moved.with_loss(plain.loss()).with_sensor(plain.sensor());
    let moved = match channel.inputs_at_samples() {
        Some(_) => moved.with_inputs_at_samples(inputs),
        None => moved,
    };
    Some(match channel.filter() {
        [] => moved,
        filter => moved.with_filter(filter.to_vec()),
    })
}

/// The problem with the channels of an experiment on another clock, and white noise.
fn with_clock(problem: &Problem, e: usize, clock: Clock) -> Option<Problem> {
    let experiment = &problem.experiments[e];
    let grid = &problem.system.grid;
    let channels = experiment.channels.iter();
    let channels: Option<Vec<Channel>> = channels
        .map(|c| on_clock(experiment, c, grid, clock))
        .collect();
    let channels = channels?;
    let moved = problem.clone().with(|parts| {
        parts.experiments[e].channels = channels;
        without_correlation(&mut parts.experiments);
    });
    moved.ok()
}

pub(super) fn without_correlation(experiments: &mut [Experiment]) {
    for channel in experiments.iter_mut().flat_map(|e| &mut e.channels) {
        *channel = channel.clone().with_noise(NoiseEstimate::default());
    }
}

/// The problem with the gain of a channel estimated, as the last scalar.
fn with_gain(problem: &Problem, e: usize, c: usize, start: f64) -> Option<Problem> {
    let mut scalars = problem.functions.scalars().to_vec();
    let index = scalars.len();
    scalars.push(ScalarParameter {
        name: "gain".to_owned(),
        unit: String::new(),
        start,
        size: start.abs(),
        prior: None,
    });
    let changed = problem.clone().with(|parts| {
        parts.functions = parts.functions.clone().with_scalars(scalars);
        without_correlation(&mut parts.experiments);
        let channel = &mut parts.experiments[e].channels[c];
        let gain = ScalarValue::Estimated(index);
        let sensor = Sensor {
            gain,
            ..channel.sensor()
        };
        *channel = channel.clone().with_sensor(sensor);
    });
    changed.ok()
}

/// The error of a record by a significant parameter of the score tests, where a refit with it leaves white residuals.
pub(super) fn small_error(
    problem: &Problem,
    theta: &[f64],
    parameter: RecordParameter,
    value: f64,
) -> Option<RecordError> {
    match parameter {
        RecordParameter::Delay(e) => {
            let clock = Clock {
                delay: value,
                rate: 0.0,
            };
            let (clock, fitted) = on_best_clock(problem, theta, parameter, clock)?;
            fitted.is_white().then(|| delay(problem, e, clock))
        }
        RecordParameter::Rate(e) => {
            let clock = Clock {
                delay: 0.0,
                rate: value,
            };
            let (clock, fitted) = on_best_clock(problem, theta, parameter, clock)?;
            fitted.is_white().then(|| difference(problem, e, clock))
        }
        RecordParameter::Gain(e, c) => {
            let (gain, fitted) = with_best_gain(problem, theta, e, c, 1.0 + value)?;
            (fitted.is_white() && is_factor(gain)).then(|| factor(problem, e, c, gain))
        }
    }
}

fn is_factor(gain: f64) -> bool {
    gain.is_finite() && !(1.0 / FACTOR..=FACTOR).contains(&gain)
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

/// A fit of a changed problem.
pub(super) struct Refit {
    problem: Problem,
    fit: Fit,
}

impl Refit {
    pub(super) fn of(problem: Problem, start: &[f64]) -> Option<Self> {
        let fit = fit_from(&problem, start, &FitSettings::default()).ok()?;
        Some(Self { problem, fit })
    }

    fn evaluation(&self) -> &Evaluation {
        &self.fit.best.evaluation
    }

    /// True if the residuals of all channels are white.
    pub(super) fn is_white(&self) -> bool {
        let mut each = self.problem.predicted(self.evaluation());
        each.all(|(channel, predicted)| diagnostics(channel, predicted).whiteness.p_value >= WHITE)
    }

    /// Largest root mean square of the residuals of a channel relative to its samples.
    pub(super) fn worst_misfit(&self) -> f64 {
        worst_misfit(&self.problem, self.evaluation())
    }

    /// True if the residuals are white, or small beside those of `before` where the fit is good.
    fn explains(&self, problem: &Problem, before: &Evaluation) -> bool {
        let is_smaller = self.worst_misfit() < EXPLAINED * worst_misfit(problem, before);
        is_smaller && (self.is_white() || worst_fit(&self.problem, self.evaluation()) >= POOR)
    }
}

/// Fit of the worst channel, per cent.
pub(super) fn worst_fit(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let fits = (problem.predicted(evaluation))
        .map(|(channel, predicted)| diagnostics(channel, predicted).fit_percent);
    fits.fold(100.0, f64::min)
}

/// Largest root mean square of the residuals of a channel relative to its samples.
pub(super) fn worst_misfit(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let each = problem.predicted(evaluation).map(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        rms(&residuals) / rms(channel.observed())
    });
    each.fold(0.0, f64::max)
}

/// Refits on the clock that a score test of its parameter leaves at rest.
fn on_best_clock(
    problem: &Problem,
    theta: &[f64],
    parameter: RecordParameter,
    mut clock: Clock,
) -> Option<(Clock, Refit)> {
    let (RecordParameter::Delay(e) | RecordParameter::Rate(e)) = parameter else {
        return None;
    };
    let mut start = theta.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let refit = Refit::of(with_clock(problem, e, clock)?, &start)?;
        start.clone_from(&refit.fit.best.parameters);
        let evaluation = refit.evaluation();
        let change = column(&refit.problem, evaluation, parameter)
            .and_then(|column| Span::score(&refit.problem, evaluation, column))
            .filter(|(_, t)| t.abs() > AT_REST);
        found = Some((clock, refit));
        let Some((value, _)) = change else {
            break;
        };
        match parameter {
            RecordParameter::Delay(_) => clock.delay += value,
            _ => clock.rate += value,
        }
    }
    found
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
    first(&|e| factor_of_channel(problem, theta, evaluation, e))
        .or_else(|| first(&|e| reversed_input(problem, evaluation, e)))
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
    let is_passive = [CoefficientKind::Mass, CoefficientKind::Stiffness];
    let is_negative =
        |values: &[f64]| 2 * values.iter().filter(|v| **v < 0.0).count() > values.len();
    !experiment.is_free()
        && kinds.all(|(kind, values)| !is_passive.contains(&kind) || is_negative(values))
}

/// The input of an experiment against its sign: with the samples of its channels negated the fit from the start is good.
fn reversed_input(problem: &Problem, evaluation: &Evaluation, e: usize) -> Option<RecordError> {
    let experiment = &problem.experiments[e];
    (!experiment.is_free() && experiment.initial_parameters == [None; 2]).then_some(())?;
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
        .filter(|_| !experiment.is_free())?;
    let spectrum = Spectrum::of(channel.observed(), median_spacing(channel.times()))?;
    let period = 1.0 / spectrum.dominant();
    let duration = problem.system.grid.time(experiment.nodes - 1) - problem.system.grid.start();
    let beginning = problem
        .truncated(BEGINNING)
        .with(|parts| without_correlation(&mut parts.experiments));
    let beginning = beginning.ok()?;
    let both = [theta.to_vec(), problem.start()].into_iter();
    let both = both.filter_map(|start| Refit::of(beginning.clone(), &start));
    let beginning = both.min_by(|a, b| a.worst_misfit().total_cmp(&b.worst_misfit()))?;
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
    let rate =
        rate.and_then(|clock| on_best_clock(problem, &beginning, RecordParameter::Rate(e), clock));
    if let Some((clock, refit)) = rate
        && refit.explains(problem, evaluation)
    {
        return Some(difference(problem, e, clock));
    }
    let (clock, refit) = on_best_clock(problem, theta, RecordParameter::Delay(e), late?)?;
    refit
        .explains(problem, evaluation)
        .then(|| delay(problem, e, clock))
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
