//! Modes of vibration in a free response, from its spectrum.

use super::Spectrum;
use super::median;

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

/// Frequencies (Hz) of two modes in the earlier half of a free response with samples `spacing` seconds apart, the stronger one first;
/// `None` where there is one mode or the response is too short. A frequency that varies in time, and harmonics, are no modes.
pub fn two_modes(values: &[f64], spacing: f64) -> Option<[f64; 2]> {
    let spectrum = Spectrum::of(&values[..values.len() / 2], spacing)?;
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
}
