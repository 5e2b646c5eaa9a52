//! Covariance of the sum of dependent scores, from the scores alone: consistent under heteroscedasticity and autocorrelation.
//!
//! With the scores `s_i` (gradients of the terms of a cost at its minimum) of `N` samples in several records and `q` parameters, the
//! estimate of `Cov(sum_i s_i)` is
//!
//! ```text
//! S = N/(N - q) sum_records sum_(i,j of one record) kappa((i - j)/b) s_i s_j^T
//! kappa(x) = 25/(12 pi^2 x^2) (sin(z)/z - cos(z)),    z = 6 pi x/5        quadratic-spectral kernel
//! b = 1.3221 (alpha N)^(1/5)
//! alpha = sum_a 4 rho_a^2 (1 + rho_a)^2/(1 - rho_a)^6 / sum_a (1 + rho_a)^2/(1 - rho_a)^2
//! ```
//!
//! with the autocorrelation `rho_a` of score `a` at lag one. Scores of different records count as independent. The covariance of
//! estimates is `H^-1 S H^-1` with the Hessian `H`.
//!
//! Source: Andrews (1991), *Heteroskedasticity and autocorrelation consistent covariance matrix estimation*, Econometrica 59,
//! Eqs. (2.7), (6.2) and (6.4), with each score scaled to unit variance, so that `S` transforms with the units of the parameters.
//! The sum is the integral of the spectrum of the scores with the spectral window of the kernel (Priestley 1962), which vanishes above a
//! frequency and is positive, so that `S` is a covariance. On a circle of `L` samples, with the discrete transforms `X_a` of the scores,
//!
//! ```text
//! sum_(i,j) kappa((i - j)/b) s_ia s_jb = 1/L sum_f W_f conj(X_fa) X_fb
//! W_f = sum_m w(omega_f + 2 pi m),    w(omega) = 5 b/4 (1 - (omega/omega_b)^2) for |omega| < omega_b = 6 pi/(5 b)
//! ```
//!
//! The kernel continues on the other side of the circle, where it is below `2e-4`: `L >= max(2 N, N + 32 b)`.

use crate::signal::RealTransform;
use crate::threads::{analyses_at_once, available_for, both};
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Largest absolute autocorrelation in the bandwidth (Andrews & Monahan 1992), which bounds it for scores near a random walk.
const LARGEST_CORRELATION: f64 = 0.97;
/// Frequency at which the spectral window ends, times the bandwidth in samples.
const WINDOW: f64 = 1.2 * PI;
/// Smallest number of bandwidths between the last sample and the first one of the next turn of the circle.
const APART: f64 = 32.0;

/// Longest circle that is always a power of two.
const LONG_CIRCLE: usize = 1 << 22;

/// Covariance of a sum of scores.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelCovariance {
    /// `S`, parameters x parameters, in the squared unit of the scores.
    pub sum: DMatrix<f64>,
    /// Bandwidth `b`, in samples.
    pub bandwidth: f64,
}

impl KernelCovariance {
    /// Covariance of the sum of the rows of `scores` (samples x parameters), in time order within each of the `records`, after the
    /// estimation of `estimated` parameters from them. `None` if there are not more samples than parameters, or a score is not
    /// finite.
    pub fn of(scores: &DMatrix<f64>, records: &[Range<usize>], estimated: f64) -> Option<Self> {
        let samples = records.iter().map(ExactSizeIterator::len).sum::<usize>() as f64;
        let is_finite = scores.iter().all(|s| s.is_finite());
        if !is_finite || samples - estimated <= 0.0 {
            return None;
        }
        let bandwidth = automatic_bandwidth(scores, records);
        let factor = samples / (samples - estimated);
        Some(Self {
            sum: kernel_sum(scores, records, bandwidth) * factor,
            bandwidth,
        })
    }
}

/// Bandwidth `b` in samples: optimal for scores that are autoregressive processes of order one.
pub fn automatic_bandwidth(scores: &DMatrix<f64>, records: &[Range<usize>]) -> f64 {
    let samples: usize = records.iter().map(ExactSizeIterator::len).sum();
    let (mut above, mut below) = (0.0, 0.0);
    for score in scores.column_iter() {
        let Some(rho) = correlation(score.as_slice(), records) else {
            continue;
        };
        let rho = rho.clamp(-LARGEST_CORRELATION, LARGEST_CORRELATION);
        let size = ((1.0 + rho) / (1.0 - rho)).powi(2);
        above += size * 4.0 * rho * rho / (1.0 - rho).powi(4);
        below += size;
    }
    if below == 0.0 {
        return 0.0;
    }
    1.3221 * (above / below * samples as f64).powf(0.2)
}

/// Autocorrelation at lag one; `None` for scores that vanish.
fn correlation(score: &[f64], records: &[Range<usize>]) -> Option<f64> {
    let (mut products, mut squares) = (0.0, 0.0);
    for record in records {
        let of_record = &score[record.clone()];
        products += of_record.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        squares += of_record.iter().map(|s| s * s).sum::<f64>();
    }
    (squares > 0.0).then(|| products / squares)
}

/// `sum_records sum_(i,j) kappa((i - j)/b) s_i s_j^T` for the bandwidth `b >= 0`; zero stands for independent scores.
pub fn kernel_sum(scores: &DMatrix<f64>, records: &[Range<usize>], bandwidth: f64) -> DMatrix<f64> {
    let parameters = scores.ncols();
    let mut sum = DMatrix::zeros(parameters, parameters);
    for record in records {
        let of_record = scores.rows(record.start, record.len());
        sum += match bandwidth == 0.0 || record.is_empty() {
            true => of_record.tr_mul(&of_record),
            false => correlated_sum(&of_record, bandwidth),
        };
    }
    // Symmetric to the last bit.
    0.5 * (&sum + sum.transpose())
}

/// Values of the spectra that are multiplied at once.
const ROWS: usize = 4096;

/// The sum over one record.
fn correlated_sum(scores: &DMatrixView<f64>, bandwidth: f64) -> DMatrix<f64> {
    let (count, parameters) = scores.shape();
    let least = (2 * count).max(count + (APART * bandwidth) as usize);
    let length = length_of_circle(least);
    let weights = window(length, bandwidth);
    let transform = || RealTransform::new(length, weights.len());
    if parameters == 1 {
        return weighted_square(scores.iter().copied(), &mut transform(), &weights);
    }
    // Real and imaginary parts of the scores, times the roots of their weights.
    let mut parts = DMatrix::zeros(2 * weights.len(), parameters);
    let transformed = |scores: &DMatrixView<f64>, mut parts: DMatrixViewMut<f64>| {
        let mut transform = transform();
        for (score, mut part) in scores.column_iter().zip(parts.column_iter_mut()) {
            let into = part.as_mut_slice();
            transform.process(score.iter().copied(), |k, x| {
                into[2 * k] = weights[k] * x.re;
                into[2 * k + 1] = weights[k] * x.im;
            });
        }
    };
    match analyses_at_once(count).min(available_for(count)) {
        1 => transformed(scores, parts.as_view_mut()),
        _ => {
            let half = parameters.div_ceil(2);
            let (first, second) = parts.columns_range_pair_mut(..half, half..);
            both(
                || transformed(&scores.columns_range(..half), first),
                || transformed(&scores.columns_range(half..), second),
            );
        }
    }
    let mut sum = DMatrix::zeros(parameters, parameters);
    for first in (0..parts.nrows()).step_by(ROWS) {
        let rows = parts.rows(first, ROWS.min(parts.nrows() - first));
        for a in 0..parameters {
            for b in 0..=a {
                sum[(a, b)] += rows.column(a).dot(&rows.column(b));
            }
        }
    }
    sum.fill_upper_triangle_with_lower_triangle();
    sum
}

/// The sum for a single score, which needs a block of its transform at a time.
fn weighted_square(
    score: impl Iterator<Item = f64>,
    transform: &mut RealTransform,
    weights: &[f64],
) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(1, 1);
    let mut block = Vec::with_capacity(ROWS);
    let mut add = |block: &mut Vec<f64>| {
        let rows = DMatrixView::from_slice(block, block.len(), 1);
        sum += rows.tr_mul(&rows);
        block.clear();
    };
    transform.process(score, |k, x| {
        block.extend([weights[k] * x.re, weights[k] * x.im]);
        if block.len() == ROWS {
            add(&mut block);
        }
    });
    add(&mut block);
    sum
}

/// Length of the circle for at least `least` samples: a power of two, or for a long record the shortest that is five to eight eighths of
/// one, because a transform takes several arrays of this length.
fn length_of_circle(least: usize) -> usize {
    let whole = least.next_power_of_two();
    let parts = if whole > LONG_CIRCLE { 5 } else { 8 };
    let lengths = (parts..8).map(|eighths| whole / 8 * eighths);
    lengths
        .chain([whole])
        .find(|length| *length >= least)
        .unwrap_or(whole)
}

/// Roots of the weights `W_f/L` of both signs of a frequency on a circle, up to the end of the spectral window.
fn window(length: usize, bandwidth: f64) -> Vec<f64> {
    let end = WINDOW / bandwidth;
    let half = length / 2;
    let last = ((end / TAU * length as f64) as usize).min(half);
    // Those of other turns are zero at all frequencies from zero to half a turn.
    let turns = -((0.5 + end / TAU) as i64)..=(end / TAU) as i64;
    let weight = |k: usize| {
        let frequency = TAU * k as f64 / length as f64;
        let each = turns.clone().map(|m| {
            let position = (frequency + TAU * m as f64) / end;
            (1.0 - position * position).max(0.0)
        });
        let sides = if k == 0 || k == half { 1.0 } else { 2.0 };
        (sides * 1.25 * bandwidth * each.sum::<f64>() / length as f64).sqrt()
    };
    (0..=last).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::{auto_regression, white};
    use crate::threads::given;

    /// Three scores of different correlation and size, in records of 40, 1 and 23 samples.
    fn scores() -> (DMatrix<f64>, Vec<Range<usize>>) {
        let columns = [(1, 0.8, 1.0), (2, -0.4, 1e3), (3, 0.0, 1e-3)];
        let columns = columns.map(|(seed, rho, size)| {
            auto_regression(seed, 64, rho)
                .into_iter()
                .map(move |x| size * x)
        });
        let values: Vec<f64> = columns.into_iter().flatten().collect();
        (
            DMatrix::from_vec(64, 3, values),
            vec![0..40, 40..41, 41..64],
        )
    }

    /// The kernel of the module comment.
    fn kappa(x: f64) -> f64 {
        let z = 6.0 * PI * x / 5.0;
        match x == 0.0 {
            true => 1.0,
            false => 25.0 / (12.0 * PI * PI * x * x) * (z.sin() / z - z.cos()),
        }
    }

    /// The kernel at a lag on a circle.
    fn on_circle(length: usize, bandwidth: f64, lag: usize) -> f64 {
        let each = window(length, bandwidth).into_iter().enumerate();
        let each = each.map(|(k, root)| {
            root * root * f64::cos(TAU * (k * lag % length) as f64 / length as f64)
        });
        each.sum()
    }

    /// Those of the next turns are at least 32 bandwidths away, where the kernel is below 2.1e-4 and changes its sign.
    #[test]
    fn the_window_is_that_of_the_kernel() {
        for (length, bandwidth) in [(128, 0.3), (128, 1.7), (320, 4.0), (4096, 50.0)] {
            for lag in (0..length / 2).step_by(7) {
                let found = on_circle(length, bandwidth, lag);
                let off = (found - kappa(lag as f64 / bandwidth)).abs();
                assert!(off <= 2.1e-4, "{length} {bandwidth} {lag}: {off}");
            }
        }
    }

    #[test]
    fn circles_are_short_and_even() {
        let long = 1 << 22;
        let least = [9, long, long + 1, 10_000_000, 13_000_000, 16_000_000];
        let lengths = [16, long, 5 << 20, 5 << 21, 7 << 21, 1 << 24];
        assert_eq!(least.map(length_of_circle), lengths);
    }

    /// The sum over all pairs with the kernel on the circle, for several bandwidths.
    #[test]
    fn the_sum_is_that_over_all_pairs() {
        let (scores, records) = scores();
        for (bandwidth, lengths) in [
            (0.0, [1, 1, 1]),
            (0.3, [128, 16, 64]),
            (4.0, [256, 256, 256]),
            (50.0, [2048, 2048, 2048]),
        ] {
            let found = kernel_sum(&scores, &records, bandwidth);
            let mut expected = DMatrix::zeros(3, 3);
            for (record, length) in records.iter().zip(lengths) {
                let kernel: Vec<f64> = match bandwidth == 0.0 {
                    true => (0..40).map(|lag| f64::from(lag == 0)).collect(),
                    false => {
                        let lags = 0..record.len();
                        lags.map(|l| on_circle(length, bandwidth, l)).collect()
                    }
                };
                for i in record.clone() {
                    for j in record.clone() {
                        let kappa = kernel[i.abs_diff(j)];
                        expected += kappa * scores.row(i).transpose() * scores.row(j);
                    }
                }
            }
            for a in 0..3 {
                for b in 0..3 {
                    let size = f64::sqrt(expected[(a, a)] * expected[(b, b)]);
                    let off = (found[(a, b)] - expected[(a, b)]).abs();
                    // Rounding of 64 terms and of transforms of lengths up to 2048.
                    assert!(off <= 1e-12 * size, "{bandwidth} {a} {b}: {off}");
                }
            }
            let smallest = found.clone().symmetric_eigenvalues().min();
            assert!(smallest >= -1e-12 * found.trace(), "{smallest}");
        }
    }

    /// With scores in other units the covariance is that in the other units, at the same bandwidth.
    #[test]
    fn the_covariance_transforms_with_the_units() {
        let (scores, records) = scores();
        let units = [1e6, 1e-2, 10.0];
        let other = DMatrix::from_fn(64, 3, |i, a| units[a] * scores[(i, a)]);
        let [here, there] =
            [&scores, &other].map(|s| KernelCovariance::of(s, &records, 3.0).expect("finite"));
        assert!((here.bandwidth / there.bandwidth - 1.0).abs() < 1e-12);
        for a in 0..3 {
            for b in 0..3 {
                let expected = here.sum[(a, b)] * units[a] * units[b];
                assert!(
                    (there.sum[(a, b)] - expected).abs()
                        <= 1e-12 * expected.abs().max(units[a] * units[b] * 1e-3)
                );
            }
        }
    }

    /// `sum_i s_i` of an autoregression with unit innovations has the variance `N/(1 - rho)^2`. At 20 000 samples the estimate
    /// has the relative standard deviation `sqrt(2 b/N)`, 4 % for rho = 0.5 and 8 % for 0.8, and a bias of less; the mean of 20 seeds
    /// is within 5 % and 10 %.
    #[test]
    fn the_variance_of_sums_of_autoregressions_is_found() {
        for (rho, within) in [(0.0, 0.02), (0.5, 0.05), (0.8, 0.1), (-0.5, 0.05)] {
            let expected = 20_000.0 / f64::powi(1.0 - rho, 2);
            let one = |seed| {
                let scores = DMatrix::from_vec(20_000, 1, auto_regression(seed, 20_000, rho));
                let whole = 0..20_000;
                let found = KernelCovariance::of(&scores, std::slice::from_ref(&whole), 0.0);
                found.expect("finite").sum[(0, 0)]
            };
            let mean = (0..20).map(one).sum::<f64>() / 20.0;
            assert!(
                (mean / expected - 1.0).abs() < within,
                "{rho}: {mean} {expected}"
            );
        }
    }

    /// The sum is that of one thread to the last bit, for an even and an odd number of scores.
    #[test]
    fn the_sum_does_not_depend_on_the_number_of_threads() {
        let values: Vec<f64> = (0..4)
            .flat_map(|seed| auto_regression(seed, 12_000, 0.6))
            .collect();
        for parameters in [2, 3] {
            let scores =
                DMatrix::from_column_slice(12_000, parameters, &values[..12_000 * parameters]);
            let whole = 0..12_000;
            let sum = || kernel_sum(&scores, std::slice::from_ref(&whole), 9.0);
            let [one, two] = [1, 2].map(|threads| given(threads, sum));
            assert!(one == two && one.trace() > 0.0);
        }
    }

    /// Products across records are omitted: equal scores in two records count as independent.
    #[test]
    fn records_are_independent() {
        let one = auto_regression(5, 300, 0.9);
        let twice = DMatrix::from_vec(600, 1, [one.clone(), one.clone()].concat());
        let bandwidth = 40.0;
        let whole = 0..300;
        let single = kernel_sum(
            &DMatrix::from_vec(300, 1, one),
            std::slice::from_ref(&whole),
            bandwidth,
        );
        let both = kernel_sum(&twice, &[0..300, 300..600], bandwidth);
        assert!((both[(0, 0)] / (2.0 * single[(0, 0)]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn scores_without_a_covariance_have_none() {
        let whole = 0..3;
        let records = std::slice::from_ref(&whole);
        let finite = DMatrix::from_vec(3, 1, white(1, 3));
        assert!(KernelCovariance::of(&finite, records, 3.0).is_none());
        assert!(KernelCovariance::of(&finite, records, 2.0).is_some());
        let infinite = DMatrix::from_vec(3, 1, vec![1.0, f64::NAN, 2.0]);
        assert!(KernelCovariance::of(&infinite, records, 1.0).is_none());
        let zero = KernelCovariance::of(&DMatrix::zeros(3, 1), records, 1.0).expect("finite");
        assert_eq!((zero.sum[(0, 0)], zero.bandwidth), (0.0, 0.0));
    }
}
