//! Butterworth filters as cascades of second-order sections, and zero-phase filtering.
//!
//! The coefficients of the sections are from the crate `biquad`: bilinear transforms of the
//! sections of the analogue filter, at exact cutoffs.

use std::f64::consts::PI;

use biquad::{Coefficients, Type};

/// Decay of the impulse response at the end of the padding.
const SETTLED: f64 = 1e-8;

/// A second-order section of a filter:
///
/// ```text
/// y_i = b0 x_i + b1 x_{i-1} + b2 x_{i-2} - a1 y_{i-1} - a2 y_{i-2}
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    /// `b0, b1, b2`.
    pub b: [f64; 3],
    /// `a1, a2`.
    pub a: [f64; 2],
}

impl SecondOrder {
    /// Gain of a constant.
    fn gain_of_constants(&self) -> f64 {
        self.b.iter().sum::<f64>() / (1.0 + self.a[0] + self.a[1])
    }

    /// Magnitude of the larger pole, the decay of the impulse response per sample.
    fn decay(&self) -> f64 {
        let [a1, a2] = self.a;
        let discriminant = a1 * a1 / 4.0 - a2;
        match discriminant < 0.0 {
            true => a2.sqrt(),
            false => a1.abs() / 2.0 + discriminant.sqrt(),
        }
    }

    fn apply(&self, values: &mut [f64]) {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        let (mut s1, mut s2) = (0.0, 0.0);
        for value in values {
            let x = *value;
            let y = b0 * x + s1;
            s1 = b1 * x - a1 * y + s2;
            s2 = b2 * x - a2 * y;
            *value = y;
        }
    }
}

/// A Butterworth low-pass filter: `|H(f)|² = 1/(1 + (tan(π f/rate)/tan(π cutoff/rate))^(2 order))`.
///
/// Low cutoffs lose digits with the square of cutoff/rate: the gain is accurate to about 1e-8 for a cutoff of 1e-4 of the rate.
///
/// `None` unless the order is at least 1 and the cutoff, in Hz, lies between zero and half of the
/// sampling rate, in Hz.
pub fn low_pass(order: usize, cutoff: f64, rate: f64) -> Option<Vec<SecondOrder>> {
    butterworth(order, cutoff, rate, Type::LowPass, first_order_low_pass)
}

/// A Butterworth high-pass filter: `|H(f)|² = 1/(1 + (tan(π cutoff/rate)/tan(π f/rate))^(2 order))`.
///
/// `None` as [`low_pass`].
pub fn high_pass(order: usize, cutoff: f64, rate: f64) -> Option<Vec<SecondOrder>> {
    let rest = |cutoff| first_order_low_pass(cutoff).map(complement);
    butterworth(order, cutoff, rate, Type::HighPass, rest)
}

/// A high-pass filter at `low` and a low-pass filter at `high`, both of this order, in series.
///
/// `None` unless `low < high`, or as [`low_pass`].
pub fn band_pass(order: usize, low: f64, high: f64, rate: f64) -> Option<Vec<SecondOrder>> {
    let mut sections = high_pass(order, low, rate)?;
    sections.extend(low_pass(order, high, rate)?);
    (low < high).then_some(sections)
}

/// Sections of a Butterworth filter: pairs of poles of quality `1/(2 sin((2 k + 1) π/(2 n)))`, and one first-order section for odd
/// order n.
fn butterworth(
    order: usize,
    cutoff: f64,
    rate: f64,
    kind: Type<f64>,
    first_order: impl Fn(f64) -> Option<SecondOrder>,
) -> Option<Vec<SecondOrder>> {
    // As a share of half the rate, as the crate requires.
    let cutoff = 2.0 * cutoff / rate;
    if order == 0 || !(rate > 0.0 && cutoff > 0.0 && cutoff < 1.0) {
        return None;
    }
    let mut sections = Vec::new();
    for k in 0..order / 2 {
        let angle = (2 * k + 1) as f64 * PI / (2 * order) as f64;
        let quality = 1.0 / (2.0 * angle.sin());
        sections.push(section(kind, cutoff, quality)?);
    }
    if order % 2 == 1 {
        sections.push(first_order(cutoff)?);
    }
    Some(sections)
}

fn section(kind: Type<f64>, cutoff: f64, quality: f64) -> Option<SecondOrder> {
    let found = Coefficients::from_normalized_params(kind, cutoff, quality).ok()?;
    Some(SecondOrder {
        b: [found.b0, found.b1, found.b2],
        a: [found.a1, found.a2],
    })
}

fn first_order_low_pass(cutoff: f64) -> Option<SecondOrder> {
    // A first-order section has no quality, but the crate requires a positive one.
    section(Type::SinglePoleLowPass, cutoff, 1.0)
}

/// Complement `1 - H` of a first-order section, which turns a low-pass into a high-pass.
fn complement(low: SecondOrder) -> SecondOrder {
    SecondOrder {
        b: [1.0 - low.b[0], low.a[0] - low.b[1], 0.0],
        a: low.a,
    }
}

/// Filters a series from rest, in place.
pub fn apply(sections: &[SecondOrder], values: &mut [f64]) {
    for section in sections {
        section.apply(values);
    }
}

/// Filters a series forward and then backward, from rest at both ends: zero phase, gain `|H|²`.
///
/// A linear map of the series, with zeros beyond both ends.
pub fn zero_phase(sections: &[SecondOrder], values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    for _ in 0..2 {
        apply(sections, &mut values);
        values.reverse();
    }
    values
}

/// Transpose of [`zero_phase`].
///
/// Filtering from rest, `H`, is a Toeplitz matrix; with the reversal `R`, filtering backward is `R H R = Hᵀ`. Hence `zero_phase` is
/// `Hᵀ H`, its own transpose.
pub fn zero_phase_transpose(sections: &[SecondOrder], values: &[f64]) -> Vec<f64> {
    zero_phase(sections, values)
}

/// [`zero_phase`] with padding, for the preparation of data: the series is extended at both ends by its reflection, `2 x_0 - x_i`,
/// until the impulse response has decayed to 1e-8 or by its own length, and both passes start in the steady state of the first value.
pub fn zero_phase_padded(sections: &[SecondOrder], values: &[f64]) -> Vec<f64> {
    let [first, .., last] = *values else {
        let gain: f64 = sections
            .iter()
            .map(SecondOrder::gain_of_constants)
            .product();
        return values.iter().map(|x| gain * gain * x).collect();
    };
    let n = values.len();
    let pad = settling(sections).min(n - 1);
    let before = values[1..=pad].iter().rev().map(|x| 2.0 * first - x);
    let after = values[n - 1 - pad..n - 1].iter().rev();
    let after = after.map(|x| 2.0 * last - x);
    let mut padded: Vec<f64> = before.chain(values.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        apply_from_constant(sections, &mut padded);
        padded.reverse();
    }
    padded[pad..pad + n].to_vec()
}

/// Filters from the steady state of the first value.
fn apply_from_constant(sections: &[SecondOrder], values: &mut [f64]) {
    for section in sections {
        let Some(&first) = values.first() else {
            return;
        };
        values.iter_mut().for_each(|x| *x -= first);
        section.apply(values);
        let level = section.gain_of_constants() * first;
        values.iter_mut().for_each(|x| *x += level);
    }
}

/// Number of samples after which the impulse response has decayed.
fn settling(sections: &[SecondOrder]) -> usize {
    let slowest = sections.iter().map(SecondOrder::decay).fold(0.0, f64::max);
    match slowest > 0.0 && slowest < 1.0 {
        true => (SETTLED.ln() / slowest.ln()).ceil() as usize,
        false => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Gain `|H(f)|` of a cascade, from its transfer function.
    fn gain(sections: &[SecondOrder], frequency: f64, rate: f64) -> f64 {
        let turn = TAU * frequency / rate;
        let at = |c0: f64, c1: f64, c2: f64| {
            let real = c0 + c1 * turn.cos() + c2 * (2.0 * turn).cos();
            let imaginary = c1 * turn.sin() + c2 * (2.0 * turn).sin();
            real.hypot(imaginary)
        };
        let gains = sections.iter().map(|s| {
            let [b0, b1, b2] = s.b;
            at(b0, b1, b2) / at(1.0, s.a[0], s.a[1])
        });
        gains.product()
    }

    /// Reproducible noise from a seed.
    fn noise(n: usize, mut state: u64) -> Vec<f64> {
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..n).map(|_| next()).collect()
    }

    #[test]
    fn gains_are_those_of_butterworth_filters() {
        let rate = 1000.0;
        for order in 1..=8 {
            for cutoff in [10.0, 120.0, 450.0] {
                let low = low_pass(order, cutoff, rate).unwrap();
                let high = high_pass(order, cutoff, rate).unwrap();
                assert_eq!(low.len(), order.div_ceil(2));
                for f in [1.0, 9.0, 10.0, 100.0, 130.0, 300.0, 460.0] {
                    let ratio = (PI * f / rate).tan() / (PI * cutoff / rate).tan();
                    let power = ratio.powi(2 * order as i32);
                    let (l, h) = (1.0 / (1.0 + power), power / (1.0 + power));
                    // Cancellation in 1 - cos of the cutoff loses about three digits at 10 Hz.
                    let near = |g: f64, p: f64| (g - p.sqrt()).abs() < 1e-10 * p.sqrt() + 1e-13;
                    assert!(near(gain(&low, f, rate), l), "low {order} {cutoff} {f}");
                    assert!(near(gain(&high, f, rate), h), "high {order} {cutoff} {f}");
                }
            }
        }
    }

    #[test]
    fn low_cutoffs_keep_constants() {
        let sections = low_pass(8, 1e-4, 1.0).unwrap();
        assert!((gain(&sections, 0.0, 1.0) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn a_band_pass_has_its_gain() {
        let band = band_pass(4, 10.0, 100.0, 1000.0).unwrap();
        assert!((gain(&band, 31.0, 1000.0) - 1.0).abs() < 1e-3);
        for edge in [10.0, 100.0] {
            assert!((gain(&band, edge, 1000.0) - 0.5_f64.sqrt()).abs() < 1e-3);
        }
        assert!(gain(&band, 1.0, 1000.0) < 1.1e-4);
        // (tan 18°/tan 72°)⁴.
        assert!(gain(&band, 400.0, 1000.0) < 1.3e-4);
    }

    #[test]
    fn invalid_filters_are_rejected() {
        assert_eq!(low_pass(0, 10.0, 100.0), None);
        for cutoff in [0.0, -1.0, 50.0, 60.0, f64::NAN, f64::INFINITY] {
            assert_eq!(low_pass(2, cutoff, 100.0), None, "{cutoff}");
            assert_eq!(high_pass(3, cutoff, 100.0), None, "{cutoff}");
        }
        assert_eq!(low_pass(2, 10.0, -100.0), None);
        assert_eq!(band_pass(2, 20.0, 10.0, 100.0), None);
    }

    #[test]
    fn tones_have_the_gain_and_zero_phase() {
        let rate = 200.0;
        let filter = low_pass(4, 12.0, rate).unwrap();
        let tone: Vec<f64> = (0..2000)
            .map(|i| (TAU * 10.0 * f64::from(i) / rate).sin())
            .collect();
        let filtered = zero_phase(&filter, &tone);
        let expected = gain(&filter, 10.0, rate).powi(2);
        // In the middle, 500 samples from the ends: the slowest pole decays by a factor 0.87 per sample.
        for i in 500..1500 {
            assert!((filtered[i] - expected * tone[i]).abs() < 1e-12);
        }
    }

    #[test]
    fn zero_phase_is_its_own_transpose() {
        let (x, y) = (noise(300, 1), noise(300, 2));
        for filter in [
            low_pass(8, 8.0, 100.0).unwrap(),
            high_pass(3, 5.0, 100.0).unwrap(),
            band_pass(4, 2.0, 30.0, 100.0).unwrap(),
        ] {
            let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
            let (fx, ty) = (zero_phase(&filter, &x), zero_phase_transpose(&filter, &y));
            let scale = dot(&fx, &fx).sqrt() * dot(&y, &y).sqrt();
            // Sums of 300 terms, filtered by poles near the unit circle.
            assert!((dot(&fx, &y) - dot(&x, &ty)).abs() < 1e-13 * scale);
            let sum: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 2.0 * x - 3.0 * y).collect();
            let (fsum, fy) = (zero_phase(&filter, &sum), zero_phase(&filter, &y));
            for i in 0..300 {
                assert!((fsum[i] - (2.0 * fx[i] - 3.0 * fy[i])).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn padding_preserves_lines_and_removes_constants() {
        let line: Vec<f64> = (0..400).map(|i| 5.0 + 0.1 * f64::from(i)).collect();
        let low = zero_phase_padded(&low_pass(4, 10.0, 100.0).unwrap(), &line);
        // The reflected line is the same line; the far end of the padding starts from rest.
        for (filtered, x) in low.iter().zip(&line) {
            assert!((filtered - x).abs() < 1e-6, "{filtered} {x}");
        }
        let high = high_pass(4, 10.0, 100.0).unwrap();
        for x in zero_phase_padded(&high, &[7.0; 50]) {
            assert!(x.abs() < 1e-12);
        }
        assert_eq!(zero_phase_padded(&high, &[]), Vec::<f64>::new());
        assert!(zero_phase_padded(&high, &[7.0])[0].abs() < 1e-12);
        assert_eq!(zero_phase_padded(&high, &[1.0, 2.0]).len(), 2);
    }
}
