//! Modes of vibration in a response without a measured input, from its spectrum.

use super::Spectrum;
use super::median;
use crate::diagnostics::standard_deviation;

/// Fewest values of a record.
const FEWEST: usize = 256;
/// Fewest frequency spacings below the lower peak and between the two: drift, and the width of a window.
const APART: usize = 8;
/// Smallest energy of the weaker mode, relative to that of the stronger one.
const WEAKEST: f64 = 0.02;
/// Largest mean density of four neighbours at the lowest place between two modes, relative to the lower peak. A frequency that varies leaves
/// ripples that are less deep.
const DEEPEST: f64 = 0.05;
/// Smallest ratio of a peak to the noise floor.
const ABOVE_FLOOR: f64 = 100.0;
/// Half the width of a peak, relative to its frequency.
const WIDTH: f64 = 0.1;
/// Ratios of frequencies that nonlinear terms cause, and the distance within which a ratio is one of them.
const HARMONICS: [f64; 4] = [2.0, 3.0, 4.0, 5.0];
const HARMONIC: f64 = 0.05;

/// Parts of a record whose sizes are compared, and the fewest periods in a part.
const PARTS: usize = 16;
const PERIODS: usize = 2;
/// Size of the last quarter of a record relative to the first from which on it is no decay.
const KEPT: f64 = 0.5;
/// Smallest ratio of the mean density about the peak of a resonance to the median density.
const RESONANT: f64 = 10.0;
/// Ratio of the sizes of two parts from which on one is larger than the other.
const LARGER: f64 = 1.2;
/// Half the width of a line under the window, in frequency spacings, and the share of the energy from which on lines explain it.
const LINE: usize = 2;
const LINES: f64 = 0.75;

/// True for a response that a random force keeps up: it does not decay, its size falls and rises again from part to part, and the one or two
/// lines of slow decays do not explain its spectrum within half an octave of the peak. Responses of fewer than 32 periods are not judged.
pub fn is_kept_up(values: &[f64], spacing: f64) -> bool {
    let quarter = values.len() / 4;
    if quarter < PARTS {
        return false;
    }
    let size = |part: &[f64]| standard_deviation(part);
    if size(&values[values.len() - quarter..]) < KEPT * size(&values[..quarter]) {
        return false;
    }
    let sizes: Vec<f64> = (values.chunks_exact(values.len() / PARTS).take(PARTS))
        .map(size)
        .collect();
    let changes = |is_change: &dyn Fn(f64, f64) -> bool| {
        (1..PARTS).any(|i| sizes[..i].iter().any(|before| is_change(*before, sizes[i])))
    };
    if !changes(&|a, b| b > LARGER * a) || !changes(&|a, b| a > LARGER * b) {
        return false;
    }
    let Some(spectrum) = Spectrum::of(values, spacing) else {
        return false;
    };
    let density = spectrum.density();
    let highest = |bins: &[f64]| (0..bins.len()).max_by(|a, b| bins[*a].total_cmp(&bins[*b]));
    let Some(peak) = highest(density).filter(|peak| *peak >= PARTS * PERIODS) else {
        return false;
    };
    // Noise alone has no resonance.
    let width = (WIDTH * peak as f64) as usize;
    let around = &density[peak - width..(peak + width + 1).min(density.len())];
    if around.iter().sum::<f64>() < RESONANT * median(density) * around.len() as f64 {
        return false;
    }
    let octave = [0.5f64.sqrt(), 2f64.sqrt()].map(|factor| (factor * peak as f64) as usize);
    let mut near = density[octave[0]..octave[1].min(density.len())].to_vec();
    let all: f64 = near.iter().sum();
    for _ in 0..2 {
        let top = highest(&near).unwrap_or_default();
        let end = (top + LINE + 1).min(near.len());
        near[top.saturating_sub(LINE)..end].fill(0.0);
    }
    near.iter().sum::<f64>() > (1.0 - LINES) * all
}

/// Frequencies (Hz) of two modes in the earlier half of a free response with samples `spacing` seconds apart, the stronger one first;
/// `None` where there is one mode or the response is too short. A frequency that varies in time, and harmonics, are no modes. One that a random
/// force keeps up has many peaks: there the mean spectrum of its parts counts.
pub fn two_modes(values: &[f64], spacing: f64) -> Option<[f64; 2]> {
    let spectrum = match is_kept_up(values, spacing) {
        true => Spectrum::mean(values, spacing, PARTS),
        false => Spectrum::of(&values[..values.len() / 2], spacing),
    }?;
    let density = spectrum.density();
    (density.len() >= FEWEST / 4).then_some(())?;
    let floor = median(density);
    let highest = |bins: &mut dyn Iterator<Item = usize>| {
        bins.max_by(|a, b| density[*a].total_cmp(&density[*b]))
    };
    let around = |peak: usize| {
        let width = ((WIDTH * peak as f64) as usize).max(APART / 2);
        peak.saturating_sub(width)..(peak + width + 1).min(density.len())
    };
    let energy = |peak: usize| density[around(peak)].iter().sum::<f64>();
    let first = highest(&mut (APART..density.len()))?;
    let is_apart = |k: &usize| k.abs_diff(first) >= APART && !around(first).contains(k);
    let second = highest(&mut (APART..density.len()).filter(is_apart))?;
    let [low, high] = [first.min(second), first.max(second)];
    let least = density[first].min(density[second]);
    let between = density[low..=high].windows(4);
    let between = between
        .map(|w| w.iter().sum::<f64>() / 4.0)
        .fold(f64::INFINITY, f64::min);
    let ratio = high as f64 / low as f64;
    let is_harmonic = HARMONICS.iter().any(|q| (ratio - q).abs() < HARMONIC * q);
    let is_mode = density[second] > ABOVE_FLOOR * floor
        && energy(second) > WEAKEST * energy(first)
        && between < DEEPEST * least
        && !is_harmonic;
    is_mode.then(|| [first, second].map(|k| k as f64 * spectrum.resolution()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const SPACING: f64 = 0.01;

    fn series(response: impl Fn(f64) -> f64) -> Vec<f64> {
        let noise = |i: i64| ((i * i * 7919) % 1009 - 504) as f64 / 291.0;
        (0..4000)
            .map(|i| response(SPACING * i as f64) + 1e-3 * noise(i))
            .collect()
    }

    #[test]
    fn two_decaying_modes_are_found() {
        let both =
            series(|t| (-0.1 * t).exp() * ((TAU * 2.0 * t).cos() + 0.5 * (TAU * 3.3 * t).cos()));
        let [first, second] = two_modes(&both, SPACING).expect("two modes");
        // The frequency spacing is 0.05 Hz.
        assert!(
            (first - 2.0).abs() < 0.03 && (second - 3.3).abs() < 0.03,
            "{first} {second}"
        );
    }

    /// One mode, a frequency that rises by a half, and a spring that hardens, with a third harmonic.
    #[test]
    fn a_mode_that_varies_and_harmonics_are_one_mode() {
        let one = series(|t| (-0.1 * t).exp() * (TAU * 2.0 * t).cos());
        let rising = series(|t| (TAU * (2.0 * t + 0.0125 * t * t)).cos());
        let hardening = series(|t| {
            let phase = TAU * 2.0 * t;
            phase.cos() + 0.3 * (3.0 * phase).cos()
        });
        for (name, values) in [("one", one), ("rising", rising), ("hardening", hardening)] {
            assert_eq!(two_modes(&values, SPACING), None, "{name}");
        }
    }

    /// Slow decays, beats, growing and rising ones are no random motion; the response of an oscillator to pseudorandom kicks is.
    #[test]
    fn a_random_force_keeps_a_response_up() {
        let free = [
            series(|t| (-0.01 * t).exp() * (TAU * 2.0 * t).cos()),
            series(|t| (-0.01 * t).exp() * ((TAU * 2.0 * t).cos() + 0.6 * (TAU * 2.2 * t).cos())),
            series(|t| (0.05 * t).exp() * (TAU * 2.0 * t).cos()),
            series(|t| (-0.01 * t).exp() * (TAU * (2.0 * t + 0.0125 * t * t)).cos()),
        ];
        for (i, values) in free.iter().enumerate() {
            assert!(!is_kept_up(values, SPACING), "{i}");
        }
        let mut random = 12_345_u64;
        let (mut y, mut v) = (0.0, 0.0);
        let mut kicked = || {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            v += (random >> 40) as f64 / 16_777_216.0 - 0.5;
            v -= SPACING * (0.5 * v + (TAU * 2.0).powi(2) * y);
            y += SPACING * v;
            y
        };
        let values: Vec<f64> = (0..20_000).map(|_| kicked()).collect();
        let noise: Vec<f64> = values
            .windows(2)
            .map(|y| (1e6 * (y[1] - y[0])).fract())
            .collect();
        assert!(!is_kept_up(&noise, SPACING));
        assert!(is_kept_up(&values, SPACING));
        assert_eq!(two_modes(&values, SPACING), None);
    }
}
