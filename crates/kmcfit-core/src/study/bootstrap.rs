//! Bootstrap intervals: percentiles of parameters refitted to simulated samples.
//!
//! Each replicate is a full refit (Gauss–Newton under the constraints, started at the optimum) to simulated samples, the
//! predictions at the optimum plus noise. The parametric bootstrap draws normal noise with the standard deviation of each
//! sample, correlated where the noise of the channel is. The residual bootstrap draws residuals with replacement within each channel, after subtracting their mean and
//! multiplying them by `sqrt(n / (n - p))`. Priors and penalties are the same in every replicate.
//!
//! Source: B. Efron, R. J. Tibshirani, *An Introduction to the Bootstrap*, Chapman & Hall 1993,
//! chapters 6, 9 and 13.

use super::functional::Linear;
use super::refit::settings;
use super::simulate::{noise_of, normal, sigmas, stream, with_samples};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use crate::solvers::{Status, fit_from};
use crate::threads::map_with_progress;
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Source of the noise in a replicate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplicateNoise {
    /// Normal noise with the sigma of the samples, or of the residuals where no sigma is stated.
    Parametric,
    /// Residuals, drawn with replacement.
    Residual,
}

/// Reason for which no refits are made.
#[derive(Debug, Clone, PartialEq)]
pub enum NoRefits {
    /// The samples do not determine all parameters, or there are too many parameters. Refits from the optimum would not
    /// move along the undetermined directions.
    Undetermined,
    /// The simulation at the optimum fails.
    NoResponse(SimulationError),
}

impl From<SimulationError> for NoRefits {
    fn from(error: SimulationError) -> Self {
        Self::NoResponse(error)
    }
}

/// A quantity and its interval; `None` where fewer than two refits succeeded.
pub type NumberInterval = (Linear, Option<[f64; 2]>);

/// Intervals of all constants and scalar parameters and of `further` quantities, each listed once.
///
/// # Errors
/// [`NoRefits`], the reason.
pub fn intervals(
    problem: &Problem,
    optimum: &[f64],
    further: impl Iterator<Item = Linear>,
    (noise, count, seed): (ReplicateNoise, usize, u64),
    level: f64,
    threads: usize,
) -> Result<Vec<NumberInterval>, NoRefits> {
    let evaluation = problem.evaluate(optimum)?;
    if problem.covariance(&evaluation).is_none() {
        return Err(NoRefits::Undetermined);
    }
    let found = bootstrap(problem, optimum, noise, count, seed, threads)?;
    let constants = problem.functions.iter().enumerate();
    let constants = constants.filter(|(_, f)| f.parameters() == 1);
    let constants = constants.map(|(f, _)| Linear::mean(problem, f));
    let scalars = 0..problem.functions.scalars().len();
    let scalars = scalars.map(|i| Linear::scalar(problem, i));
    let mut intervals: Vec<NumberInterval> = Vec::new();
    for of in constants.chain(scalars).chain(further) {
        if intervals.iter().all(|(other, _)| other.name != of.name) {
            let interval = found.interval(&of, level);
            intervals.push((of, interval));
        }
    }
    Ok(intervals)
}

/// Results of the refits.
#[derive(Debug, Clone, PartialEq)]
pub struct Bootstrap {
    /// The optimum that the replicates start from.
    pub optimum: Vec<f64>,
    /// Parameters of each refit, in the order of the replicates; `Err` holds the reason for a failure.
    pub replicates: Vec<Result<Vec<f64>, String>>,
    /// The seed.
    pub seed: u64,
}

/// Computes `count` refits about `optimum` on up to `threads` threads; results do not depend on the number of threads.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the optimum fails.
pub fn bootstrap(
    problem: &Problem,
    optimum: &[f64],
    noise: ReplicateNoise,
    count: usize,
    seed: u64,
    threads: usize,
) -> Result<Bootstrap, SimulationError> {
    let evaluation = problem.evaluate(optimum)?;
    let sigmas = sigmas(problem, &evaluation);
    let job = |index: usize| {
        let mut random = stream(seed, index);
        let errors = match noise {
            ReplicateNoise::Parametric => {
                let unit = normal(&mut random, sigmas.len());
                noise_of(problem, &unit, &sigmas)
            }
            ReplicateNoise::Residual => drawn(problem, &evaluation, &mut random),
        };
        let simulated = with_samples(problem, &evaluation, &errors);
        match fit_from(&simulated, optimum, &settings()) {
            Err(breakdown) => Err(breakdown.to_string()),
            Ok(fit) => match fit.outcome.status {
                Status::Converged | Status::Completed => Ok(fit.best.parameters),
                _ => Err(fit.outcome.reason.to_string()),
            },
        }
    };
    Ok(Bootstrap {
        replicates: map_with_progress(count, threads, job),
        optimum: optimum.to_vec(),
        seed,
    })
}

/// Noise drawn from the residuals of each channel, centred and widened. For samples with individual sigmas the normalised
/// residuals (residual over sigma) are drawn, for correlated noise the innovations, which are then correlated again.
fn drawn(problem: &Problem, evaluation: &Evaluation, random: &mut ChaCha8Rng) -> Vec<f64> {
    let samples = problem.sample_count() as f64;
    let freedom = (samples - problem.parameters() as f64).max(1.0);
    let wider = (samples / freedom).sqrt();
    let mut all = Vec::with_capacity(problem.sample_count());
    for (channel, predicted) in problem.predicted(evaluation) {
        let sigma = |i: usize| channel.weighting().sigma(i).unwrap_or(1.0);
        let innovations = channel.innovations(predicted).into_iter().enumerate();
        let units: Vec<f64> = innovations.map(|(i, r)| -r / sigma(i)).collect();
        let mean = units.iter().sum::<f64>() / units.len() as f64;
        let mut pick = || wider * (units[random.random_range(0..units.len())] - mean);
        let picks: Vec<f64> = (0..units.len()).map(|_| pick()).collect();
        let sigmas: Vec<f64> = (0..units.len()).map(sigma).collect();
        all.extend(channel.noise_from(&picks, &sigmas));
    }
    all
}

impl Bootstrap {
    /// The parameters of the refits that succeeded.
    pub fn found(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.replicates.iter().filter_map(|r| r.as_ref().ok())
    }

    /// Number of failed refits.
    pub fn failures(&self) -> usize {
        self.replicates.iter().filter(|r| r.is_err()).count()
    }

    /// Covariance of the refitted parameters about their mean; `None` with fewer than two refits.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let n = self.optimum.len();
        let count = self.found().count();
        if count < 2 {
            return None;
        }
        let mut mean = vec![0.0; n];
        for theta in self.found() {
            mean.iter_mut()
                .zip(theta)
                .for_each(|(m, t)| *m += t / count as f64);
        }
        let mut covariance = DMatrix::zeros(n, n);
        for theta in self.found() {
            for i in 0..n {
                for j in 0..n {
                    covariance[(i, j)] += (theta[i] - mean[i]) * (theta[j] - mean[j]);
                }
            }
        }
        Some(covariance / (count - 1) as f64)
    }

    /// Percentile interval of `of`: a share `(1 - level)/2` of the refits lies on either side, with linear interpolation
    /// between them; `None` with fewer than two refits.
    pub fn interval(&self, of: &Linear, level: f64) -> Option<[f64; 2]> {
        let mut values: Vec<f64> = self.found().map(|theta| of.of(theta)).collect();
        values.sort_by(f64::total_cmp);
        (values.len() > 1).then(|| {
            let tail = 0.5 * (1.0 - level);
            [tail, 1.0 - tail].map(|share| quantile(&values, share))
        })
    }
}

/// Quantile of sorted values, interpolated linearly.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let low = place.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (place - low as f64) * (sorted[high] - sorted[low])
}
