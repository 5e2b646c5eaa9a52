//! Parameters of a record besides those of the model: delay and rate of the clock of its response, and gains of its channels.
//!
//! With the response on its own clock, sample `i` at the time `t_i` of the record shows the system at
//!
//! ```text
//! t = t_0 + (1 + rate) (t_i - t_0) - delay
//! ```
//!
//! so that the predictions `p` have the derivatives `-p'` in the delay, `(t_i - t_0) p'` in the rate, and `p` in a gain of the channel.

use super::refit::without_correlation;
use crate::functions::{ScalarParameter, ScalarValue};
use crate::objective::{Evaluation, SimulatedRecord};
use crate::problem::Problem;
use crate::record::{Channel, Experiment, InputNoise, InputNoiseKind, Sensor, Weighting};
use crate::rows::append;
use crate::system::{Grid, InputSample};
use crate::threads::{available, map};

/// Number of samples that are moved at once.
const BLOCK: usize = 1 << 17;
/// Share of a step by which the clock of the response is moved for derivatives.
const SMALL: f64 = 0.01;

/// Clock of a response relative to that of its input.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Clock {
    /// Delay of the response, s.
    pub delay: f64,
    /// Relative difference of the rates.
    pub rate: f64,
}

/// A parameter of a record besides those of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordParameter {
    /// Delay of the response of an experiment.
    Delay(usize),
    /// Difference of the rates of the clocks of an experiment.
    Rate(usize),
    /// Gain of a channel of an experiment.
    Gain(usize, usize),
    /// Offset of a channel of an experiment.
    Offset(usize, usize),
    /// Drift of a channel of an experiment.
    Drift(usize, usize),
}

impl RecordParameter {
    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Delay(_) => "delay",
            Self::Rate(_) => "clock_rate",
            Self::Gain(..) => "gain",
            Self::Offset(..) => "offset",
            Self::Drift(..) => "drift",
        }
    }
}

/// Parameters of the records that errors of the data may need: clocks of records with a measured input, and gains of channels where an
/// input or another channel shows them.
pub(crate) fn record_parameters(problem: &Problem) -> Vec<RecordParameter> {
    let mut found = Vec::new();
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for (c, channel) in experiment.channels.iter().enumerate() {
            let sensor = channel.sensor();
            let is_filtered = !channel.filter().is_empty();
            if sensor.offset.index().is_none() && !is_filtered {
                found.push(RecordParameter::Offset(e, c));
            }
            if sensor.drift.index().is_none() && !is_filtered {
                found.push(RecordParameter::Drift(e, c));
            }
        }
        let is_estimated = |c: &Channel| c.sensor().is_delayed();
        if !experiment.is_free() && !experiment.channels.iter().any(is_estimated) {
            found.extend([RecordParameter::Delay(e), RecordParameter::Rate(e)]);
        }
        // With a noisy sensor of the input a part of the prediction is held, which has no derivative in a gain.
        let holds = |error: &InputNoise| error.kind == InputNoiseKind::Sensor;
        let is_held = experiment.input_error.as_ref().is_some_and(holds);
        if !is_held && (!experiment.is_free() || experiment.channels.len() > 1) {
            let open = experiment.channels.iter().enumerate();
            let open = open.filter(|(_, c)| c.sensor().gain.index().is_none());
            found.extend(open.map(|(c, _)| RecordParameter::Gain(e, c)));
        }
    }
    found
}

/// Derivatives of the weighted and whitened predictions of all channels in parameters of records; for a gain in its logarithm.
pub(crate) struct RecordColumns {
    /// Derivatives in time of the predictions of each channel of an experiment; `None` where they are not asked for or do not exist.
    slopes: Vec<Option<Vec<Vec<f64>>>>,
    /// Roots of the weights of the samples of each channel, or the one of all.
    weight_roots: Vec<Vec<f64>>,
}

impl RecordColumns {
    /// For these parameters.
    pub(crate) fn of(
        problem: &Problem,
        evaluation: &Evaluation,
        parameters: &[RecordParameter],
    ) -> Self {
        let of_clock = |e: usize| {
            let is_clock = |parameter: &RecordParameter| matches!(parameter, RecordParameter::Delay(of) | RecordParameter::Rate(of) if *of == e);
            let channels = problem.experiments[e].channels.iter();
            let pairs = channels.zip(&evaluation.predictions[e]);
            let each = pairs
                .map(|(channel, predicted)| slopes(problem, evaluation, e, channel, predicted));
            let asked = parameters.iter().any(is_clock);
            asked.then(|| each.collect::<Option<Vec<_>>>()).flatten()
        };
        let experiments = problem.experiments.len();
        Self {
            slopes: map(experiments, available(), of_clock),
            weight_roots: (problem.predicted(evaluation))
                .map(|(channel, predicted)| match channel.uniform_weights() {
                    Some([inner, ends]) if inner == ends => vec![inner.sqrt()],
                    _ => channel.majorant(predicted).weight_roots,
                })
                .collect(),
        }
    }

    /// The column of a parameter, at the evaluation of the problem.
    pub(crate) fn column(
        &self,
        problem: &Problem,
        evaluation: &Evaluation,
        parameter: RecordParameter,
    ) -> Option<Vec<f64>> {
        let predictions = &evaluation.predictions;
        let start = problem.system.grid.start();
        let mut all = Vec::new();
        let mut weight_roots = self.weight_roots.iter();
        for (e, experiment) in problem.experiments.iter().enumerate() {
            for (c, channel) in experiment.channels.iter().enumerate() {
                let mut rows = match parameter {
                    RecordParameter::Gain(of, which) if (of, which) == (e, c) => {
                        predictions[e][c].clone()
                    }
                    RecordParameter::Delay(of) if of == e => {
                        let slopes = &self.slopes[e].as_ref()?[c];
                        slopes.iter().map(|slope| -slope).collect()
                    }
                    RecordParameter::Rate(of) if of == e => {
                        let slopes = &self.slopes[e].as_ref()?[c];
                        let pairs = slopes.iter().zip(channel.times());
                        pairs.map(|(slope, t)| slope * (t - start)).collect()
                    }
                    RecordParameter::Offset(of, which) if (of, which) == (e, c) => {
                        vec![1.0; channel.len()]
                    }
                    RecordParameter::Drift(of, which) if (of, which) == (e, c) => {
                        (0..channel.len()).map(|i| channel.elapsed_at(i)).collect()
                    }
                    _ => vec![0.0; channel.len()],
                };
                weigh(channel, &mut rows, weight_roots.next()?);
                append(&mut all, rows);
            }
        }
        Some(all)
    }

    /// Rows of a channel, one for each of its samples, weighted and whitened; zero for all other channels.
    pub(crate) fn weighted(
        &self,
        problem: &Problem,
        which: (usize, usize),
        mut rows: Vec<f64>,
    ) -> Vec<f64> {
        let mut all = Vec::with_capacity(problem.sample_count());
        let mut weight_roots = self.weight_roots.iter();
        for (e, experiment) in problem.experiments.iter().enumerate() {
            for (c, channel) in experiment.channels.iter().enumerate() {
                let weight_roots = weight_roots.next();
                let mut own = match (e, c) == which {
                    true => std::mem::take(&mut rows),
                    false => vec![0.0; channel.len()],
                };
                if let Some(weight_roots) = weight_roots.filter(|_| (e, c) == which) {
                    weigh(channel, &mut own, weight_roots);
                }
                append(&mut all, own);
            }
        }
        all
    }
}

fn weigh(channel: &Channel, rows: &mut [f64], weight_roots: &[f64]) {
    channel.whiten_rows(rows);
    match weight_roots {
        [root] => rows.iter_mut().for_each(|row| *row *= root),
        weight_roots => {
            (rows.iter_mut().zip(weight_roots)).for_each(|(row, root)| *row *= root);
        }
    }
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
    let grid = &problem.system.grid;
    let mut slopes = Vec::with_capacity(predicted.len());
    let mut add = |channel: &Channel, predicted: &[f64]| {
        let later = on_clock(experiment, channel, grid, clock)?;
        let later = predict(problem, evaluation, e, &later);
        let pairs = later.iter().zip(predicted);
        slopes.extend(pairs.map(|(later, now)| (later - now) / small));
        Some(())
    };
    match channel.filter() {
        [] => {
            let first = (0..predicted.len()).step_by(BLOCK);
            for samples in first.map(|i| i..predicted.len().min(i + BLOCK)) {
                let part = channel.part(samples.clone(), grid, experiment.nodes)?;
                // No sample remains of a block at the end of the record with a single one.
                add(&part, &predicted[samples.clone()]).or((samples.start > 0).then_some(()))?;
            }
        }
        _ => add(channel, predicted)?,
    }
    // A sample at the end of the record has no later one.
    slopes.resize(predicted.len(), slopes.last().copied()?);
    Some(slopes)
}

/// Predictions of a channel by the response of an evaluation.
pub(crate) fn predict(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    channel: &Channel,
) -> Vec<f64> {
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
pub(crate) fn on_clock(
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
    let inputs = channel.inputs_at_samples().map(|_| {
        let input_at = |t: &f64| InputSample {
            force: experiment.input.force_at(*t),
            base: experiment.input.base_acceleration_at(*t),
        };
        times.iter().map(input_at).collect::<Vec<_>>()
    });
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
    let moved = moved.with_origin(at(&plain.origin()));
    let moved = match inputs {
        Some(inputs) => moved.with_inputs_at_samples(inputs),
        None => moved,
    };
    Some(match channel.filter() {
        [] => moved,
        filter => moved.with_filter(filter.to_vec()),
    })
}

/// The problem with those samples of an experiment alone that another clock leaves in the record.
pub(crate) fn with_samples_of(problem: &Problem, e: usize, clock: Clock) -> Option<Problem> {
    let experiment = &problem.experiments[e];
    let grid = &problem.system.grid;
    let (start, end) = (grid.start(), grid.time(experiment.nodes - 1));
    let is_left = |t: &f64| {
        let moved = start + (1.0 + clock.rate) * (t - start) - clock.delay;
        (start..=end).contains(&moved)
    };
    let channels = experiment.channels.iter().map(|channel| {
        let times = channel.times();
        let first = times.iter().position(is_left)?;
        let count = times[first..].iter().take_while(|t| is_left(t)).count();
        channel.part(first..first + count, grid, experiment.nodes)
    });
    let channels: Option<Vec<Channel>> = channels.collect();
    let channels = channels?;
    (problem
        .clone()
        .with(|parts| parts.experiments[e].channels = channels))
    .ok()
}

/// The problem with the channels of an experiment on another clock, and white noise.
pub(crate) fn with_clock(problem: &Problem, e: usize, clock: Clock) -> Option<Problem> {
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

/// The problem with the gain of a channel estimated, as the last scalar.
pub(crate) fn with_gain(problem: &Problem, e: usize, c: usize, start: f64) -> Option<Problem> {
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
