//! Onset of a response after a rest or a static deflection.

use super::Spectrum;
use crate::diagnostics::{median_size, outlier_indices, rms};

/// Smallest number of samples at rest.
const STILL: usize = 16;
/// Share of the largest deflection from the initial level at which the response has started.
const BEGUN: f64 = 0.15;
/// Ratio of samples of the response to those at rest.
const SUDDEN: f64 = 10.0;

/// Index of the first sample of the response, if the record starts at rest: 16 samples or more, over at least one period of the
/// following response, at a level constant to a tenth of that response. `spacing` is the distance of samples in s. `None` without a
/// rest, or with isolated outliers.
///
/// ```
/// use kmcfit_core::signal::onset;
/// let swing = |i: i32| (-0.01 * f64::from(i)).exp() * (0.2 * f64::from(i)).cos();
/// let held: Vec<f64> = (-60..400).map(|i| swing(i.max(0))).collect();
/// let first = onset(&held, 0.05).expect("it is held for 60 samples");
/// assert!((60..66).contains(&first));
/// let free: Vec<f64> = (0..400).map(swing).collect();
/// assert_eq!(onset(&free, 0.05), None);
/// ```
pub fn onset(values: &[f64], spacing: f64) -> Option<usize> {
    if values.len() < 4 * STILL || values.iter().any(|y| !y.is_finite()) {
        return None;
    }
    let mut first = values[..STILL].to_vec();
    first.sort_by(f64::total_cmp);
    let level = first[STILL / 2];
    let away: Vec<f64> = values.iter().map(|y| y - level).collect();
    let largest = away.iter().fold(0.0f64, |most, y| most.max(y.abs()));
    let begins = away.iter().position(|y| y.abs() > BEGUN * largest)?;
    let (still, moves) = (&away[..begins], &away[begins..]);
    // The last quarter of the rest shows a slow growth.
    let is_sudden = rms(moves) > SUDDEN * median_size(&still[begins - begins / 4..]);
    if begins < STILL || moves.len() < STILL || !is_sudden || !outlier_indices(&away).is_empty() {
        return None;
    }
    let frequency = Spectrum::of(moves, spacing)?.dominant();
    (begins as f64 * spacing * frequency >= 1.0).then_some(begins)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random values from -1 to 1.
    fn shock(i: i32) -> f64 {
        2.0 * ((12.9898 * f64::from(i)).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
    }

    fn record(still: i32, noise: f64) -> Vec<f64> {
        let sample = |i: i32| {
            let (t, shock) = (f64::from(i - still), shock(i));
            let swing = match t >= 0.0 {
                true => (-0.01 * t).exp() * (0.2 * t).sin(),
                false => 0.0,
            };
            swing + noise * shock
        };
        (0..500).map(sample).collect()
    }

    #[test]
    fn an_impact_ends_the_rest() {
        for noise in [0.0, 0.005, 0.02] {
            let begins = onset(&record(100, noise), 0.01).expect("an onset after rest");
            assert!((100..=102).contains(&begins), "{noise}: {begins}");
        }
        // Independent of level and unit.
        let other: Vec<f64> = record(100, 0.005).iter().map(|y| 3e-6 * y - 7e-6).collect();
        assert_eq!(onset(&other, 10.0), onset(&record(100, 0.005), 10.0));
    }

    #[test]
    fn a_record_without_rest_has_no_onset() {
        let none = |values: Vec<f64>| assert_eq!(onset(&values, 0.01), None);
        none(record(0, 0.0));
        // Less than a period, 31 samples, and too few.
        none(record(20, 0.0));
        none(record(10, 0.0));
        none((0..500).map(shock).collect());
        // A slowly growing response.
        none(
            (0..500)
                .map(|i| (0.01 * f64::from(i)).exp() * (0.2 * f64::from(i)).sin())
                .collect(),
        );
        let mut far = record(0, 0.0);
        for i in [100, 200, 300] {
            far[i] = 1e4;
        }
        none(far);
        none(vec![1.0; 500]);
        none(vec![f64::NAN; 500]);
        none(Vec::new());
    }
}
