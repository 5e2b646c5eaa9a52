//! A disturbance of a measured input: errors of its samples, or an unmeasured drive, as they would leave the residuals.
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

use super::inputs::measured;
use crate::identifiability::Quantity;
use crate::noise::InputErrors;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Channel, InputNoise, InputNoiseKind, Loss, NoiseModel};
use crate::scalar_search::minimum;
use crate::simd::sum::rms;
use crate::solvers::input_error_effect;
use crate::system::InputQuantity;

/// Range of the ratio of an input's sigma to the input itself in the search.
const SHARES: [f64; 2] = [1e-4, 1.0];
/// Tolerance of the logarithm of a ratio in the searches.
pub(crate) const TOLERANCE: f64 = 0.01;
/// Number of samples from the beginning of a record that are compared: an estimate from so many is certain enough.
pub(crate) const MOST_SAMPLES: usize = 20_000;

/// A disturbance of the measured input of an experiment, as it would leave the residuals of its channels, each by itself.
pub(crate) struct Disturbance {
    pub(crate) experiment: String,
    pub(crate) input: InputQuantity,
    /// Sigma of the errors of the input, in its SI unit.
    pub(crate) sigma: f64,
    /// The same relative to the input, root mean square.
    pub(crate) share: f64,
    /// Sum over the channels of `n log(r^T R^-1 r / n) + log |R|` of the weighted residuals `r` of all samples.
    pub(crate) minus_two_log: f64,
    /// The same of the first samples, not weighted.
    pub(crate) of_first: f64,
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

    /// What it estimates.
    pub(crate) fn estimates(&self) -> Vec<Quantity> {
        vec![Quantity::new("sigma", self.input.unit(), self.sigma)]
    }
}
