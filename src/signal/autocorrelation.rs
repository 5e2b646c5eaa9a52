//! How much a series resembles itself a little later.

/// The autocorrelation of a series at the lags from 0 to `lags`, without its mean:
///
/// ```text
/// r_k = sum_i (x_i - mean) (x_{i+k} - mean) / sum_i (x_i - mean)²
/// ```
///
/// `r_0 = 1`; white noise of n values has the others within some 2/√n of zero. Lags beyond the
/// series are zero. `None` where the series is empty, constant or not finite.
///
/// ```
/// let r = kmcfit::signal::autocorrelation(&[1.0, -1.0, 1.0, -1.0], 2).expect("it varies");
/// assert_eq!(r, [1.0, -0.75, 0.5]);
/// ```
pub fn autocorrelation(series: &[f64], lags: usize) -> Option<Vec<f64>> {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let centred: Vec<f64> = series.iter().map(|x| x - mean).collect();
    let product = |lag: usize| -> f64 {
        let later = centred.get(lag..).unwrap_or_default();
        centred.iter().zip(later).map(|(x, y)| x * y).sum()
    };
    let whole = product(0);
    let varies = whole.is_finite() && series.iter().any(|x| *x != series[0]) && whole > 0.0;
    varies.then(|| (0..=lags).map(|lag| product(lag) / whole).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_is_like_itself_after_a_period() {
        let n = 4000;
        let sine: Vec<f64> = (0..n).map(|i| (f64::from(i) * 0.1).sin()).collect();
        let r = autocorrelation(&sine, 70).unwrap();
        // cos(0.1 k) (1 - k/n), but for what is left over of the last period: below 2/n.
        for (k, r) in r.iter().enumerate() {
            let expected = (0.1 * k as f64).cos() * (1.0 - k as f64 / f64::from(n));
            assert!((r - expected).abs() < 2e-3, "{k}");
        }
    }

    #[test]
    fn series_without_variation_have_none() {
        assert_eq!(autocorrelation(&[], 3), None);
        assert_eq!(autocorrelation(&[2.0; 5], 3), None);
        assert_eq!(autocorrelation(&[0.1, 0.1, 0.1], 3), None);
        assert_eq!(autocorrelation(&[1.0, f64::NAN], 3), None);
        assert_eq!(
            autocorrelation(&[1.0, -1.0], 3).unwrap(),
            [1.0, -0.5, 0.0, 0.0]
        );
    }
}
