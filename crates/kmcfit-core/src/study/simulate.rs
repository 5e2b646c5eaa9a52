//! Simulated samples: predictions of a system plus seeded noise.

use crate::objective::Evaluation;
use crate::problem::Problem;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Random number generator of job `index` under `seed`; independent of the thread.
pub fn stream(seed: u64, index: usize) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(index as u64);
    random
}

/// Standard deviation of every sample, ordered by experiment, channel and sample: the stated sigma, or else the root mean
/// square of the unweighted residuals of all channels without sigma, corrected by `n / (n - p)`.
pub fn sigmas(problem: &Problem, evaluation: &Evaluation) -> Vec<f64> {
    let (mut squares, mut count) = (0.0, 0usize);
    for (channel, predicted) in problem.predicted(evaluation) {
        if !channel.weighting().is_sigma() {
            squares += channel.residuals(predicted).map(|r| r * r).sum::<f64>();
            count += channel.len();
        }
    }
    let freedom = count.saturating_sub(problem.parameters()).max(1) as f64;
    let estimate = (squares / freedom).sqrt();
    let each = problem
        .channels()
        .flat_map(|c| (0..c.len()).map(|i| c.weighting().sigma(i)));
    each.map(|sigma| sigma.unwrap_or(estimate)).collect()
}

/// Noise of every sample from independent numbers of unit variance, in the order of [`sigmas`], correlated as that of each channel.
pub fn noise_of(problem: &Problem, unit: &[f64], sigmas: &[f64]) -> Vec<f64> {
    let mut noise = Vec::with_capacity(unit.len());
    for channel in problem.channels() {
        let samples = noise.len()..noise.len() + channel.len();
        noise.extend(channel.noise_from(&unit[samples.clone()], &sigmas[samples]));
    }
    noise
}

/// `count` standard normal numbers.
pub fn normal(random: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| StandardNormal.sample(random)).collect()
}

/// The problem with samples `predictions + noise`; noise in the order of [`sigmas`].
pub fn with_samples(problem: &Problem, evaluation: &Evaluation, noise: &[f64]) -> Problem {
    let mut simulated = problem.clone();
    let mut first = 0;
    let experiments = simulated.parts_mut().experiments.iter_mut();
    for (experiment, predictions) in experiments.zip(&evaluation.predictions) {
        for (channel, predicted) in experiment.channels.iter_mut().zip(predictions) {
            let part = &noise[first..first + predicted.len()];
            first += predicted.len();
            *channel = channel.clone().with_simulated(predicted, part);
        }
    }
    simulated
}
