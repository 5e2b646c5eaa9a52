//! Numbers as people write them in a sentence.

/// So many significant digits, without zeros behind; very small and very large numbers in powers of ten.
pub(crate) fn significant(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    match rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

/// A time to a tenth of a spacing of readings or finer: however late it is, that reading is the one at it, and rounding
/// in its last digits is gone.
pub(crate) fn clock(time: f64, spacing: f64) -> f64 {
    let decimals = (1.0 - spacing.log10().floor()).clamp(0.0, 12.0);
    format!("{time:.*}", decimals as usize)
        .parse()
        .unwrap_or(time)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_keep_their_readings() {
        let read = [
            (1_700_006_005.02, 0.02),
            (100_005.2 + 1e-11, 0.02),
            (0.1 + 0.2, 0.1),
            (1234.0, 500.0),
        ];
        let expected = [1_700_006_005.02, 100_005.2, 0.3, 1234.0];
        assert_eq!(read.map(|(time, spacing)| clock(time, spacing)), expected);
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
