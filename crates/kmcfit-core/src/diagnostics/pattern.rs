//! Systematic patterns of residuals: outliers, an offset, a drift.

/// Threshold of outliers in robust standard deviations; one in a billion samples of white noise exceeds it.
const FAR: f64 = 6.0;
/// Ratio of the standard deviation to the median absolute value, for normal numbers.
const OF_MEDIAN: f64 = 1.482_602_218_505_602;
/// Smallest share of the sum of squares and largest share of the samples for outliers, to distinguish them from the tail of a
/// pattern.
const SQUARES: f64 = 0.5;
const AT_MOST: f64 = 0.05;
/// Largest number of consecutive outliers.
const TOGETHER: usize = 3;
/// Smallest number of residuals for a pattern.
const FEWEST: usize = 16;

/// Indices of isolated outliers: size and distance from the mean of the neighbours both exceed six robust standard deviations
/// (1.4826 times the median absolute value). Together they contain at least half of the sum of squares; they are at most one
/// sample in twenty, and at most three are consecutive. Empty otherwise.
///
/// ```
/// use kmcfit_core::diagnostics::outlier_indices;
/// let mut residuals: Vec<f64> = (0..100).map(|i| (0.7 * f64::from(i)).sin()).collect();
/// residuals[30] = 80.0;
/// assert_eq!(outlier_indices(&residuals), [30]);
/// residuals[30] = 0.8;
/// assert!(outlier_indices(&residuals).is_empty());
/// ```
pub fn outlier_indices(residuals: &[f64]) -> Vec<usize> {
    if residuals.len() < FEWEST || residuals.iter().any(|r| !r.is_finite()) {
        return Vec::new();
    }
    let last = residuals.len() - 1;
    let neighbours = |i: usize| match i {
        0 => residuals[1],
        i if i == last => residuals[last - 1],
        i => 0.5 * (residuals[i - 1] + residuals[i + 1]),
    };
    let jumps: Vec<f64> = (0..=last).map(|i| residuals[i] - neighbours(i)).collect();
    let limit = |values: &[f64]| FAR * OF_MEDIAN * median_size(values);
    let (size, jump) = (limit(residuals), limit(&jumps));
    let far: Vec<usize> = (0..=last)
        .filter(|i| residuals[*i].abs() > size && jumps[*i].abs() > jump)
        .collect();
    // Relative to the largest, because squares of 1e200 overflow.
    let largest = residuals.iter().fold(0.0f64, |most, r| most.max(r.abs()));
    let square = |r: f64| (r / largest) * (r / largest);
    let held: f64 = far.iter().map(|i| square(residuals[*i])).sum();
    let all: f64 = residuals.iter().map(|r| square(*r)).sum();
    let few = far.len() as f64 <= AT_MOST * residuals.len() as f64;
    // Longer sequences belong to a response.
    let alone = (far.windows(TOGETHER + 1)).all(|run| run[TOGETHER] - run[0] > TOGETHER);
    match held >= SQUARES * all && few && alone {
        true => far,
        false => Vec::new(),
    }
}

/// Shares of the sum of squares of residuals contained in their mean, and in the straight line through the rest: both from 0 to 1,
/// and 0 for fewer than 16 residuals.
///
/// ```
/// use kmcfit_core::diagnostics::offset_and_drift;
/// let times: Vec<f64> = (0..50).map(f64::from).collect();
/// let drifting: Vec<f64> = times.iter().map(|t| 1.0 + 0.1 * t).collect();
/// let [offset, drift] = offset_and_drift(&times, &drifting);
/// assert!((offset + drift - 1.0).abs() < 1e-12);
/// assert!((drift - 2.0825 / (3.45 * 3.45 + 2.0825)).abs() < 1e-12);
/// ```
pub fn offset_and_drift(times: &[f64], residuals: &[f64]) -> [f64; 2] {
    let n = residuals.len().min(times.len());
    let largest = residuals[..n]
        .iter()
        .fold(0.0f64, |most, r| most.max(r.abs()));
    let usable = largest > 0.0 && largest.is_finite() && residuals.iter().all(|r| r.is_finite());
    if n < FEWEST || !usable {
        return [0.0; 2];
    }
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n as f64;
    let level = mean(&mut residuals[..n].iter().map(|r| r / largest));
    let middle = mean(&mut times[..n].iter().copied());
    let (mut squares, mut along, mut spread) = (0.0, 0.0, 0.0);
    for (t, r) in times.iter().zip(&residuals[..n]) {
        let r = r / largest;
        squares += r * r;
        along += (t - middle) * (r - level);
        spread += (t - middle) * (t - middle);
    }
    let offset = n as f64 * level * level / squares;
    let drift = along * along / (spread * squares);
    [offset, drift].map(|share| if share.is_finite() { share } else { 0.0 })
}

/// Median absolute value, 0 for no values.
pub(crate) fn median_size(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let middle = sizes.len() / 2;
    match sizes.is_empty() {
        true => 0.0,
        false => *sizes.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::white;

    /// White noise and a systematic misfit contain no isolated outliers.
    #[test]
    fn noise_and_systematic_patterns_have_no_outliers() {
        for seed in 1..20 {
            assert!(outlier_indices(&white(seed, 2000)).is_empty(), "{seed}");
        }
        let decay = |i: i32| (-0.1 * f64::from(i)).exp() * (0.3 * f64::from(i)).cos();
        let missed: Vec<f64> = (0..1000).map(decay).collect();
        assert!(outlier_indices(&missed).is_empty());
        assert!(outlier_indices(&[0.0; 100]).is_empty());
        assert!(outlier_indices(&[f64::NAN; 100]).is_empty());
    }

    #[test]
    fn outliers_are_found_at_the_ends_too() {
        let mut residuals = white(3, 200);
        for i in [0, 90, 91, 199] {
            residuals[i] = 60.0;
        }
        assert_eq!(outlier_indices(&residuals), [0, 90, 91, 199]);
        // One in ten is too frequent for outliers.
        for i in (0..200).step_by(10) {
            residuals[i] = 60.0;
        }
        assert!(outlier_indices(&residuals).is_empty());
    }

    #[test]
    fn noise_has_neither_offset_nor_drift() {
        let times: Vec<f64> = (0..500).map(|i| 0.01 * f64::from(i)).collect();
        let shares = offset_and_drift(&times, &white(7, 500));
        assert!(shares.iter().all(|share| *share < 0.05), "{shares:?}");
        assert_eq!(offset_and_drift(&times, &[1e200; 500]), [1.0, 0.0]);
        assert_eq!(offset_and_drift(&times, &[0.0; 500]), [0.0, 0.0]);
        assert_eq!(offset_and_drift(&[1.0; 500], &white(7, 500))[1], 0.0);
    }
}
