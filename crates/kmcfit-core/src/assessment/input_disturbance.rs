//! Errors of a measured input: is a stated sigma that of the residuals, and where none is stated, do the residuals show a
//! disturbance that enters through the equation of motion?

use super::Doubt;
use crate::alternatives::{Disturbance, MOST_SAMPLES, TOLERANCE};
use crate::diagnostics::{SIGNIFICANCE, standard_deviation};
use crate::noise::Correlation;
use crate::objective::{Evaluation, diagnostics};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Experiment, InputNoise};
use crate::scalar_search::minimum;
use crate::simd::sum::rms;

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
    (as_noise - as_disturbance > EVIDENCE).then(|| doubt(&found))
}

/// The doubt about a disturbance.
pub(super) fn doubt(found: &Disturbance) -> Doubt {
    Doubt::DisturbedInput {
        experiment: found.experiment.clone(),
        input: found.input,
        sigma: found.sigma,
        share: found.share,
    }
}

/// True for residuals without significant autocorrelation, which leave no evidence of a disturbance.
fn is_white(channel: &Channel, predicted: &[f64]) -> bool {
    diagnostics(channel, predicted).whiteness.p_value >= SIGNIFICANCE
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}
