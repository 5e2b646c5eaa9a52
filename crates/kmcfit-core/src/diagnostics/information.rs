//! Information criteria for the comparison of models of the same samples.
//!
//! For Gaussian errors, minus twice the log-likelihood is, up to a constant common to all models of the same samples, the
//! chi-square where sigma is known, and `n ln(SSR/n)` where it is estimated from the residuals. Each criterion adds a penalty for
//! the parameters. The model with the smallest value is preferred; differences below 2 are not significant. **Only differences
//! between values of the same function for the same samples are meaningful.**
//!
//! The number of parameters is real: an integer for a plain fit, the effective number (trace of the matrix from samples to model
//! values) for a penalised one.
//!
//! Sources: H. Akaike, "A new look at the statistical model identification", *IEEE Trans. Automatic
//! Control* 19 (1974) 716-723; G. Schwarz, "Estimating the dimension of a model", *Annals of
//! Statistics* 6 (1978) 461-464; C. M. Hurvich, C.-L. Tsai, "Regression and time series model
//! selection in small samples", *Biometrika* 76 (1989) 297-307.

/// The three criteria of one model, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InformationCriteria {
    /// Akaike information criterion.
    pub aic: f64,
    /// Akaike information criterion corrected for small samples; `None` for too few samples.
    pub aicc: Option<f64>,
    /// Bayesian (Schwarz) information criterion.
    pub bic: f64,
}

/// Criteria for known standard deviations of the samples:
///
/// ```text
/// AIC = chi^2 + 2 p          AICc = AIC          BIC = chi^2 + p ln n
/// ```
///
/// for `n = count` samples and `p = parameters`. The correction of Hurvich and Tsai accounts for the estimation of sigma; with known
/// sigma, AIC is unbiased at any n for a model that is linear in its parameters.
///
/// `None` if there are no samples, or an argument is negative or not finite.
pub fn with_known_sigma(
    chi_square: f64,
    count: usize,
    parameters: f64,
) -> Option<InformationCriteria> {
    is_usable(chi_square, count, parameters).then(|| {
        let aic = chi_square + 2.0 * parameters;
        InformationCriteria {
            aic,
            aicc: Some(aic),
            bic: chi_square + parameters * (count as f64).ln(),
        }
    })
}

/// Criteria where a common standard deviation of all samples is estimated from the residuals, one more parameter,
/// `q = p + 1`:
///
/// ```text
/// AIC  = n ln(SSR/n) + 2 q
/// AICc = AIC + 2 q (q + 1) / (n - q - 1)
/// BIC  = n ln(SSR/n) + q ln n
/// ```
///
/// for the sum of squared residuals `SSR` (unweighted; the unit adds the same constant to all),
/// `n = count` samples and `p = parameters`.
///
/// `None` if there are no samples, an argument is negative or not finite, or the model equals every sample (`SSR = 0`), where sigma
/// cannot be estimated. AICc is `None` unless `n > q + 1`.
pub fn with_estimated_sigma(
    squared_sum: f64,
    count: usize,
    parameters: f64,
) -> Option<InformationCriteria> {
    if squared_sum <= 0.0 || !is_usable(squared_sum, count, parameters) {
        return None;
    }
    let (n, q) = (count as f64, parameters + 1.0);
    let misfit = n * (squared_sum.ln() - n.ln());
    let aic = misfit + 2.0 * q;
    let freedom = n - q - 1.0;
    Some(InformationCriteria {
        aic,
        aicc: (freedom > 0.0).then(|| aic + 2.0 * q * (q + 1.0) / freedom),
        bic: misfit + q * n.ln(),
    })
}

fn is_usable(misfit: f64, count: usize, parameters: f64) -> bool {
    let fine = |x: f64| x.is_finite() && x >= 0.0;
    count > 0 && fine(misfit) && fine(parameters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::white;

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} is not {b}");
    }

    #[test]
    fn by_hand_with_known_sigma() {
        let found = with_known_sigma(90.0, 100, 3.0).unwrap();
        near(found.aic, 96.0);
        near(found.aicc.unwrap(), 96.0);
        near(found.bic, 90.0 + 3.0 * 100.0f64.ln());
    }

    #[test]
    fn by_hand_with_estimated_sigma() {
        let found = with_estimated_sigma(10.0, 10, 2.0).unwrap();
        near(found.aic, 6.0);
        near(found.aicc.unwrap(), 6.0 + 24.0 / 6.0);
        near(found.bic, 3.0 * 10.0f64.ln());
    }

    #[test]
    fn the_unit_of_the_residuals_does_not_decide() {
        let difference = |unit: f64| {
            let squared = |ssr: f64| ssr * unit * unit;
            with_estimated_sigma(squared(4.0), 30, 5.0).unwrap().bic
                - with_estimated_sigma(squared(5.0), 30, 3.0).unwrap().bic
        };
        near(difference(1e-3), difference(1.0));
    }

    /// The criteria estimate the misfit of the fitted model to new samples, here for a mean of `n` samples (one parameter), averaged
    /// over many experiments.
    #[test]
    fn akaikes_criteria_equal_the_expected_misfit_to_new_samples() {
        const N: usize = 8;
        const RUNS: u64 = 40_000;
        let n = N as f64;
        let ([mut known, mut new_known], [mut corrected, mut new_estimated]) = ([0.0; 2], [0.0; 2]);
        for seed in 0..RUNS {
            let drawn = white(seed, 2 * N);
            let (fitted, new) = drawn.split_at(N);
            let mean = fitted.iter().sum::<f64>() / n;
            let squares = |x: &[f64]| x.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
            let (ssr, ssr_new) = (squares(fitted), squares(new));
            known += with_known_sigma(ssr, N, 1.0).unwrap().aic;
            new_known += ssr_new;
            corrected += with_estimated_sigma(ssr, N, 1.0).unwrap().aicc.unwrap();
            // -2 ln L of the new samples, without n ln(2 pi) and the n that AIC drops too.
            new_estimated += n * (ssr / n).ln() + ssr_new / (ssr / n) - n;
        }
        let runs = RUNS as f64;
        let gap = (known - new_known) / runs;
        // Each experiment's difference has a variance of about 4 n + 4: a standard error of 0.03.
        assert!(gap.abs() < 0.12, "{gap}");
        let gap = (corrected - new_estimated) / runs;
        // The ratio ssr_new/ssr has heavy tails: a standard deviation of 15 for one experiment, and so
        // a standard error of 0.076.
        assert!(gap.abs() < 0.3, "{gap}");
    }

    #[test]
    fn criteria_without_degrees_of_freedom_are_absent() {
        assert_eq!(with_known_sigma(1.0, 0, 1.0), None);
        assert_eq!(with_known_sigma(f64::NAN, 9, 1.0), None);
        assert_eq!(with_estimated_sigma(0.0, 9, 1.0), None);
        assert_eq!(with_estimated_sigma(1.0, 9, -1.0), None);
        let few = with_estimated_sigma(1.0, 4, 2.0).unwrap();
        assert_eq!(few.aicc, None);
        assert!(few.bic.is_finite());
    }
}
