//! State estimation from an equally spaced acceleration: displacement, velocity and acceleration in a frequency band.
//!
//! An acceleration is integrated twice by the curve that minimises
//!
//! ```text
//! sum_i [(y_{i-1} - 2 y_i + y_{i+1})/h^2 - (a_{i-1} + 10 a_i + a_{i+1})/12]^2 + w_c^4 sum_i y_i^2
//! ```
//!
//! so `y` is the second integral of `a` filtered by `H(w) = w^4/(w^4 + w_c^4)`, which has zero phase. Numerov's relation in
//! the brackets is fourth-order accurate; second differences would bias a stiffness by `(w h)^2/12`. Velocity and
//! acceleration follow from `y` by relations of the same order, so that all three have passed the same filter:
//! `m a + c v + k y = f` then holds for the filtered force `f` wherever the coefficients vary slowly over the time `1/w_c`.

use crate::qp::Subproblem;
use crate::simd::sum::rms;
use std::f64::consts::PI;

/// Corner frequency of the filter as a share of the dominant frequency.
const CORNER: f64 = 0.5;
/// Rounds of the search for the dominant frequency.
const ROUNDS: usize = 3;
/// Smallest number of samples.
const FEWEST: usize = 8;

/// Frequency band of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassBand {
    /// Dominant frequency: root-mean-square velocity over root-mean-square displacement, rad/s.
    pub frequency: f64,
    /// Spacing of the samples, s.
    spacing: f64,
}

/// A filtered series and its integrals, at all samples but the first and the last.
#[derive(Debug, Clone, PartialEq)]
pub struct InBand {
    /// Second integral.
    pub y: Vec<f64>,
    /// First integral.
    pub v: Vec<f64>,
    /// Filtered series.
    pub a: Vec<f64>,
}

impl PassBand {
    /// Band of a response with these accelerations, `spacing` seconds apart; `None` if there are too few, or they do not
    /// oscillate.
    ///
    /// The search starts from the zero crossings of the acceleration.
    pub fn of(accelerations: &[f64], spacing: f64) -> Option<Self> {
        let n = accelerations.len();
        if n < FEWEST {
            return None;
        }
        let signs: Vec<bool> = (centred(accelerations).iter())
            .map(|a| a.is_sign_negative())
            .collect();
        let crossings = signs.windows(2).filter(|s| s[0] != s[1]).count();
        let mut frequency = PI * crossings as f64 / (n as f64 * spacing);
        for _ in 0..ROUNDS {
            let band = Self { frequency, spacing }.oscillating()?;
            let response = band.responses(&[accelerations])?.pop()?;
            frequency = rms(&response.v) / rms(&response.y);
        }
        Self { frequency, spacing }.oscillating()
    }

    fn oscillating(self) -> Option<Self> {
        (self.frequency > 0.0 && self.frequency.is_finite()).then_some(self)
    }

    /// Corner of the filter, rad/s.
    pub fn corner(&self) -> f64 {
        CORNER * self.frequency
    }

    /// Filters each series, without its mean, and integrates it; `None` if the computation fails.
    pub fn responses(&self, series: &[&[f64]]) -> Option<Vec<InBand>> {
        let n = series.first()?.len();
        let h = self.spacing;
        let mut sub = Subproblem::new(n);
        sub.elimination_order = (0..n as u32).collect();
        for i in 1..n - 1 {
            sub.residuals
                .push([(i - 1, 1.0), (i, -2.0), (i + 1, 1.0)], 0.0);
        }
        let ridge = (self.corner() * h).powi(2);
        (0..n).for_each(|i| sub.residuals.push([(i, ridge)], 0.0));
        let target = |a: &&[f64]| -> Vec<f64> {
            let means = centred(a);
            let means = means
                .windows(3)
                .map(|w| h * h * (w[0] + 10.0 * w[1] + w[2]) / 12.0);
            means.chain(std::iter::repeat_n(0.0, n)).collect()
        };
        let targets: Vec<Vec<f64>> = series.iter().map(target).collect();
        let curves = sub.solve_equality_constrained_for(&targets)?;
        Some(curves.iter().map(|y| self.derivatives(y)).collect())
    }

    fn derivatives(&self, y: &[f64]) -> InBand {
        let h = self.spacing;
        let a = numerov(y, h);
        let slope = |(y, a): (&[f64], &[f64])| (y[2] - y[0]) / (2.0 * h) - h / 12.0 * (a[2] - a[0]);
        InBand {
            v: y.windows(3).zip(a.windows(3)).map(slope).collect(),
            y: y[1..y.len() - 1].to_vec(),
            a: a[1..a.len() - 1].to_vec(),
        }
    }
}

fn centred(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
    series.iter().map(|x| x - mean).collect()
}

/// Second derivative `a` of `y` with `(a_{i-1} + 10 a_i + a_{i+1})/12 = (y_{i-1} - 2 y_i + y_{i+1})/h^2`, zero at both
/// ends.
fn numerov(y: &[f64], h: f64) -> Vec<f64> {
    let mut a = vec![0.0; y.len()];
    // Forward elimination; the matrix is diagonally dominant.
    let mut pivots = vec![10.0; y.len()];
    for i in 1..y.len() - 1 {
        let right = 12.0 * (y[i - 1] - 2.0 * y[i] + y[i + 1]) / (h * h);
        if i > 1 {
            pivots[i] = 10.0 - 1.0 / pivots[i - 1];
            a[i] = right - a[i - 1] / pivots[i - 1];
        } else {
            a[i] = right;
        }
    }
    for i in (1..y.len() - 1).rev() {
        a[i] = (a[i] - a[i + 1]) / pivots[i];
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the middle of the record, a long sine is multiplied by the frequency response of the filter.
    #[test]
    fn a_sine_is_multiplied_by_the_frequency_response_of_the_filter() {
        let (w, h) = (2.0 * PI * 3.0, 0.01);
        let acceleration: Vec<f64> = (0..4000).map(|i| (w * h * f64::from(i)).sin()).collect();
        let band = PassBand::of(&acceleration, h).expect("it oscillates");
        // End effects are 2e-3.
        assert!(
            (band.frequency / w - 1.0).abs() < 5e-3,
            "{}",
            band.frequency
        );
        let response = band.responses(&[&acceleration]).unwrap().pop().unwrap();
        // Frequency response of the filter with differences for derivatives, for all three series.
        let square = (2.0 / h * (0.5 * w * h).sin()).powi(2);
        let filter_response = 1.0 / (1.0 + band.corner().powi(4) / square.powi(2));
        for i in 1900..2100 {
            let t = h * (i + 1) as f64;
            let (sine, cosine) = (w * t).sin_cos();
            for (found, expected) in [
                (response.a[i], filter_response * sine),
                (response.v[i] * w, -filter_response * cosine),
                (response.y[i] * w * w, -filter_response * sine),
            ] {
                // (w h)^4/240 = 5e-6.
                assert!((found - expected).abs() < 2e-5, "{i}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_series_without_oscillation_has_no_band() {
        assert_eq!(PassBand::of(&[1.0; 50], 0.1), None);
        assert_eq!(PassBand::of(&[1.0, -1.0, 1.0], 0.1), None);
    }
}
