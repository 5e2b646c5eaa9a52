//! Choice of the order of an autoregressive process by the Bayesian information criterion.

use super::autoregression::Autoregression;
use super::burg::partial_autocorrelations;
use std::ops::Range;

/// Highest order that is tried.
pub const HIGHEST_ORDER: usize = 12;
/// Smallest number of samples per coefficient.
const SAMPLES_PER_COEFFICIENT: usize = 10;

/// Returns the process whose order, between 0 and `highest`, minimises the Bayesian information criterion `sum_k n_k log(1 - phi_k^2) + p log n`,
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
}
