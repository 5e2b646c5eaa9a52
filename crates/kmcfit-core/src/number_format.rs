//! Numbers and lists as people write them in a sentence.

use serde::{Deserialize, Deserializer};
use std::borrow::Borrow;

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

/// A number of things: `1 sample`, `3 samples`.
pub fn count(number: usize, thing: &str) -> String {
    match number {
        1 => format!("1 {thing}"),
        _ => format!("{number} {thing}s"),
    }
}

/// A ratio with one decimal, or four significant digits if it is large.
pub fn times_in_words(times: f64) -> String {
    match times < 1e3 {
        true => format!("{times:.1}"),
        false => significant(times, 4),
    }
}

/// Numbers in one notation and with equal decimals, as many as a half-width resolves: two digits of it.
pub fn resolved<const N: usize>(numbers: [f64; N], half: f64) -> [String; N] {
    let order = |x: f64| x.abs().log10().floor();
    let largest = numbers.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    // An interval within the rounding errors of its numbers.
    if half <= 1e-12 * largest {
        return numbers.map(|x| significant(x, 4));
    }
    let decimals = 1.0 - order(half);
    if (1e-3..1e7).contains(&largest) && (..=12.0).contains(&decimals) {
        let decimals = decimals.max(0.0) as usize;
        // Zero has no sign.
        let unit = 0.5 * 0.1f64.powi(decimals as i32);
        return numbers.map(|x| format!("{:.decimals$}", if x.abs() < unit { 0.0 } else { x }));
    }
    let (exponent, decimals) = (order(largest), decimals + order(largest));
    match decimals.is_finite() && (1e-300..1e300).contains(&largest) {
        true => {
            let decimals = decimals.clamp(1.0, 14.0) as usize;
            let unit = 10f64.powi(exponent as i32);
            let smallest = 0.5 * unit * 0.1f64.powi(decimals as i32);
            numbers.map(|x| match x.abs() < smallest {
                true => "0".to_owned(),
                false => format!("{:.decimals$}e{exponent}", x / unit),
            })
        }
        false => numbers.map(|x| significant(x, 4)),
    }
}

/// A percentage; one far below zero in powers of ten.
pub fn percent(share: f64, digits: usize) -> String {
    match share > -1000.0 {
        // Zero has no sign.
        true if share.abs() < 0.5 * 0.1f64.powi(digits as i32) => format!("{:.digits$} %", 0.0),
        true => format!("{share:.digits$} %"),
        false => format!("{share:.0e} %"),
    }
}

/// Enumeration of names: `a`, `a and b`, `a, b and c`.
pub fn and_list<S: Borrow<str>>(names: &[S]) -> String {
    match names {
        [] => String::new(),
        [one] => one.borrow().to_owned(),
        [first @ .., last] => format!("{} and {}", first.join(", "), last.borrow()),
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

    #[test]
    fn intervals_have_one_notation() {
        assert_eq!(
            resolved([4075.2, 4061.0, 4089.4], 14.2),
            ["4075", "4061", "4089"]
        );
        assert_eq!(
            resolved([0.1, -0.0004, 0.2004], 0.1004),
            ["0.10", "0.00", "0.20"]
        );
        assert_eq!(
            resolved([1e-4, 9.8e-5, 1.02e-4], 2e-6),
            ["1.000e-4", "0.980e-4", "1.020e-4"]
        );
        assert_eq!(
            resolved([1.2e8, 1.1e8, 1.3e8], 1e7),
            ["1.20e8", "1.10e8", "1.30e8"]
        );
        let rate = 49.987_496_874_218_6;
        assert_eq!(resolved([rate; 3], 1e-14), ["49.99"; 3]);
        assert_eq!(
            resolved([1e-10, -1.3e-4, 1.3e-4], 1.3e-4),
            ["0", "-1.3e-4", "1.3e-4"]
        );
    }
}
