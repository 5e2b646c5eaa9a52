//! Serialisation of numbers for the script of a page, rounded to the digits that a chart resolves.

use serde::{Serialize, Serializer};

/// Significant digits beyond those that all values of a curve have in common.
const DIGITS: i32 = 6;

/// Abscissae of a curve.
#[derive(PartialEq, Serialize)]
#[serde(untagged)]
enum Abscissae {
    Even { from: f64, step: f64, count: usize },
    Each(Vec<Option<f64>>),
}

impl Abscissae {
    /// Abscissae that are equally spaced to a millionth of a step are stored as their ends.
    fn new(x: &[f64]) -> Self {
        let (Some(from), Some(to)) = (x.first().copied(), x.last().copied()) else {
            return Self::Each(Vec::new());
        };
        let count = x.len();
        let step = (to - from) / (count.max(2) - 1) as f64;
        let close = |(i, x): (usize, &f64)| (x - (from + i as f64 * step)).abs() <= 1e-6 * step;
        match step > 0.0 && x.iter().enumerate().all(close) {
            true => Self::Even { from, step, count },
            false => Self::Each(digits(x)),
        }
    }
}

/// Serialises abscissae.
pub(super) fn places<S: Serializer>(x: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    Abscissae::new(x).serialize(serializer)
}

/// Serialises rounded values.
pub(super) fn rounded<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    digits(values).serialize(serializer)
}

/// Rounds values to a millionth of their range; values that are not finite become `None`.
fn digits(values: &[f64]) -> Vec<Option<f64>> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let common = (low.abs().max(high.abs()) / (high - low)).log10();
    let digits = match common.is_finite() {
        true => DIGITS + common.ceil().clamp(0.0, 10.0) as i32,
        false => DIGITS,
    };
    let open = |v: &f64| v.is_finite().then(|| rounded_to(*v, digits));
    values.iter().map(open).collect()
}

/// The number nearest to the decimal of this many significant digits.
fn rounded_to(value: f64, digits: i32) -> f64 {
    let in_text = || {
        let text = format!("{value:.*e}", digits as usize - 1);
        text.parse().unwrap_or(value)
    };
    quickly_rounded(value, digits).unwrap_or_else(in_text)
}

/// [`rounded_to`] by one product and one quotient with powers of ten that are exact numbers; `None` where their rounding could decide.
fn quickly_rounded(value: f64, digits: i32) -> Option<f64> {
    /// Largest power of ten that is an exact number.
    const EXACT: i32 = 22;
    /// Most digits of a whole number that is exact.
    const WHOLE: i32 = 15;
    if value == 0.0 {
        return Some(value);
    }
    let places = digits - 1 - value.abs().log10().floor() as i32;
    let is_exact = digits <= WHOLE && places.abs() <= EXACT;
    let power = is_exact.then(|| 10f64.powi(places.abs()))?;
    let scaled = match places < 0 {
        true => value / power,
        false => value * power,
    };
    let range = 10f64.powi(digits - 1)..10f64.powi(digits);
    let from_half = ((scaled - scaled.trunc()).abs() - 0.5).abs();
    (range.contains(&scaled.abs()) && from_half > scaled.abs() * f64::EPSILON).then_some(())?;
    Some(match places < 0 {
        true => scaled.round() * power,
        false => scaled.round() / power,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_tell_them_apart() {
        assert_eq!(
            digits(&[1.0 / 3.0, f64::NAN, 1e300]),
            [Some(0.333333), None, Some(1e300)]
        );
        let near = digits(&[1000.0001234567, 1000.0009876543]);
        assert_eq!(near, [Some(1000.000123457), Some(1000.000987654)]);
        assert_eq!(digits(&[2.0; 3]), [Some(2.0); 3]);
        assert_eq!(digits(&[]), []);
    }

    /// Those of the decimals that the standard library writes and reads.
    #[test]
    fn quickly_rounded_numbers_are_those_of_their_decimals() {
        let (mut bits, mut quick) = (1u64, 0);
        for i in 0..60_000 {
            // A full-period generator of Knuth's.
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let share = (bits >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            let near_half = f64::from(i) + 0.5 + f64::from(i % 5 - 2) * 1e-9;
            for value in [
                f64::from_bits(bits),
                share * 10f64.powi(i % 40 - 20),
                near_half,
                near_half * 1e-5,
            ] {
                for digits in [6, 9, 16] {
                    let text = format!("{value:.*e}", digits as usize - 1);
                    let expected: f64 = text.parse().unwrap();
                    let found = value.is_finite().then(|| quickly_rounded(value, digits));
                    if let Some(found) = found.flatten() {
                        quick += 1;
                        assert_eq!(found.to_bits(), expected.to_bits(), "{value:e} {digits}");
                    }
                }
            }
        }
        assert!(quick > 300_000, "{quick}");
    }

    #[test]
    fn even_places_are_written_by_their_ends() {
        let x: Vec<f64> = (0..2000).map(|i| f64::from(i) * 25.0 / 1999.0).collect();
        assert!(matches!(
            Abscissae::new(&x),
            Abscissae::Even { count: 2000, .. }
        ));
        assert!(matches!(
            Abscissae::new(&[0.0, 1.0, 3.0]),
            Abscissae::Each(_)
        ));
        for few in [vec![], vec![1.0], vec![1.0, 1.0], vec![f64::NAN, 1.0]] {
            assert!(
                matches!(Abscissae::new(&few), Abscissae::Each(_)),
                "{few:?}"
            );
        }
    }
}
