//! Estimation of autoregressive processes by Burg's method, and choice of their order.

use super::autoregression::Autoregression;
use std::ops::Range;

/// Highest order that is tried.
pub const HIGHEST_ORDER: usize = 12;
/// Smallest number of samples per coefficient.
const SAMPLES_PER_COEFFICIENT: usize = 10;

/// Autoregressive process of order `order` of the values, which are uninterrupted within each of `runs`, by Burg's method: each
/// partial autocorrelation minimises the sum of squares of forward and backward prediction errors over all runs.
///
/// Source: Burg (1975), *Maximum entropy spectral analysis*; for interrupted records de Waele and Broersen (2000).
pub fn burg(values: &[f64], runs: &[Range<usize>], order: usize) -> Autoregression {
    let found = partial_autocorrelations(values, runs, order).into_iter();
    Autoregression::new(found.map(|(phi, _)| phi).collect()).unwrap_or_default()
}

/// Process whose order, between 0 and `highest`, minimises the Bayesian information criterion `sum_k n_k log(1 - phi_k^2) + p log n`,
/// with the number `n_k` of products from which the partial autocorrelation `phi_k` is estimated: `n - k` without interruptions.
pub fn select_order(values: &[f64], runs: &[Range<usize>], highest: usize) -> Autoregression {
    let count: usize = runs.iter().map(Range::len).sum();
    let highest = highest.min(count / SAMPLES_PER_COEFFICIENT);
    let partial = partial_autocorrelations(values, runs, highest);
    let penalty = (count as f64).ln();
    let (mut criterion, mut best) = (0.0, (0.0, 0));
    for (k, (phi, products)) in partial.iter().enumerate() {
        criterion += *products as f64 * (-phi * phi).ln_1p() + penalty;
        if criterion < best.0 {
            best = (criterion, k + 1);
        }
    }
    let chosen = partial[..best.1].iter().map(|(phi, _)| *phi);
    Autoregression::new(chosen.collect()).unwrap_or_default()
}

/// Partial autocorrelations of the orders `1..=order`, fewer where the prediction errors vanish, each with the number of products in
/// its estimate.
fn partial_autocorrelations(
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

    #[test]
    fn the_order_of_white_noise_is_0_and_of_ar_1_noise_1() {
        let (mut white, mut coloured) = (0, 0);
        let seeds = 100;
        for seed in 0..seeds {
            let run = 0..1000;
            let runs = std::slice::from_ref(&run);
            white +=
                usize::from(select_order(&auto_regression(seed, 1000, 0.0), runs, 12).order() == 0);
            let found = select_order(&auto_regression(seed, 1000, 0.8), runs, 12);
            // The standard error of a coefficient is sqrt((1 - 0.64)/1000) = 0.019.
            assert!((found.coefficients()[0] - 0.8).abs() < 0.15, "{found:?}");
            coloured += usize::from(found.order() == 1);
        }
        // A further coefficient is taken where a chi-square exceeds log 1000 = 6.9: with probability 0.9 % each, about 2 %
        // over all orders, binomially distributed.
        assert!(white >= 93 && coloured >= 93, "{white} {coloured}");
    }

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
