//! The onset of a response after a hold or a blow.

use super::Spectrum;
use crate::diagnostics::{far_off, median_size, rms};

/// Fewest samples that stand still.
const STILL: usize = 16;
/// The response has begun where it is further from the level before than this share of its largest distance.
const BEGUN: f64 = 0.15;
/// Samples that move are so many times as large as those that stand still.
const SUDDEN: f64 = 10.0;

/// How many samples stand still before the response begins, if a record begins so: 16 or more, for at least a period of the
/// response that follows, at one level but for a tenth of that response. `spacing` is the distance of samples in s.
/// `None` where single samples lie far off.
///
/// ```
/// use kmcfit_core::internals::signal::onset;
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
    // The last quarter: what grows slowly has grown there.
    let is_sudden = rms(moves) > SUDDEN * median_size(&still[begins - begins / 4..]);
    if begins < STILL || moves.len() < STILL || !is_sudden || !far_off(&away).is_empty() {
        return None;
    }
    let frequency = Spectrum::of(moves, spacing)?.dominant();
    (begins as f64 * spacing * frequency >= 1.0).then_some(begins)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From -1 to 1, without a pattern.
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
    fn a_blow_ends_the_rest_before_it() {
        for noise in [0.0, 0.005, 0.02] {
            let begins = onset(&record(100, noise), 0.01).expect("it stands still");
            assert!((100..=102).contains(&begins), "{noise}: {begins}");
        }
        // Any level, any unit.
        let other: Vec<f64> = record(100, 0.005).iter().map(|y| 3e-6 * y - 7e-6).collect();
        assert_eq!(onset(&other, 10.0), onset(&record(100, 0.005), 10.0));
    }

    #[test]
    fn what_moves_from_the_beginning_has_none() {
        let none = |values: Vec<f64>| assert_eq!(onset(&values, 0.01), None);
        none(record(0, 0.0));
        // Less than a period, 31 samples, and too few.
        none(record(20, 0.0));
        none(record(10, 0.0));
        none((0..500).map(shock).collect());
        // It grows, slowly.
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
