//! Oscillation of a channel: dominant frequency, drift and decay, from its samples alone.

use kmcfit_core::diagnostics::{detrended, offset_and_drift, outlier_indices};
use kmcfit_core::signal::{Spectrum, median, spikes};
use std::f64::consts::TAU;

/// Fewest periods for a test of drift, and the share of the variance that a straight line must explain; for an
/// oscillation without drift of that many periods it explains a few per cent.
const DRIFT_PERIODS: f64 = 4.0;
const DRIFT: f64 = 0.1;
/// Fewest samples of an oscillation.
const FEWEST: usize = 4;
/// Damping ratios that a decay can give: a start value within them lets a fit begin.
const DAMPING_RATIOS: [f64; 2] = [0.001, 0.3];

/// Dominant oscillation of samples with their times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Oscillation {
    /// Dominant frequency, Hz; about their straight line, if they drift.
    pub frequency: Option<f64>,
    /// Frequency below which half of the energy lies, Hz.
    pub middle: Option<f64>,
    /// True if the samples oscillate about a sloping line.
    pub drifts: bool,
}

impl Oscillation {
    /// Oscillation of pairs of time (s) and sample, at a median distance `spacing` and over `duration` seconds.
    pub fn of(pairs: &[(f64, f64)], spacing: f64, duration: f64) -> Self {
        if pairs.len() < FEWEST {
            return Self {
                frequency: None,
                middle: None,
                drifts: false,
            };
        }
        // The line is a drift only if the samples oscillate about it.
        let beside_line = beside_line(pairs).and_then(|pairs| frequencies(&pairs, spacing));
        let beside_line = beside_line.filter(|[dominant, _]| dominant * duration >= DRIFT_PERIODS);
        let found = beside_line.or_else(|| frequencies(pairs, spacing));
        Self {
            frequency: found.map(|[dominant, _]| dominant),
            middle: found.map(|[_, middle]| middle),
            drifts: beside_line.is_some(),
        }
    }

    /// Dominant frequency and that which halves the energy, Hz.
    pub fn frequencies(&self) -> Option<[f64; 2]> {
        Some([self.frequency?, self.middle?])
    }
}

/// Damping ratio of a free decay of a frequency (Hz), from the energies of the halves of its samples:
///
/// ```text
/// sum_2 y^2 / sum_1 y^2 = exp(-zeta omega T)
/// ```
///
/// over their duration `T`. Noise at the end of the record lowers it. `None` for samples that do not decay.
pub(super) fn decay_ratio(pairs: &[(f64, f64)], frequency: f64) -> Option<f64> {
    let (times, values): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let values = detrended(&times, &values);
    let duration = times.last()? - times.first()?;
    let (first, second) = values.split_at(values.len() / 2);
    let [first, second] = [first, second].map(|half| half.iter().map(|x| x * x).sum::<f64>());
    let ratio = (first / second).ln() / (TAU * frequency * duration);
    let [least, most] = DAMPING_RATIOS;
    (ratio.is_finite() && ratio > 0.0).then(|| ratio.clamp(least, most))
}

/// Removes outliers; returns their number and the first one.
pub(super) fn remove_outliers(pairs: &mut Vec<(f64, f64)>) -> Option<(usize, f64)> {
    if pairs.is_empty() {
        return None;
    }
    let values = values_of(pairs);
    let level = median(&*values);
    let away: Vec<f64> = values.iter().map(|value| value - level).collect();
    let mut far = outlier_indices(&away);
    if far.is_empty() {
        let times: Vec<f64> = pairs.iter().map(|(time, _)| *time).collect();
        far = spikes(&times, &values);
    }
    let first = values[*far.first()?];
    let mut position = 0..;
    pairs.retain(|_| {
        position
            .next()
            .is_some_and(|i| far.binary_search(&i).is_err())
    });
    Some((far.len(), first))
}

/// Samples minus their straight line, if it explains a large part of them.
fn beside_line(pairs: &[(f64, f64)]) -> Option<Vec<(f64, f64)>> {
    let (times, values): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let [mean, line] = offset_and_drift(&times, &values);
    if line <= DRIFT * (1.0 - mean) {
        return None;
    }
    let left = detrended(&times, &values);
    Some(times.into_iter().zip(left).collect())
}

/// Dominant and middle frequency of the samples, interpolated linearly where they are not equally spaced, Hz.
fn frequencies(pairs: &[(f64, f64)], spacing: f64) -> Option<[f64; 2]> {
    let (first, last) = (pairs.first()?.0, pairs.last()?.0);
    // Bounds the memory for records with long gaps.
    let count = (((last - first) / spacing).round() as usize + 1).min(4 * pairs.len());
    let step = (last - first) / (count - 1) as f64;
    let mut next = 1;
    let at = |i: usize| {
        let t = first + step * i as f64;
        while next + 1 < pairs.len() && pairs[next].0 < t {
            next += 1;
        }
        let ((t0, y0), (t1, y1)) = (pairs[next - 1], pairs[next]);
        y0 + (y1 - y0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
    };
    let values: Vec<f64> = (0..count).map(at).collect();
    let spectrum = Spectrum::of(&values, step)?;
    let found = [spectrum.dominant(), spectrum.energy_quantile(0.5)];
    let is_frequency = |f: &f64| f.is_finite() && *f > 0.0;
    found.iter().all(is_frequency).then_some(found)
}

pub(super) fn values_of(pairs: &[(f64, f64)]) -> Vec<f64> {
    pairs.iter().map(|(_, value)| *value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `exp(-zeta omega t) cos(omega_d t)`: the frequency within a fiftieth, the ratio within a tenth, also beside an offset.
    #[test]
    fn a_decay_has_its_frequency_and_ratio() {
        for (frequency, zeta) in [(2.0, 0.01), (5.0, 0.02), (0.2, 0.005)] {
            let spacing = 0.02 / frequency;
            let omega = TAU * frequency;
            let sample = |i: usize| {
                let t = spacing * i as f64;
                (t, 3.0 + (-zeta * omega * t).exp() * (omega * t).cos())
            };
            let pairs: Vec<(f64, f64)> = (0..1000).map(sample).collect();
            let found = Oscillation::of(&pairs, spacing, 1000.0 * spacing);
            let found_frequency = found.frequency.expect("an oscillation");
            assert!((found_frequency / frequency - 1.0).abs() < 0.02);
            assert!(!found.drifts);
            let ratio = decay_ratio(&pairs, found_frequency).expect("a decay");
            assert!((ratio / zeta - 1.0).abs() < 0.1, "{ratio} of {zeta}");
        }
        let growing: Vec<(f64, f64)> = (0..100)
            .map(|i| (f64::from(i), f64::from(i * i) * f64::from(i % 3 - 1)))
            .collect();
        assert_eq!(decay_ratio(&growing, 0.3), None);
    }
}
