//! Bump functions of the weak form, and averages of series by them.
//!
//! A bump function is `(1 - s^2)^3`, `|s| < 1`, divided by its sum over the samples. It and its first two derivatives vanish at its
//! ends, or nearly so, and therefore the averages of differences of a series are averages of the series itself by the differences of
//! the bump function: the derivatives of a response are moved to the bump functions by parts (Shinbrot 1957).

use std::ops::Range;

/// Bump functions per half length: neighbours overlap by three quarters.
const OVERLAP: usize = 2;

/// The bump functions of a record, all of one length and with centres at equal distances.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bumps {
    /// Weights of the samples of a bump function, of the sum 1.
    weights: Vec<f64>,
    /// First sample of each bump function.
    firsts: Vec<usize>,
    /// Samples between centres.
    stride: usize,
}

impl Bumps {
    /// Bump functions of `2 half + 1` samples within each of the `runs` of equally spaced samples.
    pub fn of(runs: &[Range<usize>], half: usize) -> Self {
        let bumps: Vec<f64> = (0..=2 * half).map(|k| bump(k, half)).collect();
        let sum: f64 = bumps.iter().sum();
        let stride = (half / OVERLAP).max(1);
        let firsts = runs.iter().flat_map(|run| {
            let end = (run.end + 1).saturating_sub(bumps.len());
            (run.start..end).step_by(stride)
        });
        Self {
            firsts: firsts.collect(),
            weights: bumps.iter().map(|b| b / sum).collect(),
            stride,
        }
    }

    /// Number of bump functions.
    pub fn count(&self) -> usize {
        self.firsts.len()
    }

    /// Samples between centres.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Samples of a bump function.
    pub fn length(&self) -> usize {
        self.weights.len()
    }

    /// Samples of bump function `i` with their weights.
    pub fn samples(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = self.firsts[i];
        (first..).zip(self.weights.iter().copied())
    }

    /// Average of a series by each bump function.
    pub fn average(&self, series: &[f64]) -> Vec<f64> {
        let one = |i| self.samples(i).map(|(k, weight)| weight * series[k]).sum();
        (0..self.count()).map(one).collect()
    }

    /// Transpose of [`Bumps::average`]: values of the bump functions, distributed to `samples` samples.
    pub fn spread(&self, values: &[f64], samples: usize) -> Vec<f64> {
        let mut spread = vec![0.0; samples];
        for (i, value) in values.iter().enumerate() {
            for (k, weight) in self.samples(i) {
                spread[k] += weight * value;
            }
        }
        spread
    }
}

/// Bump function at sample `k` of `2 half + 1`.
fn bump(k: usize, half: usize) -> f64 {
    let s = (k as f64 - half as f64) / (half as f64 + 1.0);
    (1.0 - s * s).powi(3)
}

/// Integral of the square of derivative `order` (0, 1 or 2) of a bump function of unit integral and half length 1. With the half
/// length `L` the integral is this divided by `L^(2 order + 1)`: the variance per `sigma^2 h` of the average of a derivative of samples
/// `h` apart with white noise `sigma`.
pub(super) fn noise_gain(order: usize) -> f64 {
    // Integrals over the bump function, its derivative and its second derivative, by their polynomials; its own is 32/35.
    let square = [2048.0 / 3003.0, 1024.0 / 385.0, 1024.0 / 35.0][order];
    square / (32.0f64 / 35.0).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs of samples too short for a bump function have none; the others lie within their runs.
    #[test]
    fn bump_functions_lie_within_their_runs() {
        let bumps = Bumps::of(&[0..20, 20..24, 30..37], 3);
        assert_eq!(bumps.length(), 7);
        assert_eq!(bumps.stride(), 1);
        assert_eq!(bumps.count(), 14 + 1);
        assert_eq!(bumps.samples(14).map(|(k, _)| k).min(), Some(30));
        assert_eq!(Bumps::of(std::slice::from_ref(&(0..4)), 4).count(), 0);
    }

    /// Averages of a constant are the constant; spreading is the transpose of averaging.
    #[test]
    fn averages_and_their_transpose() {
        let bumps = Bumps::of(std::slice::from_ref(&(2..60)), 9);
        let ones = bumps.average(&[1.0; 60]);
        assert!(ones.iter().all(|one| (one - 1.0).abs() < 1e-14));
        let series: Vec<f64> = (0..60).map(|i| f64::from(i).sin()).collect();
        let values: Vec<f64> = (0..bumps.count()).map(|i| (1.7 * i as f64).cos()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (left, right) = (
            dot(&bumps.average(&series), &values),
            dot(&series, &bumps.spread(&values, 60)),
        );
        assert!((left - right).abs() < 1e-13, "{left} {right}");
    }

    /// The variance of averaged differences of white noise against the integrals of the squared derivatives.
    #[test]
    fn noise_gains_are_those_of_long_bump_functions() {
        let half = 400;
        let bumps = Bumps::of(std::slice::from_ref(&(0..2 * half + 1)), half);
        let mut weights: Vec<f64> = bumps.samples(0).map(|(_, w)| w).collect();
        for order in 0..3 {
            let sum: f64 = weights.iter().map(|w| w * w).sum();
            let expected = noise_gain(order) / (half as f64).powi(2 * order as i32 + 1);
            // The sum has an error of one over the number of samples.
            assert!(
                (sum / expected - 1.0).abs() < 0.02,
                "{order}: {sum} {expected}"
            );
            let padded: Vec<f64> = [&[0.0][..], &weights, &[0.0]].concat();
            weights = padded.windows(2).map(|w| w[1] - w[0]).collect();
        }
    }
}
