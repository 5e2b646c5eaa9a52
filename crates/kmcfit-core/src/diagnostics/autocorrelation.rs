//! Autocorrelation of residuals.

/// Default number of lags for `count` samples: a tenth of them, at most 50.
///
/// With more lags the Ljung–Box statistic has a heavier tail than chi-square: with a quarter of 200 samples it rejects white noise
/// in 8.5 % of cases instead of 5 %; with this rule in 4 to 7 %, for 20 to 3000 samples (10,000 simulated sequences each).
pub fn default_lags(count: usize) -> usize {
    (count / SAMPLES_PER_LAG).min(MOST_LAGS)
}

/// Samples per lag in [`default_lags`].
const SAMPLES_PER_LAG: usize = 10;
/// Largest number of lags in [`default_lags`], for readable figures.
const MOST_LAGS: usize = 50;

/// 97.5 % quantile of the standard normal distribution.
pub const NORMAL_975: f64 = 1.959_963_984_540_054;

/// The normalised autocorrelation of a sequence at lags 0, 1, …, L.
#[derive(Debug, Clone, PartialEq)]
pub struct Autocorrelation {
    /// Autocorrelation `r_k` at lag `k`, dimensionless: 1 at lag 0, 0 without pairs.
    pub values: Vec<f64>,
    /// Number of pairs `n_k` of each lag: `n - k` without missing values.
    pub pairs: Vec<usize>,
    /// Number of values that are not missing, `n`.
    pub count: usize,
}

/// The normalised autocorrelation of equally spaced `values` at lags `0..=lags`:
///
/// ```text
/// r_k = (S_k / (n_k + k)) / (S_0 / n)          S_k = sum of x_i x_(i+k)
/// ```
///
/// Values that are not finite are missing: the sum runs over the `n_k` pairs without missing values, and `n = n_0` is the number of
/// present values. Without missing values `n_k + k = n`, and `r_k = S_k / S_0` is the usual (biased, positive definite) estimate.
/// The denominator for gaps is that of `acf` with `na.action = na.pass` in R.
///
/// **The mean is not subtracted.** Residuals of a correct model have zero mean, and an offset appears as a correlation at all
/// lags.
///
/// Lags at or beyond the length are omitted. All values are 0, also at lag 0, if the sequence is zero or missing throughout.
pub fn autocorrelation(values: &[f64], lags: usize) -> Autocorrelation {
    let largest = (values.iter().filter(|x| x.is_finite())).fold(0.0f64, |m, x| m.max(x.abs()));
    // Scaled to avoid overflow and underflow of squares.
    let scale = if largest > 0.0 { largest } else { 1.0 };
    let scaled: Vec<f64> = values.iter().map(|x| x / scale).collect();
    let lags = lags.min(values.len().saturating_sub(1));
    let (sums, pairs) = sums_of_products(&scaled, lags);
    let count = pairs[0];
    let power = sums[0] / count.max(1) as f64;
    let normalised = |(lag, (sum, n)): (usize, (&f64, &usize))| {
        if power > 0.0 && *n > 0 {
            sum / (n + lag) as f64 / power
        } else {
            0.0
        }
    };
    Autocorrelation {
        values: (sums.iter().zip(&pairs).enumerate())
            .map(normalised)
            .collect(),
        pairs,
        count,
    }
}

impl Autocorrelation {
    /// Largest lag.
    pub fn lags(&self) -> usize {
        self.values.len().saturating_sub(1)
    }

    /// True if a value of the sequence is nonzero, so that the correlations are defined.
    pub fn is_defined(&self) -> bool {
        self.values.first().is_some_and(|r| *r > 0.0)
    }

    /// Half-width of the 95 % band of white noise, `1.96 / sqrt(n)`.
    pub fn band(&self) -> f64 {
        NORMAL_975 / (self.count as f64).sqrt()
    }

    /// True if the value at `lag` is outside the band, which is wider with missing pairs: `|r_k| > 1.96 / sqrt(n_k + k)`.
    pub fn is_outside(&self, lag: usize) -> bool {
        match (self.values.get(lag), self.pairs.get(lag)) {
            (Some(r), Some(n)) if *n > 0 => r.abs() > NORMAL_975 / ((n + lag) as f64).sqrt(),
            _ => false,
        }
    }
}

/// Number of lags that are summed together: independent sums overlap where one waits for the addition before.
const LANES: usize = 16;

/// Sums `S_k` and the numbers of their terms, at lags `0..=lags`.
fn sums_of_products(values: &[f64], lags: usize) -> (Vec<f64>, Vec<usize>) {
    if values.iter().any(|x| !x.is_finite()) {
        return (0..=lags).map(|lag| sum_of_products(values, lag)).unzip();
    }
    // Products with the zeros after the end leave the sums unchanged.
    let mut padded = values.to_vec();
    padded.resize(values.len() + lags + LANES, 0.0);
    let mut sums = Vec::with_capacity(lags + LANES);
    for first in (0..=lags).step_by(LANES) {
        let mut lanes = [0.0; LANES];
        for (x, later) in values.iter().zip(padded[first..].windows(LANES)) {
            for (sum, y) in lanes.iter_mut().zip(later) {
                *sum += x * y;
            }
        }
        sums.extend(lanes);
    }
    sums.truncate(lags + 1);
    let pairs = (0..=lags).map(|lag| values.len().saturating_sub(lag));
    (sums, pairs.collect())
}

/// Sum `S_k` over pairs without missing values, and the number of its terms.
fn sum_of_products(values: &[f64], lag: usize) -> (f64, usize) {
    let later = values.iter().skip(lag);
    let products = values.iter().zip(later).map(|(a, b)| a * b);
    products
        .filter(|p| p.is_finite())
        .fold((0.0, 0), |(sum, n), p| (sum + p, n + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::{auto_regression, white};

    #[test]
    fn by_hand() {
        let found = autocorrelation(&[1.0, 2.0, -1.0, 3.0], 2);
        // S = 15, 2 - 2 - 3, -1 + 6
        let by_hand = [1.0, -3.0 / 15.0, 5.0 / 15.0];
        for (r, h) in found.values.iter().zip(by_hand) {
            assert!((r - h).abs() < 1e-15, "{r} is not {h}");
        }
        assert_eq!(found.pairs, [4, 3, 2]);
        assert_eq!(found.count, 4);
    }

    #[test]
    fn missing_values_by_hand() {
        let found = autocorrelation(&[1.0, f64::NAN, -1.0, 3.0, 2.0], 2);
        // S_0 = 15 of 4, S_1 = -3 + 6 of 2 pairs, S_2 = -1 - 2 of 2 pairs
        let power = 15.0 / 4.0;
        let by_hand = [1.0, 3.0 / 3.0 / power, -3.0 / 4.0 / power];
        for (r, h) in found.values.iter().zip(by_hand) {
            assert!((r - h).abs() < 1e-15, "{r} is not {h}");
        }
        assert_eq!((found.pairs, found.count), (vec![4, 2, 2], 4));
    }

    /// Sums of many lags together have the bits of those of each lag alone.
    #[test]
    fn lags_together_are_lags_alone() {
        for (count, lags) in [(1, 0), (2, 1), (17, 16), (300, 50), (60, 59)] {
            let values = white(4, count);
            let (sums, pairs) = sums_of_products(&values, lags);
            let alone: (Vec<f64>, Vec<usize>) =
                (0..=lags).map(|lag| sum_of_products(&values, lag)).unzip();
            assert_eq!((sums, pairs), alone, "{count} {lags}");
        }
    }

    #[test]
    fn gaps_do_not_shrink_the_correlation() {
        // AR(1) with coefficient 0.7; a third of the values missing, in bursts. The standard error
        // of r_1 is about sqrt((1 - 0.49) / pairs) = 0.006.
        let mut values = auto_regression(3, 30_000, 0.7);
        for start in (0..values.len()).step_by(30) {
            values[start..start + 10].fill(f64::NAN);
        }
        let found = autocorrelation(&values, 3);
        for (lag, r) in found.values.iter().enumerate() {
            assert!((r - 0.7f64.powi(lag as i32)).abs() < 0.03, "{lag}: {r}");
        }
    }

    #[test]
    fn white_noise_stays_in_its_band_at_nineteen_lags_of_twenty() {
        // 50 lags of 100 sequences; one sequence's lags are nearly independent of each other, so the
        // share is 0.05 with a standard error of sqrt(0.05 * 0.95 / 5000) = 0.0031.
        let outside: usize = (0..100)
            .map(|seed| {
                let r = autocorrelation(&white(seed, 2000), 50);
                (1..=50).filter(|lag| r.is_outside(*lag)).count()
            })
            .sum();
        let share = outside as f64 / 5000.0;
        assert!((share - 0.05).abs() < 4.0 * 0.0031, "{share}");
    }

    #[test]
    fn the_band_holds_with_gaps() {
        let outside: usize = (0..100)
            .map(|seed| {
                let mut values = white(seed, 2000);
                // A third of the samples are missing, at random positions that the noise determines.
                let missing = white(seed + 1000, 2000);
                for (x, gap) in values.iter_mut().zip(missing) {
                    if gap > 0.43 {
                        *x = f64::NAN;
                    }
                }
                let r = autocorrelation(&values, 50);
                (1..=50).filter(|lag| r.is_outside(*lag)).count()
            })
            .sum();
        let share = outside as f64 / 5000.0;
        assert!((share - 0.05).abs() < 4.0 * 0.0031 + 0.003, "{share}");
    }

    #[test]
    fn autocorrelations_do_not_depend_on_scale() {
        let small: Vec<f64> = white(5, 100).iter().map(|x| x * 1e-250).collect();
        let r = autocorrelation(&small, 5);
        let same = autocorrelation(&white(5, 100), 5);
        for (a, b) in r.values.iter().zip(&same.values) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn nothing_to_correlate() {
        assert!(!autocorrelation(&[0.0; 9], 3).is_defined());
        assert!(!autocorrelation(&[f64::NAN; 9], 3).is_defined());
        let empty = autocorrelation(&[], 3);
        assert_eq!((empty.lags(), empty.count), (0, 0));
        // Every other value missing: no pair one apart.
        let r = autocorrelation(&[1.0, f64::NAN, 2.0, f64::NAN, 1.0], 2);
        assert_eq!((r.values[1], r.pairs[1]), (0.0, 0));
        assert!(!r.is_outside(1) && !r.is_outside(99));
    }

    #[test]
    fn lags_by_default() {
        assert_eq!([0, 9, 40, 200, 9999].map(default_lags), [0, 0, 4, 20, 50]);
    }
}
