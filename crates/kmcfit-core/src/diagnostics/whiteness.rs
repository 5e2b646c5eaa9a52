//! Whether residuals are white: what a right model leaves of samples with independent errors.

use super::Autocorrelation;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Residuals whose probability under whiteness is below this are called correlated: one white
/// sequence in twenty is, wrongly.
pub const SIGNIFICANCE: f64 = 0.05;
/// With fewer samples nothing is said.
pub const FEWEST_READINGS: usize = 20;

/// The outcome of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WhitenessResult {
    /// Nothing speaks against whiteness.
    White,
    /// Neighbours are alike: every lag up to this time, in the unit of the step, is outside the
    /// band. Residuals that oscillate cross zero after a quarter of their period.
    CorrelatedOver(f64),
    /// Neighbours are not alike, but samples this far apart, in the unit of the step, are, more
    /// than at any other lag.
    CorrelatedAt(f64),
    /// Nothing can be said, for this reason.
    Untested(UntestedReason),
}

/// Why residuals were not tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UntestedReason {
    /// Fewer than [`FEWEST_READINGS`].
    FewReadings,
    /// No more lags with a pair of samples than fitted parameters of the noise.
    FewLags,
    /// All are zero: the model goes through every sample.
    NoResiduals,
}

/// The test of whiteness, its numbers and its verdict; its `Display` says it in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Whiteness {
    /// The Ljung-Box statistic `Q`; 0 if untested.
    pub statistic: f64,
    /// Its degrees of freedom: lags less parameters of the noise; 0 if untested.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic as large or larger if the residuals are white; 1 if untested.
    pub p_value: f64,
    /// Share of the lags from 1 on that are outside their band; of white noise it is 0.05 or so.
    pub share_outside: f64,
    /// What follows.
    pub verdict: WhitenessResult,
}

/// The test of Ljung and Box on all lags from 1 on of an autocorrelation, where lag 1 is `step`
/// (s, or any unit):
///
/// ```text
/// Q = n (n + 2) sum over k of (S_k/S_0)^2 / n_k,        S_k/S_0 = r_k (n_k + k) / n
/// ```
///
/// which is chi-square with (lags less `fitted`) degrees of freedom for white noise. Nothing
/// missing, `n_k = n - k` and `Q` is the statistic as Ljung and Box give it; with `n_k` pairs
/// instead, `(S_k/S_0)^2` keeps its expectation. Lags without a pair are left out.
///
/// `fitted` counts parameters of a model *of the noise* (the coefficients of an autoregression whose
/// shocks these are). The parameters of mass, damping and stiffness are not among them: use 0.
///
/// The test holds for independent errors of one size; divide residuals by sigma if it varies.
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
    let reason = if autocorrelation.count < FEWEST_READINGS {
        Some(UntestedReason::FewReadings)
    } else if !autocorrelation.varies() {
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

/// `P(chi-square > statistic)`.
fn probability_above(statistic: f64, degrees_of_freedom: usize) -> f64 {
    ChiSquared::new(degrees_of_freedom as f64).map_or(1.0, |law| law.sf(statistic))
}

/// How far the correlation reaches.
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
    fn gaps_leave_the_level_as_it_is() {
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
    fn parameters_of_the_noise_take_degrees_of_freedom() {
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
    fn an_offset_is_seen() {
        let values: Vec<f64> = white(2, 500).iter().map(|x| x + 0.5).collect();
        assert!(test(&values).p_value < 1e-6);
    }

    #[test]
    fn the_reach_of_a_correlation() {
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
