//! Errors of a measured input: is a stated sigma that of the residuals, and where none is stated, do the residuals show a
//! disturbance that enters through the equation of motion?
//!
//! The residuals `r` of a channel have under noise of the channel and errors of the input, with the ratio `rho` of their sigmas,
//!
//! ```text
//! -2 log L(rho) = n log(r^T R^-1 r / n) + log |R| + n (log 2 pi + 1),    R = I + rho^2 G G^T
//! ```
//!
//! with the derivatives `G` of the samples with respect to the input samples. This likelihood is compared with that of the
//! autoregressive noise of the fit by the Bayesian information criterion. A noisy sensor, an unmeasured drive and a term missing
//! from the equation leave such residuals alike.

use super::Doubt;
use super::input_correlation::measured;
use crate::diagnostics::{SIGNIFICANCE, standard_deviation};
use crate::identifiability::Quantity;
use crate::noise::{Correlation, InputErrors};
use crate::objective::{Evaluation, diagnostics};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Experiment, InputNoise, InputNoiseKind, Loss, NoiseModel};
use crate::scalar_search::minimum;
use crate::simd::sum::rms;
use crate::solvers::input_error_effect;
use crate::system::InputQuantity;

/// Ratio of a stated sigma to the likely one, or its inverse, above which it is contradicted.
const CONTRADICTED: f64 = 1.3;
/// Range of that ratio in the search.
const RATIOS: [f64; 2] = [0.1, 10.0];
/// Quantile of chi-square with one degree of freedom, of probability 99 %: difference of `-2 log L` that noise explains.
const SIGNIFICANT: f64 = 6.635;
/// Difference of the criteria from which the evidence for a disturbance is very strong (Kass and Raftery 1995).
const EVIDENCE: f64 = 10.0;
/// Residuals that may be noise, as a share of the variation of the samples.
const NOISE: [f64; 2] = [1e-4, 0.5];
/// Range of the ratio of an input's sigma to the input itself in the search.
const SHARES: [f64; 2] = [1e-4, 1.0];
/// Tolerance of the logarithm of a ratio in the searches.
const TOLERANCE: f64 = 0.01;
/// Number of samples from the beginning of a record that are compared: an estimate from so many is certain enough.
const MOST_SAMPLES: usize = 20_000;

/// Warnings about the inputs of all experiments.
pub(super) fn input_warnings(problem: &Problem, evaluation: &Evaluation) -> Vec<Doubt> {
    if problem.parameters() > FEW_PARAMETERS {
        return Vec::new();
    }
    let each = (0..problem.experiments.len()).filter_map(|e| warning(problem, evaluation, e));
    each.collect()
}

fn warning(problem: &Problem, evaluation: &Evaluation, e: usize) -> Option<Doubt> {
    let experiment = &problem.experiments[e];
    let [channel] = experiment.channels.as_slice() else {
        return None;
    };
    let residuals: Vec<f64> = channel.residuals(&evaluation.predictions[e][0]).collect();
    let share = rms(&residuals) / standard_deviation(channel.observed());
    if !(NOISE[0]..NOISE[1]).contains(&share) {
        return None;
    }
    match &experiment.input_error {
        Some(error) => contradicted(experiment, channel, &residuals, error),
        None => disturbed(problem, evaluation, e, &residuals),
    }
}

/// Warning where a stated sigma of the input is contradicted by the residuals.
fn contradicted(
    experiment: &Experiment,
    channel: &Channel,
    residuals: &[f64],
    error: &InputNoise,
) -> Option<Doubt> {
    let effect = channel.correlation().and_then(Correlation::input_errors)?;
    let count = residuals.len().min(MOST_SAMPLES);
    let sigma = channel.weighting().sigma(0)?;
    let normalised: Vec<f64> = residuals[..count].iter().map(|r| r / sigma).collect();
    // With the sigma of the channel as it is.
    let minus_two_log = |log: f64| {
        let [squares, determinant] = effect.likelihood(log.exp() * effect.ratio(), &normalised);
        squares + determinant
    };
    let (log, least) = minimum(minus_two_log, RATIOS.map(f64::ln), TOLERANCE);
    let ratio = log.exp();
    let is_significant = minus_two_log(0.0) - least > SIGNIFICANT;
    let is_far = !(1.0 / CONTRADICTED..=CONTRADICTED).contains(&ratio);
    (is_significant && is_far).then(|| Doubt::ContradictedInputSigma {
        experiment: experiment.name.clone(),
        input: error.quantity,
        given: error.sigma,
        likely: ratio * error.sigma,
    })
}

/// Warning where errors of the measured input explain the residuals better than the noise of the channel.
fn disturbed(
    problem: &Problem,
    evaluation: &Evaluation,
    e: usize,
    residuals: &[f64],
) -> Option<Doubt> {
    let experiment = &problem.experiments[e];
    let channel = &experiment.channels[0];
    let is_coloured = || !is_white(channel, &evaluation.predictions[e][0]);
    (channel.correlation().is_some() || is_coloured()).then_some(())?;
    let found = Disturbance::of(problem, evaluation, e)?;
    let count = residuals.len().min(MOST_SAMPLES);
    let residuals = &residuals[..count];
    let n = count as f64;
    let as_noise = match channel.correlation() {
        None => n * mean_square(residuals).ln(),
        Some(correlation) => {
            let correlation = correlation.first(count);
            let innovations = correlation.whiten(residuals);
            let order = correlation.order() as f64;
            n * mean_square(&innovations).ln() + correlation.log_determinant() + order * n.ln()
        }
    };
    let as_disturbance = found.of_first + n.ln();
    (as_noise - as_disturbance > EVIDENCE).then(|| found.doubt())
}

/// A disturbance of the measured input of an experiment, as it would leave the residuals of its channels, each by itself.
pub(crate) struct Disturbance {
    experiment: String,
    input: InputQuantity,
    /// Sigma of the errors of the input, in its SI unit.
    sigma: f64,
    /// The same relative to the input, root mean square.
    share: f64,
    /// Sum over the channels of `n log(r^T R^-1 r / n) + log |R|` of the weighted residuals `r` of all samples.
    pub(crate) minus_two_log: f64,
    /// The same of the first samples, not weighted.
    of_first: f64,
}

impl Disturbance {
    /// `None` without a measured input, and for other noise than that of one sigma for each channel.
    pub(crate) fn of(problem: &Problem, evaluation: &Evaluation, e: usize) -> Option<Self> {
        let experiment = &problem.experiments[e];
        let is_judged = |channel: &Channel| {
            channel.weighting().is_sigma()
                && channel.loss() == Loss::Squares
                && channel.filter().is_empty()
                && channel.noise_model() == NoiseModel::Auto
        };
        let is_open = experiment.input_error.is_none() && experiment.channels.iter().all(is_judged);
        let (input, signal) = measured(experiment).filter(|_| is_open)?;
        let size = rms(signal.values());
        let error = InputNoise {
            quantity: input,
            kind: InputNoiseKind::Sensor,
            sigma: size,
            times: signal.times().to_vec(),
            interpolation: signal.interpolation(),
        };
        let channels = experiment.channels.iter().zip(&evaluation.predictions[e]);
        let channels: Vec<(Vec<f64>, f64, InputErrors)> = channels
            .map(|(channel, predicted)| {
                let residuals = channel.residuals(predicted).take(MOST_SAMPLES);
                let residuals: Vec<f64> = residuals.collect();
                let count = residuals.len();
                let effect = input_error_effect(problem, evaluation, e, channel, &error, count);
                let unit = rms(&residuals);
                (residuals, unit, effect)
            })
            .collect();
        // The sigma of a channel is profiled: that of the input is the ratio times it.
        let of_channel = |(residuals, unit, effect): &(Vec<f64>, f64, InputErrors), share: f64| {
            let n = residuals.len() as f64;
            let [squares, determinant] = effect.likelihood(share * size / unit, residuals);
            (
                n * (squares / n).ln() + determinant,
                (squares / n).sqrt() / unit,
            )
        };
        let minus_two_log = |log: f64| -> f64 {
            channels
                .iter()
                .map(|channel| of_channel(channel, log.exp()).0)
                .sum()
        };
        let (log, least) = minimum(minus_two_log, SHARES.map(f64::ln), TOLERANCE);
        let (_, scale) = of_channel(channels.first()?, log.exp());
        let share = log.exp() * scale;
        let of_all = channels
            .iter()
            .zip(&experiment.channels)
            .map(|(own, channel)| {
                let n = own.0.len() as f64;
                let weight = channel
                    .weighting()
                    .sigma(0)
                    .map_or(0.0, |sigma| 2.0 * sigma.ln());
                (of_channel(own, log.exp()).0 - n * weight) * channel.len() as f64 / n
            });
        Some(Self {
            experiment: experiment.name.clone(),
            input,
            sigma: share * size,
            share,
            minus_two_log: of_all.sum(),
            of_first: least,
        })
    }

    pub(crate) fn doubt(&self) -> Doubt {
        Doubt::DisturbedInput {
            experiment: self.experiment.clone(),
            input: self.input,
            sigma: self.sigma,
            share: self.share,
        }
    }

    /// What it estimates.
    pub(crate) fn estimates(&self) -> Vec<Quantity> {
        vec![Quantity::new("sigma", self.input.unit(), self.sigma)]
    }
}

/// True for residuals without significant autocorrelation, which leave no evidence of a disturbance.
fn is_white(channel: &Channel, predicted: &[f64]) -> bool {
    diagnostics(channel, predicted).whiteness.p_value >= SIGNIFICANCE
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}
