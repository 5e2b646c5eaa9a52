//! Times of a table: strictly increasing ones, and equally spaced ones without their rounding.

use super::Table;
use crate::error::InputError;

/// Largest deviation of a spacing from the step, and of a time from `t_0 + i dt`, relative to the step.
///
/// Times computed as i·dt in double precision deviate from equal spacing by some 1e-16 T, below 1e-10 of a step for up
/// to a million samples. The tolerance accepts times printed with nine or more digits, and its effect on a sample is
/// negligible.
const SPACING_TOLERANCE: f64 = 1e-6;

/// Sampling rates that are accepted, Hz.
///
/// From one sample in 30,000 years to one in a picosecond, so that times, their squares and their reciprocals stay far
/// from overflow and underflow.
pub const SAMPLE_RATES: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// The sampling rates that are accepted, for messages.
pub fn sample_rates() -> String {
    let (least, most) = (SAMPLE_RATES.start(), SAMPLE_RATES.end());
    format!("samples per second, a number from {least:e} to {most:e}")
}

/// The times in a column, strictly increasing.
///
/// # Errors
///
/// When the column cannot be read, or a time is not after the one before.
pub fn increasing<'a>(table: &'a Table, column: &str) -> Result<&'a [f64], InputError> {
    increasing_at(table, table.find(&column.into())?)
}

/// The times in a column, by its index from 0, strictly increasing.
///
/// # Errors
///
/// When the column cannot be read, or a time is not after the one before.
pub fn increasing_at(table: &Table, index: usize) -> Result<&[f64], InputError> {
    let times = table.values(index)?;
    match times.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(times),
        Some(row) => Err(not_increasing(table, &table.label(index), times, row + 1)),
    }
}

/// Fewest times whose rounding is judged, and most decimals of printed times.
const FEWEST: usize = 8;
const MOST_DECIMALS: usize = 12;
/// Rounding of printed times, relative to the step, above which they are no longer equally spaced for certain.
const COARSE: f64 = 0.2;

/// Times `t_i = t_0 + i dt` without the rounding of their printed digits.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactTimes {
    /// The times.
    pub times: Vec<f64>,
    /// Their step.
    pub step: f64,
    /// Decimals with which the largest of them were printed.
    pub digits: usize,
}

/// Times that are equally spaced where all deviations are within the rounding of their printed digits; `None` for others, and for those that
/// are equally spaced as they are.
pub fn without_rounding(times: &[f64]) -> Option<ExactTimes> {
    let (&[first, .., last], count) = (times, times.len()) else {
        return None;
    };
    (count >= FEWEST).then_some(())?;
    let intervals = (count - 1) as f64;
    let chord = (last - first) / intervals;
    let deviation = |step: f64| {
        let off = times.iter().enumerate();
        off.fold(0.0f64, |most, (i, t)| {
            most.max((t - first - i as f64 * step).abs())
        })
    };
    let largest = deviation(chord);
    if largest <= SPACING_TOLERANCE * chord || largest > COARSE * chord {
        return None;
    }
    // Times with as many significant digits are rounded most in the last decade.
    let largest = first.abs().max(last.abs());
    let decade = 10f64.powf(largest.log10().floor());
    let mut coarsest: Vec<f64> = times.to_vec();
    coarsest.retain(|t| t.abs() >= decade);
    let coarsest = match coarsest.len() < FEWEST {
        true => times,
        false => &coarsest,
    };
    let is_printed = |digits: &usize| {
        let scale = 10f64.powi(*digits as i32);
        let is_whole = |t: &f64| {
            let whole = t * scale;
            (whole - whole.round()).abs() <= 1e-3f64.max(4.0 * f64::EPSILON * whole.abs())
        };
        coarsest.iter().all(is_whole)
    };
    let digits = (0..=MOST_DECIMALS).find(is_printed)?;
    let rounding = 10f64.powi(-(digits as i32));
    // The first and the last time are rounded as well. A whole rate within their rounding is the rate.
    let rate = 1.0 / chord;
    let is_whole = (rate.round() / rate - 1.0).abs() <= rounding / (last - first);
    let step = if is_whole { 1.0 / rate.round() } else { chord };
    (deviation(step) <= rounding * 1.001).then(|| ExactTimes {
        times: (0..count).map(|i| first + i as f64 * step).collect(),
        step,
        digits,
    })
}

pub(super) fn not_increasing(table: &Table, column: &str, times: &[f64], row: usize) -> InputError {
    let (before, here) = (times[row - 1], times[row]);
    let problem = match before == here {
        true => "two rows with the same time",
        false => "the times do not increase",
    };
    let row_before = table.row_in_words(row - 1);
    InputError::new(table.location(row, Some(column)), problem)
        .found(format!("{here} after {before} in {row_before}"))
        .expected(format!("a time greater than {before}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_times_are_equally_spaced_within_their_rounding() {
        let printed = |digits: i32, at: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let scale = 10f64.powi(digits);
            (0..500).map(|i| (at(i) * scale).round() / scale).collect()
        };
        let even = |i: usize| i as f64 / 2048.0;
        let found = without_rounding(&printed(6, &even)).unwrap();
        assert_eq!((found.step, found.digits), (1.0 / 2048.0, 6));
        assert_eq!(found.times[499], even(499));
        // Seven significant digits.
        let seven = |i: usize| format!("{:.6e}", i as f64 / 150.0).parse().unwrap();
        let found = without_rounding(&(0..3000).map(seven).collect::<Vec<f64>>()).unwrap();
        assert_eq!((found.step, found.digits), (1.0 / 150.0, 5));
        // A clock that jitters by 2 % of a step is none, nor one with exact times.
        let jitter = |i: usize| even(i) + 1e-5 * (7.0 * i as f64).sin();
        assert_eq!(without_rounding(&printed(6, &jitter)), None);
        assert_eq!(without_rounding(&printed(10, &even)), None);
        assert_eq!(without_rounding(&printed(3, &even)), None);
    }
}
