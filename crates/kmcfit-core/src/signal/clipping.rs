//! Detection of clipped samples.

/// Smallest number of samples at the limit, and of consecutive ones.
const FEWEST: usize = 8;
const ROW: usize = 3;
/// Ratio of the samples at the limit to those at the next level inwards; a coarsely quantised sine has up to 2.4.
const PILED_UP: usize = 5;
/// Largest share of samples at one limit; a larger share belongs to a sensor at rest or a switch.
const AT_MOST: f64 = 0.5;

/// Number of samples exactly at the largest or smallest value, and that value, if they accumulate there as those of a response
/// beyond the range of the sensor; for both limits, the one with more samples. `None` without clipping.
///
/// ```
/// use kmcfit_core::internals::signal::clipped;
/// let wave: Vec<f64> = (0..400).map(|i| (0.1 * f64::from(i)).sin()).collect();
/// assert_eq!(clipped(&wave), None);
/// let cut: Vec<f64> = wave.iter().map(|y| y.min(0.9)).collect();
/// let (samples, level) = clipped(&cut).expect("it is cut");
/// assert_eq!(level, 0.9);
/// assert_eq!(samples, wave.iter().filter(|y| **y >= 0.9).count());
/// let coarse: Vec<f64> = wave.iter().map(|y| (10.0 * y).round() / 10.0).collect();
/// assert_eq!(clipped(&coarse), None);
/// ```
pub fn clipped(values: &[f64]) -> Option<(usize, f64)> {
    let piled_up = |sign: f64| {
        let top = values.iter().map(|y| sign * y).reduce(f64::max)?;
        let next = values.iter().map(|y| sign * y).filter(|y| *y < top);
        let next = next.reduce(f64::max)?;
        let at = |level: f64| values.iter().filter(|y| sign * *y == level).count();
        let in_a_row = values
            .windows(ROW)
            .any(|row| row.iter().all(|y| sign * y == top));
        let (here, beside) = (at(top), at(next));
        let share = here as f64 / values.len() as f64;
        let is_cut = here >= FEWEST && here >= PILED_UP * beside && in_a_row && share <= AT_MOST;
        is_cut.then_some((here, sign * top))
    };
    let ends = [piled_up(1.0), piled_up(-1.0)];
    ends.into_iter()
        .flatten()
        .max_by_key(|(samples, _)| *samples)
}
