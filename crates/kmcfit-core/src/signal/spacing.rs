//! Spacing of sampling times.

/// Largest deviation from equal spacing, in spacings.
const REGULAR: f64 = 1e-6;

/// Spacing of equally spaced times; `None` for unequal spacing or fewer than two times.
pub fn even_spacing(times: &[f64]) -> Option<f64> {
    let (&[first, .., last], intervals) = (times, times.len().checked_sub(1)?) else {
        return None;
    };
    let spacing = (last - first) / intervals as f64;
    let astray =
        |(i, t): (usize, &f64)| (t - (first + i as f64 * spacing)).abs() > REGULAR * spacing;
    (!times.iter().enumerate().any(astray)).then_some(spacing)
}

/// Median distance of neighbouring times.
///
/// # Panics
/// If there are fewer than two times.
pub fn median_spacing(times: &[f64]) -> f64 {
    let spacings: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    median(spacings)
}

/// Median of a nonempty list of values. A `Vec` is reordered in place, a slice copied.
pub fn median(values: impl Into<Vec<f64>>) -> f64 {
    let mut values = values.into();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
