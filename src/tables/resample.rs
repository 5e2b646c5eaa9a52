//! Resampling of equally spaced samples.

/// Interpolates `values` at `count` equally spaced points from the first to the last sample, by cubic polynomials
/// through the four nearest samples; error of order 4 in the spacing.
///
/// # Panics
/// If there are fewer than two values or places.
pub fn resample(values: &[f64], count: usize) -> Vec<f64> {
    let intervals = values.len() - 1;
    let scale = intervals as f64 / (count - 1) as f64;
    let first_of_four = |cell: usize| cell.saturating_sub(1).min(values.len().saturating_sub(4));
    (0..count)
        .map(|i| {
            let x = i as f64 * scale;
            let cell = (x as usize).min(intervals - 1);
            let first = first_of_four(cell);
            let last = (first + 4).min(values.len());
            lagrange(&values[first..last], x - first as f64)
        })
        .collect()
}

/// The polynomial through `(0, values[0]), (1, values[1]), ...` at `x`.
fn lagrange(values: &[f64], x: f64) -> f64 {
    let weight = |j: usize| -> f64 {
        let others = (0..values.len()).filter(|&k| k != j);
        others
            .map(|k| (x - k as f64) / (j as f64 - k as f64))
            .product()
    };
    values.iter().enumerate().map(|(j, v)| v * weight(j)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_exact_and_samples_are_kept() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.25 * t * t * t;
        let values: Vec<f64> = (0..11).map(|i| cubic(f64::from(i) * 0.3)).collect();
        for (i, y) in resample(&values, 101).iter().enumerate() {
            assert!((y - cubic(i as f64 * 0.03)).abs() < 1e-13, "{i}");
        }
        assert_eq!(resample(&values, 11), values);
    }

    #[test]
    fn two_samples_are_joined_by_a_line() {
        assert_eq!(resample(&[1.0, 3.0], 3), [1.0, 2.0, 3.0]);
    }
}
