//! Lowest and highest value of a series.

use std::ops::RangeInclusive;

/// Values that are compared side by side.
const LANES: usize = 8;

/// Lowest and highest value of a series within limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Lowest value; infinite where no value is within the limits.
    pub low: f64,
    /// Highest value; negative infinite where no value is within the limits.
    pub high: f64,
    /// True if all values are within the limits.
    pub are_all_within: bool,
}

impl Extremes {
    /// Extremes of the values within the limits `within`; NaN is not.
    ///
    /// ```
    /// use kmcfit_core::signal::Extremes;
    /// let found = Extremes::of(&[2.0, -3.0, f64::NAN, 7.0], -5.0..=5.0);
    /// assert_eq!((found.low, found.high, found.are_all_within), (-3.0, 2.0, false));
    /// ```
    pub fn of(values: &[f64], within: RangeInclusive<f64>) -> Self {
        let (least, most) = (*within.start(), *within.end());
        // Comparisons are false for NaN.
        let kept = |value: f64| match least <= value && value <= most {
            true => value,
            false => f64::NAN,
        };
        let lower = |a: f64, b: f64| if b < a { b } else { a };
        let higher = |a: f64, b: f64| if b > a { b } else { a };
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let mut outside = [false; LANES];
        let (chunks, rest) = values.as_chunks::<LANES>();
        for chunk in chunks {
            for lane in 0..LANES {
                let value = kept(chunk[lane]);
                low[lane] = lower(low[lane], value);
                high[lane] = higher(high[lane], value);
                outside[lane] |= value.is_nan();
            }
        }
        let rest = rest.iter().map(|value| kept(*value));
        Self {
            low: (low.into_iter().chain(rest.clone())).fold(f64::INFINITY, lower),
            high: (high.into_iter().chain(rest.clone())).fold(f64::NEG_INFINITY, higher),
            are_all_within: !outside.contains(&true) && !rest.clone().any(f64::is_nan),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with a fold over the values, for every length of the last chunk and every place of an extreme and of a value outside.
    #[test]
    fn extremes_are_those_of_every_value() {
        for count in 0..20 {
            for position in 0..count.max(1) {
                for odd in [-9.0, 9.0, f64::NAN, f64::INFINITY, -20.0, 20.0] {
                    let mut values: Vec<f64> = (0..count).map(|i| f64::from(i * 7 % 5)).collect();
                    if let Some(value) = values.get_mut(position as usize) {
                        *value = odd;
                    }
                    let found = Extremes::of(&values, -10.0..=10.0);
                    let inside = values.iter().filter(|v| v.abs() <= 10.0);
                    let low = inside.clone().fold(f64::INFINITY, |low, v| low.min(*v));
                    let high = inside
                        .clone()
                        .fold(f64::NEG_INFINITY, |high, v| high.max(*v));
                    assert_eq!((found.low, found.high), (low, high), "{values:?}");
                    assert_eq!(found.are_all_within, inside.count() == values.len());
                }
            }
        }
    }
}
