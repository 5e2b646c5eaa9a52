//! Numbers as people write them in a sentence.

/// A number with `digits` significant digits, without trailing zeros; very small and very large numbers in powers of
/// ten.
pub fn significant(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    match rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
