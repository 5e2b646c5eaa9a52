//! Fits with errors of the input: errors in variables for a noisy sensor, generalised least squares for an unmeasured drive.
//!
//! With the residuals `r` of the measured input, the derivatives `G` of the samples with respect to the input samples, the sigmas
//! `s` of the input and `S` of the channel, the samples have the covariance `C = S^2 I + s^2 G G^T`.
//!
//! - *Unmeasured drive*: `r^T C^-1 r` with `C` held, renewed at each solution until the parameters rest. This estimate is unbiased
//!   (Berkson 1950).
//! - *Noisy sensor*: the errors of the input are estimated too, `eta = s^2 G^T C^-1 r`, and the response is linearised about the
//!   input `f + eta`: the minimum of `r^T C^-1 r` over the parameters, with the derivatives of `C`. It needs no `log |C|`, which would
//!   add the bias that these derivatives remove (Fuller 1987, Söderström 2007). The response to `eta` by the same linearisation
//!   is subtracted, so that the residuals stay those of the measured input.

use super::correlation_estimation::movement;
use super::executor::search;
use super::fit::Fit;
use super::observer::Observer;
use super::rounds::{counted, is_ended, with_round};
use super::settings::FitSettings;
use crate::noise::{Correlation, CorrelationLaw, InputErrors, InputRow, InputStep};
use crate::objective::{Evaluation, RowSamples};
use crate::problem::Problem;
use crate::record::{
    Channel, ChannelKind, Experiment, Input, InputNoise, InputNoiseKind, NoiseEstimate, Weighting,
};
use crate::scalar_search::root;
use crate::step::SimulationError;
use crate::system::{Grid, InputQuantity};
use nalgebra::DVector;
use std::sync::Arc;

/// Largest number of rounds of fit and estimation.
const ROUNDS: usize = 20;
/// Change of the parameters, in standard errors, below which they are at rest.
const AT_REST: f64 = 0.01;
/// Largest factor by which a sigma changes in one estimation, and the tolerance of its logarithm.
const WIDEST: f64 = 1e3;
const TOLERANCE: f64 = 1e-6;

/// True if the input of some experiment has errors of a stated sigma.
pub(super) fn has_input_errors(problem: &Problem) -> bool {
    let mut experiments = problem.experiments.iter();
    experiments.any(|e| e.input_error.is_some())
}

/// Continues `found` with the errors of the input; `problem` receives the noise, and for noisy sensors the estimated input.
pub(super) fn with_input_errors(
    problem: &mut Problem,
    mut found: Fit,
    settings: &FitSettings,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    let mut measured = problem.clone();
    for _ in 0..ROUNDS {
        if is_ended(&found) {
            break;
        }
        let before = found.best.parameters.clone();
        let evaluation = measured.evaluate(&before)?;
        *problem = counted(&mut found, |_| with_errors_at(&mut measured, &evaluation));
        let fit = search(problem, &before, settings, None, observer)?;
        found = with_round(found, fit, false);
        if movement(problem, &before, &found) < AT_REST {
            break;
        }
    }
    Ok(found)
}

/// The problem with the covariance of its samples and, for noisy sensors, with the estimated input, at an evaluated point of the problem
/// with the measured input, whose estimated sigmas are renewed.
fn with_errors_at(measured: &mut Problem, evaluation: &Evaluation) -> Problem {
    let share = (measured.parameters() as f64 / measured.sample_count() as f64).min(0.5);
    let mut next = measured.clone();
    let grid = next.system.grid;
    for e in 0..measured.experiments.len() {
        let experiment = &measured.experiments[e];
        let (Some(error), Some(channel)) =
            (experiment.input_error.clone(), experiment.channels.first())
        else {
            continue;
        };
        let effect = input_error_effect(measured, evaluation, e, channel, &error, channel.len());
        let predicted = &evaluation.predictions[e][0];
        let channel = &mut measured.parts_mut().experiments[e].channels[0];
        *channel = with_sigma(channel, &effect, error.sigma, predicted, share);
        let experiment = &mut next.parts_mut().experiments[e];
        experiment.channels[0] = channel.clone();
        let effect = effect.with_ratio(error.sigma / sigma_of(channel));
        if error.kind == InputNoiseKind::Sensor {
            let residuals: Vec<f64> = channel.residuals(predicted).map(|r| -r).collect();
            let inputs = effect.smoothed(&residuals, error.times.len());
            let [gain, ..] = channel.sensor().values(&evaluation.scalars);
            let response = effect.response(&inputs).into_iter();
            let response: Vec<f64> = response.map(|z| z / gain).collect();
            add_to_input(experiment, &grid, &error, &inputs, response);
        }
        let channel = &mut experiment.channels[0];
        let law = CorrelationLaw::InputErrors(Arc::new(effect));
        let noise = NoiseEstimate {
            correlation: Correlation::new(law, channel.times()),
            ..NoiseEstimate::default()
        };
        *channel = channel.clone().with_noise(noise);
    }
    next
}

/// Adds changes of the samples of an input to the experiment, and subtracts their effect `response` from the response at the samples of
/// the channel.
fn add_to_input(
    experiment: &mut Experiment,
    grid: &Grid,
    error: &InputNoise,
    inputs: &[f64],
    mut response: Vec<f64>,
) {
    let channel = &experiment.channels[0];
    let here = channel.times().iter().map(|t| error.at(inputs, *t));
    let here: Vec<f64> = here.collect();
    let is_absolute = channel.kind() == ChannelKind::Acceleration && !channel.base().is_empty();
    if error.quantity == InputQuantity::BaseAcceleration && is_absolute {
        // The sensor of absolute motion moves with the base.
        let pairs = response.iter_mut().zip(&here);
        pairs.for_each(|(change, base)| *change -= base);
    }
    let changed = channel.clone();
    experiment.channels[0] = changed.with_input_change(error.quantity, &here, &response);
    let nodes = (0..experiment.nodes).map(|i| error.at(inputs, grid.time(i)));
    let nodes: Vec<f64> = nodes.collect();
    let excitation = experiment.excitation.take().unwrap_or_default();
    experiment.excitation = Some(excitation.plus(error.quantity, &nodes));
    // The excitation is no longer that of the samples.
    experiment.input = Input::default();
}

/// Sigma of a channel with one sigma for all samples.
fn sigma_of(channel: &Channel) -> f64 {
    channel.weighting().sigma(0).unwrap_or(1.0)
}

/// Effect of errors of the input of experiment `e` on the first `count` samples of a channel, in the unit of the samples.
pub(crate) fn input_error_effect(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    channel: &Channel,
    error: &InputNoise,
    count: usize,
) -> InputErrors {
    let view = problem.view(evaluation, e);
    let derivatives = (view.driven()).input_derivatives(view.response, error.quantity);
    let [gain, ..] = channel.sensor().values(view.scalars);
    let grid = &problem.system.grid;
    let is_acceleration = channel.kind() == ChannelKind::Acceleration;
    let mut of_rows = RowSamples::new(channel, view);
    let acting = view
        .excitation
        .map_or(vec![0], |e| e.acting(error.quantity));
    let rows: Vec<InputRow> = (0..count)
        .map(|j| {
            let position = channel.position(view, j);
            let by_input = match is_acceleration {
                true => of_rows.by_input(j, error.quantity, &acting),
                false => 0.0,
            };
            let states = of_rows.observe(j).states.each_ref();
            let states = states.map(|by| gain * DVector::from_column_slice(by));
            InputRow {
                step: position.step,
                states,
                input: gain * by_input,
                position: error
                    .position(grid.time(position.step) + position.fraction * grid.step()),
            }
        })
        .collect();
    let reached = rows.last().map_or(0, |row| row.step) + 1;
    let steps = derivatives.into_iter().take(reached);
    let steps = steps.map(|(state, input)| InputStep { state, input });
    let steps: Vec<InputStep> = steps.collect();
    let positions = error.positions(grid, steps.len() + 1);
    InputErrors::new(&steps, &positions, &rows)
}

/// The channel with an estimated sigma at which `r^T C^-1 r` is the number of samples less the share of the parameters; a stated
/// sigma stays.
fn with_sigma(
    channel: &Channel,
    effect: &InputErrors,
    stated: f64,
    predicted: &[f64],
    share: f64,
) -> Channel {
    let Weighting::Estimated { sigma } = *channel.weighting() else {
        return channel.clone();
    };
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let target = (1.0 - share) * residuals.len() as f64;
    // Nearly linear in the logarithm of sigma.
    let excess = |log: f64| {
        let sigma = log.exp();
        let [squares, _] = effect.likelihood(stated / sigma, &residuals);
        (squares / (sigma * sigma * target)).ln()
    };
    let ends = [1.0 / WIDEST, WIDEST].map(|factor| (factor * sigma).ln());
    let sigma = root(excess, ends, TOLERANCE).map_or(sigma, f64::exp);
    channel
        .clone()
        .with_weighting(Weighting::Estimated { sigma })
}
