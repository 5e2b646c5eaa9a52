//! Numbers as people write them in a sentence.

pub(crate) use kmcfit_core::number_format::{at_most, significant};

/// A number of things: `1 sample`, `3 samples`.
pub(crate) fn count(number: usize, thing: &str) -> String {
    match number {
        1 => format!("1 {thing}"),
        _ => format!("{number} {thing}s"),
    }
}

/// A ratio with one decimal, or four significant digits if it is large.
pub(crate) fn times_in_words(times: f64) -> String {
    match times < 1e3 {
        true => format!("{times:.1}"),
        false => significant(times, 4),
    }
}

/// Numbers in one notation and with equal decimals, as many as a half-width resolves: two digits of it.
pub(crate) fn resolved<const N: usize>(numbers: [f64; N], half: f64) -> [String; N] {
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

#[cfg(test)]
mod tests {
    use super::*;

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
