//! Ljung–Box test of whiteness: residuals of a correct model with independent errors are white.

use super::Autocorrelation;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Significance level of the test.
pub const SIGNIFICANCE: f64 = 0.05;
/// Smallest number of samples for a test.
pub const FEWEST_SAMPLES: usize = 20;

/// Outcome of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WhitenessResult {
    /// Whiteness is not rejected.
    White,
    /// Neighbouring residuals are correlated: the autocorrelation is outside the band at every lag up to this time, in the unit of the
    /// step. For an oscillation this is less than a quarter of the period.
    CorrelatedOver(f64),
    /// Neighbouring residuals are not correlated, but residuals at this distance, in the unit of the step, are, more than at any other
    /// lag.
    CorrelatedAt(f64),
    /// Not tested, for this reason.
    Untested(UntestedReason),
}

/// Reason for an omitted test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UntestedReason {
    /// Fewer than [`FEWEST_SAMPLES`].
    FewSamples,
    /// No more lags with pairs than fitted parameters of the noise.
    FewLags,
    /// All residuals are zero: the model equals every sample.
    NoResiduals,
}

/// Result of the test; `Display` gives a sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct Whiteness {
    /// The Ljung-Box statistic `Q`; 0 if untested.
    pub statistic: f64,
    /// Degrees of freedom: lags minus parameters of the noise; 0 if untested.
    pub degrees_of_freedom: usize,
    /// p-value: probability of a statistic at least as large for white residuals; 1 if untested.
    pub p_value: f64,
    /// Share of the lags from 1 on outside their band; about 0.05 for white noise.
    pub share_outside: f64,
    /// Outcome.
    pub verdict: WhitenessResult,
}

/// Ljung–Box test on all lags from 1 of an autocorrelation, with lag 1 equal to `step` (s, or any unit):
///
/// ```text
/// Q = n (n + 2) sum over k of (S_k/S_0)^2 / n_k,        S_k/S_0 = r_k (n_k + k) / n
/// ```
///
/// For white noise `Q` is chi-square with (lags minus `fitted`) degrees of freedom. Without missing values, `n_k = n - k` and `Q` is
/// the statistic of Ljung and Box; with `n_k` pairs the expectation of `(S_k/S_0)^2` is preserved. Lags without pairs are omitted.
///
/// `fitted` is the number of parameters of a model *of the noise* (coefficients of an autoregression whose innovations are
/// tested). Parameters of mass, damping and stiffness do not count: use 0.
///
/// The test assumes independent errors of equal size; divide residuals by sigma if it varies.
///
/// Sources: G. M. Ljung, G. E. P. Box, "On a measure of lack of fit in time series models",
/// *Biometrika* 65 (1978) 297-303; D. S. Stoffer, C. M. C. Toloi, "A note on the
/// Ljung-Box-Pierce portmanteau statistic with missing data", *Statistics & Probability Letters* 13
/// (1992) 391-396.
pub fn whiteness(autocorrelation: &Autocorrelation, step: f64, fitted: usize) -> Whiteness {
    let paired = |lag: &usize| autocorrelation.pairs.get(*lag).is_some_and(|n| *n > 0);
    let lags: Vec<usize> = (1..=autocorrelation.lags()).filter(paired).collect();
    let outside = (lags.iter()).filter(|lag| autocorrelation.is_outside(**lag));
    let share_outside = outside.count() as f64 / lags.len().max(1) as f64;
    let reason = if autocorrelation.count < FEWEST_SAMPLES {
        Some(UntestedReason::FewSamples)
    } else if !autocorrelation.is_defined() {
        Some(UntestedReason::NoResiduals)
    } else {
        (lags.len() <= fitted).then_some(UntestedReason::FewLags)
    };
    if let Some(reason) = reason {
        return Whiteness {
            statistic: 0.0,
            degrees_of_freedom: 0,
            p_value: 1.0,
            share_outside,
            verdict: WhitenessResult::Untested(reason),
        };
    }
    let statistic = ljung_box(autocorrelation, &lags);
    let degrees_of_freedom = lags.len() - fitted;
    let p_value = probability_above(statistic, degrees_of_freedom);
    Whiteness {
        statistic,
        degrees_of_freedom,
        p_value,
        share_outside,
        verdict: if p_value < SIGNIFICANCE {
            correlated(autocorrelation, &lags, step)
        } else {
            WhitenessResult::White
        },
    }
}

fn ljung_box(autocorrelation: &Autocorrelation, lags: &[usize]) -> f64 {
    let n = autocorrelation.count as f64;
    let terms = lags.iter().map(|&lag| {
        let pairs = autocorrelation.pairs[lag] as f64;
        let share = autocorrelation.values[lag] * (pairs + lag as f64) / n;
        share * share / pairs
    });
    n * (n + 2.0) * terms.sum::<f64>()
}

/// Probability `P(chi-square > statistic)`.
fn probability_above(statistic: f64, degrees_of_freedom: usize) -> f64 {
    ChiSquared::new(degrees_of_freedom as f64).map_or(1.0, |law| law.sf(statistic))
}

/// Extent of the correlation.
fn correlated(autocorrelation: &Autocorrelation, lags: &[usize], step: f64) -> WhitenessResult {
    let leading = (1..=autocorrelation.lags()).take_while(|lag| autocorrelation.is_outside(*lag));
    let reach = leading.count();
    if reach > 0 {
        return WhitenessResult::CorrelatedOver(reach as f64 * step);
    }
    let size = |lag: &usize| autocorrelation.values[*lag].abs();
    let most = (lags.iter().copied()).max_by(|a, b| size(a).total_cmp(&size(b)));
    WhitenessResult::CorrelatedAt(most.unwrap_or(0) as f64 * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::{auto_regression, white};
    use crate::diagnostics::{autocorrelation, default_lags};

    fn test(values: &[f64]) -> Whiteness {
        whiteness(&autocorrelation(values, default_lags(values.len())), 0.1, 0)
    }

    fn rejections(sequence: impl Fn(u64) -> Vec<f64>) -> usize {
        (0..200)
            .filter(|seed| test(&sequence(*seed)).p_value < SIGNIFICANCE)
            .count()
    }

    #[test]
    fn the_statistic_by_hand() {
        // Lags 1 and 2 of alternating signs: S_k/S_0 = (-1)^k (n - k)/n.
        let values: Vec<f64> = (0..20)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let found = test(&values);
        let q = 20.0 * 22.0 * (19.0 / 400.0 + 18.0 / 400.0);
        assert!((found.statistic - q).abs() < 1e-10, "{}", found.statistic);
        // With two degrees of freedom the probability is exp(-Q/2).
        assert_eq!(found.degrees_of_freedom, 2);
        assert!((found.p_value / (-q / 2.0).exp() - 1.0).abs() < 1e-9);
        assert_eq!(found.share_outside, 1.0);
    }

    #[test]
    fn chi_square_from_tables() {
        // The upper 5 %, 1 % and 0.1 % points (NIST/SEMATECH e-Handbook, 1.3.6.7.4).
        for (freedom, point, p) in [
            (1, 3.841, 0.05),
            (10, 18.307, 0.05),
            (10, 23.209, 0.01),
            (20, 45.315, 0.001),
            (50, 67.505, 0.05),
            (50, 86.661, 0.001),
        ] {
            let found = probability_above(point, freedom);
            assert!((found / p - 1.0).abs() < 1e-3, "{freedom} {point}: {found}");
        }
        assert_eq!(probability_above(0.0, 5), 1.0);
        // Far out it is small, not negative or NaN.
        let far = probability_above(1e4, 50);
        assert!((0.0..1e-300).contains(&far), "{far}");
    }

    /// Rejections of 200 white sequences: the level is 0.05 to 0.065 ([`default_lags`]), and the
    /// number then lies in this range with probability 0.998 or more (binomial law).
    const REJECTED_BY_CHANCE: std::ops::RangeInclusive<usize> = 2..=24;

    #[test]
    fn white_noise_is_rejected_one_time_in_twenty() {
        for count in [30, 100, 1000] {
            let rejected = rejections(|seed| white(seed + count as u64 * 1000, count));
            assert!(
                REJECTED_BY_CHANCE.contains(&rejected),
                "{count}: {rejected}"
            );
        }
    }

    #[test]
    fn gaps_do_not_change_the_level() {
        let rejected = rejections(|seed| {
            let mut values = white(seed, 1000);
            for start in (0..1000).step_by(25) {
                values[start..start + 1 + start % 11].fill(f64::NAN);
            }
            values
        });
        assert!(REJECTED_BY_CHANCE.contains(&rejected), "{rejected}");
    }

    #[test]
    fn coloured_noise_is_rejected() {
        // r_1 = 0.3 with a standard error of 0.03: ten of them away.
        assert_eq!(rejections(|seed| auto_regression(seed, 1000, 0.3)), 200);
        assert_eq!(rejections(|seed| auto_regression(seed, 1000, -0.3)), 200);
    }

    #[test]
    fn the_p_value_of_white_noise_is_uniform() {
        // The mean of 200 uniform numbers is 0.5 with a standard error of 0.0204.
        let values = (0..200).map(|seed| test(&white(seed, 400)).p_value);
        let mean = values.sum::<f64>() / 200.0;
        assert!((mean - 0.5).abs() < 4.0 * 0.0204, "{mean}");
    }

    #[test]
    fn parameters_of_the_noise_reduce_the_degrees_of_freedom() {
        let r = autocorrelation(&white(1, 100), 10);
        let [none, one] = [0, 1].map(|fitted| whiteness(&r, 1.0, fitted));
        assert_eq!(none.statistic, one.statistic);
        assert_eq!([none.degrees_of_freedom, one.degrees_of_freedom], [10, 9]);
        assert!(one.p_value < none.p_value);
        let all = whiteness(&r, 1.0, 10);
        assert_eq!(
            all.verdict,
            WhitenessResult::Untested(UntestedReason::FewLags)
        );
    }

    #[test]
    fn an_offset_is_detected() {
        let values: Vec<f64> = white(2, 500).iter().map(|x| x + 0.5).collect();
        assert!(test(&values).p_value < 1e-6);
    }

    #[test]
    fn the_extent_of_a_correlation_is_reported() {
        let found = |values: &[f64]| {
            let r = Autocorrelation {
                values: values.to_vec(),
                pairs: (0..values.len()).map(|lag| 400 - lag).collect(),
                count: 400,
            };
            whiteness(&r, 0.5, 0).verdict
        };
        // The band is 0.098.
        assert_eq!(found(&[1.0, 0.05, -0.05, 0.0]), WhitenessResult::White);
        assert_eq!(
            found(&[1.0, 0.6, -0.3, 0.0, 0.2]),
            WhitenessResult::CorrelatedOver(1.0)
        );
        assert_eq!(
            found(&[1.0, 0.05, 0.2, -0.4, 0.1]),
            WhitenessResult::CorrelatedAt(1.5)
        );
    }
}
