//! Size of residuals in one number.
//!
//! Samples and predictions are compared in pairs. Pairs with a value that is not finite are missing, and values beyond the end of
//! the shorter slice are ignored.

use crate::simd::sum;
use std::ops::Range;

/// NRMSE fit, per cent:
///
/// ```text
/// 100 (1 - |observed - model| / |observed - mean of observed|)
/// ```
///
/// with Euclidean norms. A perfect model has 100, the mean of the samples 0, worse models negative values. Constant samples give
/// 100 for an exact model and minus infinity otherwise; without samples the result is NaN.
///
/// Source: MathWorks, *System Identification Toolbox*, `compare` and `goodnessOfFit` (NRMSE).
pub fn fit_percent(observed: &[f64], model: &[f64]) -> f64 {
    let length = observed.len().min(model.len());
    let (observed, model) = (&observed[..length], &model[..length]);
    let mean = sum::total(observed) / length as f64;
    let missed = sum::squared_distance(observed, model, 1.0);
    let varied = sum::squared_deviation(observed, mean);
    // Not for missing values, nor where squares overflow or lose digits.
    match [missed, varied].iter().all(|s| SQUARES.contains(s)) {
        true => 100.0 * (1.0 - (missed / varied).sqrt()),
        false => careful_fit_percent(observed, model),
    }
}

/// Sums of squares of which no term overflows, and those that lose digits are negligible.
const SQUARES: Range<f64> = 1e-270..1e300;

fn careful_fit_percent(observed: &[f64], model: &[f64]) -> f64 {
    let known = || pairs(observed, model);
    let count = known().count();
    if count == 0 {
        return f64::NAN;
    }
    let mean = known().map(|(o, _)| o / count as f64).sum::<f64>();
    let missed = norm(known().map(|(o, m)| o - m));
    let varied = norm(known().map(|(o, _)| o - mean));
    if missed == 0.0 {
        100.0
    } else {
        100.0 * (1.0 - missed / varied)
    }
}

/// Root mean square `sqrt(sum of r_i^2 / n)` over the finite values, in their unit; NaN without values.
pub fn rms(residuals: &[f64]) -> f64 {
    let finite = || residuals.iter().copied().filter(|r| r.is_finite());
    norm(finite()) / (finite().count() as f64).sqrt()
}

/// Pairs with two finite values.
fn pairs<'a>(
    observed: &'a [f64],
    model: &'a [f64],
) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    let both = observed.iter().copied().zip(model.iter().copied());
    both.filter(|(o, m)| o.is_finite() && m.is_finite())
}

/// Euclidean norm without overflow or underflow.
fn norm(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = values.clone().fold(0.0f64, |most, v| most.max(v.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * values.map(|v| (v / largest).powi(2)).sum::<f64>().sqrt()
}

/// Standard deviation, 0 for no values.
pub fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt()
}

/// Values minus their straight line over the times.
pub fn detrended(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let [middle, level] = [times, values].map(|x| x.iter().sum::<f64>() / n);
    let (mut along, mut squares) = (0.0, 0.0);
    for (t, y) in times.iter().zip(values) {
        along += (t - middle) * (y - level);
        squares += (t - middle) * (t - middle);
    }
    let slope = along / squares;
    let pairs = times.iter().zip(values);
    pairs
        .map(|(t, y)| y - (level + slope * (t - middle)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn a_perfect_model_has_a_fit_of_100_and_the_mean_of_0() {
        let observed = [1.0, 2.0, 6.0];
        near(fit_percent(&observed, &observed), 100.0);
        near(fit_percent(&observed, &[3.0; 3]), 0.0);
    }

    #[test]
    fn the_fit_by_hand() {
        // Residuals (1, 0, -1, 0), deviations from the mean 0: (2, -2, 2, -2).
        let fit = fit_percent(&[2.0, -2.0, 2.0, -2.0], &[1.0, -2.0, 3.0, -2.0]);
        near(fit, 100.0 * (1.0 - 2.0f64.sqrt() / 4.0));
    }

    #[test]
    fn the_fit_is_independent_of_unit_and_origin() {
        let observed = [0.3, -0.2, 0.9, 0.4];
        let model = [0.2, -0.1, 1.0, 0.1];
        let other = |x: &[f64]| x.iter().map(|x| 1e200 * x - 3e200).collect::<Vec<f64>>();
        let fit = fit_percent(&observed, &model);
        assert!((fit_percent(&other(&observed), &other(&model)) - fit).abs() < 1e-9);
    }

    #[test]
    fn the_fit_of_many_samples_is_that_of_the_careful_sums() {
        let observed = crate::diagnostics::noise::white(1, 1003);
        let model: Vec<f64> = observed.iter().map(|x| 0.9 * x + 0.01).collect();
        for unit in [1e-160, 1.0, 1e160] {
            let [observed, model] =
                [&observed, &model].map(|list| list.iter().map(|x| unit * x).collect::<Vec<f64>>());
            let fit = fit_percent(&observed, &model);
            near(fit, careful_fit_percent(&observed, &model));
            assert!((85.0..95.0).contains(&fit), "{fit}");
        }
    }

    #[test]
    fn missing_samples_are_ignored() {
        let observed = [2.0, f64::NAN, -2.0, 2.0, -2.0, 5.0];
        let model = [1.0, 7.0, -2.0, 3.0, -2.0, f64::NAN];
        near(
            fit_percent(&observed, &model),
            100.0 * (1.0 - 2.0f64.sqrt() / 4.0),
        );
        near(rms(&[3.0, f64::NAN, -4.0]), 12.5f64.sqrt());
    }

    #[test]
    fn edges_of_the_fit() {
        assert!(fit_percent(&[], &[]).is_nan());
        near(fit_percent(&[2.0, 2.0], &[2.0, 2.0]), 100.0);
        assert_eq!(fit_percent(&[2.0, 2.0], &[2.0, 3.0]), f64::NEG_INFINITY);
        assert!(rms(&[]).is_nan());
        assert_eq!(rms(&[0.0, 0.0]), 0.0);
    }

    #[test]
    fn a_line_is_removed_completely() {
        let times: Vec<f64> = (0..5).map(f64::from).collect();
        let wiggle = [1.0, -2.0, 2.0, -2.0, 1.0];
        let values: Vec<f64> = times
            .iter()
            .zip(wiggle)
            .map(|(t, w)| 3.0 + 0.5 * t + w)
            .collect();
        assert_eq!(detrended(&times, &values), wiggle);
        assert_eq!(standard_deviation(&wiggle), (14.0f64 / 5.0).sqrt());
        assert_eq!(standard_deviation(&[]), 0.0);
    }
}
