//! Spectra of equally spaced series.

use super::fourier::{RealTransform, Turns};
use super::median;

/// Ratio to the mean that one density of white noise in twenty thousand exceeds.
const ABOVE_NOISE: f64 = 10.0;
/// Smallest share of the energy of a response above noise; noise alone has 1 part in 2000.
const STANDS_OUT: f64 = 0.02;
/// Smallest number of values for a spectrum.
const FEWEST: usize = 4;

/// One-sided periodogram of an equally spaced series, without its mean, with a Hann window.
///
/// With the window `w_j = (1 - cos(2π j/n))/2` and spacing h, the power spectral density at `f_k = k/(n h)`,
/// `0 <= k <= n/2`, is
///
/// ```text
/// S_k = c h |sum_j w_j (x_j - mean) exp(-2π i j k/n)|² / sum_j w_j²
/// ```
///
/// in the squared unit of the series per Hz, with c = 1 at zero and at half the sampling rate and 2 elsewhere; the sum of `S_k/(n h)`
/// is the variance of a stationary series. The transform does not depend on the instruction set of the processor.
///
/// ```
/// use kmcfit_core::signal::Spectrum;
/// let series: Vec<f64> = (0..500).map(|i| (0.3 * f64::from(i)).sin()).collect();
/// let spectrum = Spectrum::of(&series, 0.01).expect("it varies");
/// let frequency = 0.3 / (0.01 * std::f64::consts::TAU);
/// assert!((spectrum.dominant() - frequency).abs() < 0.02 * spectrum.resolution());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    resolution: f64,
    density: Vec<f64>,
}

/// The Hann window `w_j = (1 - cos(2π j/n))/2`.
pub(super) fn hann_window(n: usize) -> Vec<f64> {
    let turns = Turns::new(n, n);
    (0..n).map(|j| hann(&turns, j)).collect()
}

/// `w_j` of [`hann_window`].
fn hann(turns: &Turns, j: usize) -> f64 {
    0.5 - 0.5 * turns.at(j).re
}

impl Spectrum {
    /// Computes the spectrum of values that are `spacing` seconds apart.
    ///
    /// `None` if there are fewer than four values, one is not finite, all are equal, or the spacing is not positive.
    pub fn of(values: &[f64], spacing: f64) -> Option<Self> {
        let n = values.len();
        let varies = values.iter().any(|x| *x != values[0]);
        let finite = values.iter().all(|x| x.is_finite());
        let spaced = spacing > 0.0 && spacing.is_finite();
        if n < FEWEST || !varies || !finite || !spaced {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let turns = Turns::new(n, n);
        let mut squares = 0.0;
        let windowed = values.iter().enumerate();
        let windowed = windowed.map(|(j, x)| {
            let weight = hann(&turns, j);
            squares += weight * weight;
            weight * (x - mean)
        });
        let count = n / 2 + 1;
        let mut density = Vec::with_capacity(count);
        RealTransform::new(n, count).process(windowed, |k, x| {
            let sides = if k == 0 || 2 * k == n { 1.0 } else { 2.0 };
            density.push(sides * spacing * x.norm_sqr());
        });
        density.iter_mut().for_each(|d| *d /= squares);
        let whole: f64 = density.iter().sum();
        (whole > 0.0 && whole.is_finite()).then(|| Self {
            resolution: 1.0 / (n as f64 * spacing),
            density,
        })
    }

    /// Mean of the spectra of `parts` parts and of those half a part later (Welch 1967); `None` as for [`of`](Self::of).
    pub(super) fn mean(values: &[f64], spacing: f64, parts: usize) -> Option<Self> {
        let half = values.len() / parts / 2;
        let mut starts = (0..2 * parts - 1).map(|i| &values[i * half..(i + 2) * half]);
        let mut mean = Self::of(starts.next()?, spacing)?;
        for part in starts {
            let density = Self::of(part, spacing)?.density;
            (mean.density.iter_mut().zip(density)).for_each(|(sum, d)| *sum += d);
        }
        let count = (2 * parts - 1) as f64;
        mean.density.iter_mut().for_each(|d| *d /= count);
        Some(mean)
    }

    /// Frequency spacing, Hz.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Frequencies from zero, Hz.
    pub fn frequencies(&self) -> impl Iterator<Item = f64> {
        (0..self.density.len()).map(|k| k as f64 * self.resolution)
    }

    /// Power spectral densities at the frequencies, squared unit per Hz.
    pub fn density(&self) -> &[f64] {
        &self.density
    }

    /// Frequency of the highest peak, Hz, from the parabola through the logarithms of the highest value and its neighbours. The error for
    /// a tone is below 0.02 of the frequency spacing, if its frequency is at least three spacings away from zero and half the sampling rate.
    pub fn dominant(&self) -> f64 {
        let mut peak = 1;
        for (k, density) in self.density.iter().enumerate().skip(2) {
            if *density > self.density[peak] {
                peak = k;
            }
        }
        (peak as f64 + self.off_centre(peak)) * self.resolution
    }

    /// Frequency band, in Hz, that contains this share of the energy, with equal parts of the rest below and above: `band(0.999)`
    /// excludes 0.05 % at either end.
    pub fn band(&self, share: f64) -> [f64; 2] {
        let rest = 0.5 * (1.0 - share.clamp(0.0, 1.0));
        [self.energy_quantile(rest), self.energy_quantile(1.0 - rest)]
    }

    /// Frequency, in Hz, below which the share `q` of the energy lies, `0 <= q <= 1`; the energy of each frequency is distributed evenly
    /// over one frequency spacing.
    pub fn energy_quantile(&self, q: f64) -> f64 {
        let last = self.density.len() - 1;
        let mut left = q.clamp(0.0, 1.0) * self.density.iter().sum::<f64>();
        for (k, density) in self.density.iter().enumerate() {
            if left <= *density && *density > 0.0 {
                let position = (k as f64 - 0.5 + left / density).clamp(0.0, last as f64);
                return position * self.resolution;
            }
            left -= density;
        }
        last as f64 * self.resolution
    }

    /// Spectrum without white noise: densities below ten times the noise floor are set to zero. The floor is the mean of the exponential
    /// distribution of noise densities with the median of all densities. The spectrum is unchanged where almost nothing exceeds the noise:
    /// for noise alone, or a response that fills half of the frequencies.
    ///
    /// ```
    /// use kmcfit_core::signal::Spectrum;
    /// let noise = |i: i64| 1e-2 * ((i * i * 7919) % 1009 - 504) as f64 / 291.0;
    /// let decay = |i: i64| (-0.01 * i as f64).exp() * (0.3 * i as f64).cos();
    /// let series: Vec<f64> = (0..2000).map(|i| decay(i) + noise(i)).collect();
    /// let spectrum = Spectrum::of(&series, 0.01).expect("it varies");
    /// let frequency = 0.3 / (0.01 * std::f64::consts::TAU);
    /// assert!(spectrum.energy_quantile(0.9) > 3.0 * frequency);
    /// assert!(spectrum.without_noise().energy_quantile(0.999) < 1.2 * frequency);
    /// ```
    pub fn without_noise(&self) -> Self {
        let floor = median(&*self.density) / std::f64::consts::LN_2;
        let kept = |density: &f64| {
            if *density > ABOVE_NOISE * floor {
                *density
            } else {
                0.0
            }
        };
        let density: Vec<f64> = self.density.iter().map(kept).collect();
        let energy = |density: &[f64]| density.iter().sum::<f64>();
        match energy(&density) >= STANDS_OUT * energy(&self.density) {
            true => Self { density, ..*self },
            false => self.clone(),
        }
    }

    /// Offset of the peak from the highest value, in frequency spacings, from -1/2 to 1/2.
    fn off_centre(&self, peak: usize) -> f64 {
        let Some(&[left, top, right]) = self
            .density
            .get(peak - 1..peak + 2)
            .and_then(|d| d.first_chunk())
        else {
            return 0.0;
        };
        let (left, top, right) = (left.ln(), top.ln(), right.ln());
        let off = 0.5 * (left - right) / (left - 2.0 * top + right);
        match off.is_finite() {
            true => off.clamp(-0.5, 0.5),
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn tones(n: usize, spacing: f64, tones: &[(f64, f64)]) -> Vec<f64> {
        let at = |t: f64| -> f64 {
            tones
                .iter()
                .map(|(a, f)| a * (TAU * f * t + 0.7).sin())
                .sum()
        };
        (0..n).map(|i| 3.0 + at(i as f64 * spacing)).collect()
    }

    #[test]
    fn the_dominant_frequency_is_accurate_between_the_lines() {
        let (n, spacing) = (600, 0.01);
        let mut worst: f64 = 0.0;
        for i in 0..500 {
            // From three resolutions to half the rate less as many.
            let frequency = 0.5 + f64::from(i) * 0.098;
            let spectrum = Spectrum::of(&tones(n, spacing, &[(1.0, frequency)]), spacing).unwrap();
            let error = (spectrum.dominant() - frequency).abs() / spectrum.resolution();
            worst = worst.max(error);
        }
        assert!(worst < 0.02, "{worst}");
    }

    #[test]
    fn the_density_sums_to_the_variance() {
        for n in [1000, 1001, 997] {
            let values = tones(n, 0.01, &[(2.0, 10.0), (1.0, 31.0)]);
            let spectrum = Spectrum::of(&values, 0.01).unwrap();
            let energy: f64 = spectrum.density().iter().sum::<f64>() * spectrum.resolution();
            // 2²/2 + 1²/2, except for incomplete periods.
            assert!((energy - 2.5).abs() < 2e-3, "{n} {energy}");
            assert_eq!(spectrum.frequencies().count(), spectrum.density().len());
        }
    }

    #[test]
    fn bands_contain_the_energy() {
        let spacing = 0.01;
        let values = tones(2000, spacing, &[(1.0, 5.0), (1.0, 20.0)]);
        let spectrum = Spectrum::of(&values, spacing).unwrap();
        // A tone with a Hann window is four frequency spacings wide.
        let width = 2.0 * spectrum.resolution();
        let [low, high] = spectrum.band(0.999);
        assert!(
            (low - 5.0).abs() < width && (high - 20.0).abs() < width,
            "{low} {high}"
        );
        assert!((spectrum.energy_quantile(0.25) - 5.0).abs() < width);
        assert!((spectrum.energy_quantile(0.75) - 20.0).abs() < width);
        assert_eq!(spectrum.energy_quantile(0.0), 0.0);
        assert!(spectrum.energy_quantile(1.0) <= 50.0);
        assert!(spectrum.energy_quantile(0.3) <= spectrum.energy_quantile(0.31));
    }

    #[test]
    fn invalid_series_are_rejected() {
        assert_eq!(Spectrum::of(&[], 0.1), None);
        assert_eq!(Spectrum::of(&[1.0, 2.0, 3.0], 0.1), None);
        assert_eq!(Spectrum::of(&[1.0; 10], 0.1), None);
        assert_eq!(Spectrum::of(&[1.0, 2.0, f64::NAN, 1.0], 0.1), None);
        assert_eq!(Spectrum::of(&[1.0, 2.0, 3.0, 1.0], 0.0), None);
        let short = Spectrum::of(&[1.0, 2.0, 3.0, 1.0], 0.1).unwrap();
        assert!(short.dominant().is_finite());
        assert!(short.band(2.0).iter().all(|f| f.is_finite()));
    }
}
