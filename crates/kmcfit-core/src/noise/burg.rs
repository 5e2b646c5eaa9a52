//! Estimation of the coefficients of autoregressive processes by Burg's method.

use super::autoregression::Autoregression;
use std::ops::Range;

/// Autoregressive process of order `order` of the values, which are uninterrupted within each of `runs`, by Burg's method: each
/// partial autocorrelation minimises the sum of squares of forward and backward prediction errors over all runs.
///
/// Source: Burg (1975), *Maximum entropy spectral analysis*; for interrupted records de Waele and Broersen (2000).
pub fn burg(values: &[f64], runs: &[Range<usize>], order: usize) -> Autoregression {
    let found = partial_autocorrelations(values, runs, order).into_iter();
    Autoregression::new(found.map(|(phi, _)| phi).collect()).unwrap_or_default()
}

/// Partial autocorrelations of the orders `1..=order`, fewer where the prediction errors vanish, each with the number of products in
/// its estimate.
pub(super) fn partial_autocorrelations(
    values: &[f64],
    runs: &[Range<usize>],
    order: usize,
) -> Vec<(f64, usize)> {
    let mut errors: Vec<[Vec<f64>; 2]> = (runs.iter())
        .map(|run| [values[run.clone()].to_vec(), values[run.clone()].to_vec()])
        .collect();
    let mut partial = Vec::with_capacity(order);
    for k in 1..=order {
        let (mut product, mut squares, mut count) = (0.0, 0.0, 0);
        for [forward, backward] in &errors {
            for i in k..forward.len() {
                product += forward[i] * backward[i - 1];
                squares += forward[i] * forward[i] + backward[i - 1] * backward[i - 1];
                count += 1;
            }
        }
        let phi = 2.0 * product / squares;
        // NaN for errors that vanish.
        if phi.is_nan() || phi.abs() >= 1.0 {
            break;
        }
        partial.push((phi, count));
        for [forward, backward] in &mut errors {
            for i in (k..forward.len()).rev() {
                let (f, b) = (forward[i], backward[i - 1]);
                forward[i] = f - phi * b;
                backward[i] = b - phi * f;
            }
        }
    }
    partial
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::auto_regression;

    /// Also, values of zero have no correlation.
    #[test]
    fn interrupted_runs_have_the_coefficients_of_the_whole() {
        let values = auto_regression(7, 3000, 0.9);
        let whole = 0..3000;
        let parts: Vec<Range<usize>> = (0..10).map(|i| 300 * i..300 * (i + 1)).collect();
        let [a, b] = [std::slice::from_ref(&whole), &parts].map(|runs| burg(&values, runs, 1));
        // Nine of 3000 products are missing.
        assert!((a.coefficients()[0] - b.coefficients()[0]).abs() < 0.01);
        let zeros = burg(&[0.0; 50], std::slice::from_ref(&(0..50)), 3);
        assert_eq!(zeros.order(), 0);
    }
}
