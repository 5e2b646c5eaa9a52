//! Sentences of the whiteness test.

use super::{FEWEST_SAMPLES, UntestedReason, Whiteness, WhitenessResult};
use std::fmt;

/// Probability below which a bound is printed.
const SMALLEST_PRINTED: f64 = 1e-6;

impl fmt::Display for Whiteness {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let p = Probability(self.p_value);
        let over = match self.verdict {
            WhitenessResult::White => {
                return write!(f, "no significant autocorrelation of the residuals ({p})");
            }
            WhitenessResult::Untested(reason) => {
                return write!(f, "the residuals were not tested: {reason}");
            }
            WhitenessResult::CorrelatedOver(time) => format!("up to a lag of {} s", short(time)),
            WhitenessResult::CorrelatedAt(time) => format!("at a lag of {} s", short(time)),
        };
        write!(
            f,
            "the residuals are autocorrelated {over} ({p}): \
             the model is incomplete or the noise is coloured"
        )
    }
}

impl fmt::Display for UntestedReason {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            UntestedReason::FewSamples => {
                write!(f, "there are fewer than {FEWEST_SAMPLES} samples")
            }
            UntestedReason::FewLags => {
                write!(
                    f,
                    "the noise model has too many parameters for the number of lags"
                )
            }
            UntestedReason::NoResiduals => write!(f, "all residuals are zero"),
        }
    }
}

/// `p = 0.43`, or `p < 1e-6`.
struct Probability(f64);

impl fmt::Display for Probability {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.0 < SMALLEST_PRINTED {
            write!(f, "p < {SMALLEST_PRINTED:e}")
        } else {
            write!(f, "p = {}", short(self.0))
        }
    }
}

/// Two significant digits, as `12`, `0.043` or `4.3e-5`.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e4).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::{autocorrelation, default_lags, whiteness};

    fn test(values: &[f64]) -> Whiteness {
        let lags = default_lags(values.len());
        whiteness(&autocorrelation(values, lags), 0.1, 0)
    }

    #[test]
    fn outcomes_are_sentences() {
        let white = Whiteness {
            statistic: 10.2,
            degrees_of_freedom: 10,
            p_value: 0.4263,
            share_outside: 0.0,
            verdict: WhitenessResult::White,
        };
        assert_eq!(
            white.to_string(),
            "no significant autocorrelation of the residuals (p = 0.43)"
        );
        let sine: Vec<f64> = (0..600).map(|i| (f64::from(i) * 0.4).sin()).collect();
        // Its autocorrelation is a cosine: cos 1.2 = 0.36 is outside the band of 0.08, cos 1.6 inside.
        assert_eq!(
            test(&sine).to_string(),
            "the residuals are autocorrelated up to a lag of 0.3 s (p < 1e-6): \
             the model is incomplete or the noise is coloured"
        );
        let at = Whiteness {
            p_value: 0.012,
            verdict: WhitenessResult::CorrelatedAt(1.5),
            ..white
        };
        assert_eq!(
            at.to_string(),
            "the residuals are autocorrelated at a lag of 1.5 s (p = 0.012): \
             the model is incomplete or the noise is coloured"
        );
    }

    #[test]
    fn omitted_tests_state_their_reason() {
        let say = |values: &[f64]| test(values).to_string();
        assert_eq!(
            say(&[1.0; 19]),
            "the residuals were not tested: there are fewer than 20 samples"
        );
        assert_eq!(
            say(&[0.0; 40]),
            "the residuals were not tested: all residuals are zero"
        );
    }

    #[test]
    fn digits() {
        let said = [0.4321, 0.05, 4.32e-5, 12.3, 0.30000000000000004].map(short);
        assert_eq!(said, ["0.43", "0.05", "4.3e-5", "12", "0.3"]);
        assert_eq!(Probability(3e-7).to_string(), "p < 1e-6");
        assert_eq!(Probability(0.0012).to_string(), "p = 0.0012");
    }
}
