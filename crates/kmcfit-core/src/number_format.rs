//! Numbers as people write them in a sentence.

use serde::{Deserialize, Deserializer};

/// A number with `digits` significant digits, without trailing zeros; very small and very large numbers in powers of
/// ten.
pub fn significant(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    match rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

/// The smallest number with `digits` significant digits that is not below a positive `x`, without powers of ten from 1e-6: an upper
/// limit.
pub fn at_most(x: f64, digits: usize) -> String {
    let nearest: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    let unit = 10f64.powf(nearest.abs().log10().floor() + 1.0 - digits as f64);
    let up = match nearest < x && unit.is_finite() {
        true => nearest + unit,
        false => nearest,
    };
    match (1e-6..1e-4).contains(&up) {
        true => {
            let decimals = digits as f64 - 1.0 - up.log10().floor();
            format!("{up:.*}", decimals.clamp(0.0, 12.0) as usize)
        }
        false => significant(up, digits),
    }
}

/// Reads a number; NaN for JSON's `null`, which stands for numbers that are not finite.
pub fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upper_limits_are_not_below_the_number() {
        let written =
            [0.0, 0.0501, 0.050, 1e-5, 0.00104, 9.96, 1.71e-5, 3e-9].map(|x| at_most(x, 2));
        assert_eq!(
            written,
            [
                "0", "0.051", "0.05", "0.000010", "0.0011", "10", "0.000018", "3e-9"
            ]
        );
    }

    #[test]
    fn numbers_of_any_size() {
        let written = [0.0, 1.0, -12_345.678, 2.5e-5, 1e300, 0.1 + 0.2, 9_999_999.0]
            .map(|x| significant(x, 4));
        assert_eq!(
            written,
            ["0", "1", "-12350", "2.5e-5", "1e300", "0.3", "1e7"]
        );
    }
}
