//! Coherence of the residuals with a measured input: dynamics that the model does not have, also where a noise model makes the residuals
//! white.
//!
//! The innovations `e` of a channel are regressed on the input `u` at the time of the sample and before,
//!
//! ```text
//! e_i = sum_l h_l u(t_i - l dt) + ...,    n R^2 ~ chi-square with the rank of the regressors
//! ```
//!
//! for innovations independent of the input (score test; Ljung 1999, section 16.6). The squared multiple correlation `R^2` is the share of
//! the variance of the innovations that is coherent with the input.

use super::Doubt;
use crate::alternatives::measured;
use crate::objective::{Evaluation, channel_fit_percent};
use crate::problem::Problem;
use crate::record::{Channel, Loss};
use crate::signal::Signal;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Number of lags, in samples: two to four periods at usual sampling rates.
const LAGS: usize = 40;
/// Most samples that are judged.
const MOST_SAMPLES: usize = 20_000;
/// Probability below which innovations are coherent with the input.
const CERTAIN: f64 = 1e-5;
/// Smallest share of their variance that is named.
const SHARE: f64 = 0.02;
/// Singular values below this share of the largest one add no regressor.
const RANK: f64 = 1e-3;
/// Fit, per cent, above which residuals are errors of the time steps, which follow the input.
const EXACT: f64 = 99.9;

/// The channel whose innovations have the largest share that is coherent with the input of their experiment.
pub(super) fn coherent_residuals(problem: &Problem, evaluation: &Evaluation) -> Option<Doubt> {
    let experiments = problem.experiments.iter().zip(&evaluation.predictions);
    let all = experiments.flat_map(|(experiment, predictions)| {
        let channels = experiment.channels.iter().zip(predictions);
        channels.filter_map(move |(channel, predicted)| {
            let (input, signal) = measured(experiment)?;
            let share = coherent_share(channel, predicted, signal)?;
            Some((share, experiment, channel, input))
        })
    });
    let (share, experiment, channel, input) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Doubt::CoherentResiduals {
        experiment: experiment.name.clone(),
        channel: channel.kind().name().to_owned(),
        input,
        share,
    })
}

/// Share of the innovations of a channel that is coherent with the input; `None` where it is not significant, and for samples at unequal
/// intervals, without sigma or with a robust loss.
fn coherent_share(channel: &Channel, predicted: &[f64], input: &Signal) -> Option<f64> {
    let times = channel.times();
    let count = times.len().checked_sub(LAGS)?.min(MOST_SAMPLES);
    let spacing = times.get(1)? - times[0];
    let is_even = times
        .windows(2)
        .all(|pair| ((pair[1] - pair[0]) / spacing - 1.0).abs() < 0.01);
    let is_judged = is_even
        && count > 10 * LAGS
        && channel.weighting().is_sigma()
        && channel.loss() == Loss::Squares
        && channel_fit_percent(channel, predicted) < EXACT;
    is_judged.then_some(())?;
    let innovations = DVector::from_vec(channel.majorant(predicted).weighted);
    let innovations = innovations.rows(LAGS, count);
    let at_samples = input.values_at(times);
    let mean = at_samples.iter().sum::<f64>() / at_samples.len() as f64;
    let about_mean = at_samples.iter().map(|u| u - mean);
    let input = DVector::from_iterator(at_samples.len(), about_mean);
    let lagged = |l: usize| input.rows(LAGS - l, count);
    let products = products_of_lags(&input, count);
    (products.iter().all(|x| x.is_finite())).then_some(())?;
    let normal = SymmetricEigen::new(products);
    let moments = DVector::from_fn(LAGS, |l, _| lagged(l).dot(&innovations));
    let along = normal.eigenvectors.tr_mul(&moments);
    let least = RANK * RANK * normal.eigenvalues.max();
    let kept = normal.eigenvalues.iter().zip(&along);
    let kept = kept.filter(|(square, _)| **square > least);
    let explained: f64 = kept.clone().map(|(square, x)| x * x / square).sum();
    let share = explained / innovations.norm_squared();
    let law = ChiSquared::new(kept.count() as f64).ok()?;
    let probability = 1.0 - law.cdf(count as f64 * share);
    (probability < CERTAIN && share > SHARE).then_some(share)
}

/// `sum_i u_(L+i-l) u_(L+i-m)` of `count` terms at the lags l, m below `L = LAGS`. Entries along a diagonal differ by the terms at the ends.
fn products_of_lags(input: &DVector<f64>, count: usize) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(LAGS, LAGS);
    for m in 0..LAGS {
        products[(0, m)] = input.rows(LAGS, count).dot(&input.rows(LAGS - m, count));
    }
    for l in 1..LAGS {
        for m in l..LAGS {
            let (first, last) = (LAGS, LAGS + count);
            products[(l, m)] = products[(l - 1, m - 1)] + input[first - l] * input[first - m]
                - input[last - l] * input[last - m];
        }
    }
    products.fill_lower_triangle_with_upper_triangle();
    products
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn white(seed: u64, count: usize) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| StandardNormal.sample(&mut random))
            .collect()
    }

    /// The right system, whose samples are its response, white noise of unit variance, and a multiple of the force three samples before.
    fn share(seed: u64, factor: f64) -> Option<f64> {
        let count = 1000;
        let times: Vec<f64> = (0..count).map(|i| 0.05 * i as f64).collect();
        let force = white(seed, count);
        let start = [2.0, 3.0, 50.0].map(CoefficientSpec::constant);
        let record = |samples: &[f64]| {
            let record = Record::new("shaker")
                .from_state(0.0, 0.0)
                .force(&times, &force);
            let record = record.displacement(&times, samples).sigma(1.0);
            let builder = Builder::new(start.clone()).record(record);
            builder.build().unwrap()
        };
        let simulated = record(&vec![0.0; count])
            .evaluate(&[2.0, 3.0, 50.0])
            .unwrap();
        let noise = white(1000 + seed, count);
        let samples = simulated.predictions[0][0].iter().zip(noise).enumerate();
        let samples: Vec<f64> = samples
            .map(|(i, (y, e))| y + e + i.checked_sub(3).map_or(0.0, |j: usize| factor * force[j]))
            .collect();
        let problem = record(&samples);
        let evaluation = problem.evaluate(&[2.0, 3.0, 50.0]).unwrap();
        match coherent_residuals(&problem, &evaluation)? {
            Doubt::CoherentResiduals { share, .. } => Some(share),
            other => panic!("{other:?}"),
        }
    }

    /// Products of lags are those of the matrix of regressors, to the rounding of 40 differences.
    #[test]
    fn products_of_lags_are_those_of_the_regressors() {
        let input = DVector::from_vec(white(3, 540));
        let regressors = DMatrix::from_fn(500, LAGS, |i, l| input[LAGS + i - l]);
        let expected = regressors.tr_mul(&regressors);
        let found = products_of_lags(&input, 500);
        assert!((&found - &expected).amax() < 1e-12 * expected.amax());
    }

    /// A part of 0.3 times the force has the share `0.09 / 1.09` of the variance, to which chance adds `40 / n`; the standard error is about
    /// `2 sqrt(R^2 (1 - R^2) / n) = 0.02`.
    #[test]
    fn a_part_of_the_force_is_found_and_noise_is_not() {
        for seed in 0..20 {
            assert_eq!(share(seed, 0.0), None, "{seed}");
            let expected = 0.09 / 1.09 + 40.0 / 960.0;
            let found = share(seed, 0.3).expect("a coherent part");
            assert!((found - expected).abs() < 0.06, "{seed}: {found}");
        }
    }
}
