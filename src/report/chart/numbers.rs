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
    let round = |v: f64| format!("{v:.*e}", digits as usize - 1).parse().unwrap_or(v);
    let open = |v: &f64| v.is_finite().then(|| round(*v));
    values.iter().map(open).collect()
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
