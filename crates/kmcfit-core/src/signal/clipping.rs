//! Detection of clipped samples.

/// Smallest number of samples at the limit, and of consecutive ones.
const FEWEST: usize = 8;
const ROW: usize = 3;
/// Ratio of the samples at the limit to those at the next level inwards; a coarsely quantised sine has up to 2.4.
const PILED_UP: usize = 5;
/// Largest share of samples at one limit; a larger share belongs to a sensor at rest or a switch.
const AT_MOST: f64 = 0.5;

/// Fewest samples at a limit, and their ratio to those at each of the next levels, of samples without quantisation: no two of them are equal
/// by chance.
const FEW: usize = 3;
const LEVELS: usize = 3;
/// Smallest change beside a cut sample, in quantisation steps: beside the peak of a slowly sampled wave it is one or two.
const CHANGE: f64 = 10.0;
/// Samples on either side of a cut sample in which the signal moves, and their smallest path relative to the range of the signal.
const NEIGHBOURS: usize = 5;
const MOVES: f64 = 0.02;

/// Largest and smallest value of the samples where they are cut off there, as beyond the range of a sensor or an amplifier: as by
/// [`clipped`], or for samples without quantisation, or with one finer than a thousandth of their range, at least three times as many samples
/// as at each of the next levels. Constant levels of a step or a square wave are none; `step` is the quantisation step, 0 where unknown.
pub fn cut_off(values: &[f64], step: f64) -> Vec<f64> {
    let ends = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |r, y| {
            [r[0].min(*y), r[1].max(*y)]
        });
    let range = ends[1] - ends[0];
    let mut levels: Vec<f64> = Vec::new();
    if let Some((_, level)) = clipped(values) {
        levels.push(level);
        let others: Vec<f64> = values.iter().copied().filter(|y| *y != level).collect();
        levels.extend(clipped(&others).map(|(_, level)| level));
    }
    let is_fine = step < 1e-3 * range;
    let fine = ends
        .into_iter()
        .filter(|level| is_fine && is_cut_finely(values, *level, step));
    for level in fine {
        if !levels.contains(&level) {
            levels.push(level);
        }
    }
    levels.retain(|level| moves_beside(values, *level, MOVES * range));
    levels
}

/// True for more samples at an extreme level than at the next ones, with a change beside them that no peak has.
fn is_cut_finely(values: &[f64], level: f64, step: f64) -> bool {
    if values.iter().filter(|y| **y == level).count() < FEW {
        return false;
    }
    let mut near: Vec<f64> = values.to_vec();
    near.sort_by(|a, b| (a - level).abs().total_cmp(&(b - level).abs()));
    let mut counts = near.chunk_by(|a, b| a == b).map(<[f64]>::len);
    let here = counts.next().unwrap_or(0);
    let next = counts.take(LEVELS).max().unwrap_or(0);
    let changes = values
        .windows(2)
        .filter(|w| (w[0] == level) != (w[1] == level));
    let largest = changes.map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    here >= FEW * next && largest > CHANGE * step
}

/// True if the signal moves on both sides of a sample at a level.
fn moves_beside(values: &[f64], level: f64, least: f64) -> bool {
    let path = |part: &[f64]| {
        let changes = part.windows(2).map(|w| (w[1] - w[0]).abs());
        let largest = changes.clone().fold(0.0, f64::max);
        changes.sum::<f64>() - largest
    };
    let mut row = 0;
    values.chunk_by(|a, b| a == b).any(|same| {
        let (from, to) = (row, row + same.len());
        row = to;
        let before = &values[from.saturating_sub(NEIGHBOURS)..from];
        let after = &values[to..(to + NEIGHBOURS).min(values.len())];
        same[0] == level && path(before) > least && path(after) > least
    })
}

/// Number of samples exactly at the largest or smallest value, and that value, if they accumulate there as those of a response
/// beyond the range of the sensor; for both limits, the one with more samples. `None` without clipping.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(per_period: f64, round: f64) -> Vec<f64> {
        let at = |i: i32| (std::f64::consts::TAU * f64::from(i) / per_period).sin();
        let rounded = |y: f64| (y / round).round() * round;
        (0..400).map(|i| rounded(at(i))).collect()
    }

    #[test]
    fn a_cut_wave_is_clipped_and_a_coarse_one_is_not() {
        let wave: Vec<f64> = (0..400).map(|i| (0.1 * f64::from(i)).sin()).collect();
        assert_eq!(clipped(&wave), None);
        let cut: Vec<f64> = wave.iter().map(|y| y.min(0.9)).collect();
        let (samples, level) = clipped(&cut).expect("it is cut");
        assert_eq!(level, 0.9);
        assert_eq!(samples, wave.iter().filter(|y| **y >= 0.9).count());
        let coarse: Vec<f64> = wave.iter().map(|y| (10.0 * y).round() / 10.0).collect();
        assert_eq!(clipped(&coarse), None);
    }

    #[test]
    fn few_cut_samples_are_found_and_periodic_peaks_are_not() {
        for per_period in [8.0, 20.0, 33.3, 400.0] {
            for round in [1e-9, 1e-6, 1e-4, 0.02] {
                let clean = wave(per_period, round);
                let step = crate::signal::quantisation(&clean).unwrap_or(0.0);
                assert!(cut_off(&clean, step).is_empty(), "{per_period} {round}");
            }
        }
        let noisy: Vec<f64> = (0..400)
            .map(|i| {
                (0.31 * f64::from(i)).sin() * (1.0 + 0.1 * (0.017 * f64::from(i * i % 97)).cos())
            })
            .collect();
        let largest = noisy.iter().fold(0.0f64, |m, y| m.max(*y));
        let cut: Vec<f64> = noisy
            .iter()
            .map(|y| y.clamp(-0.97 * largest, 0.93 * largest))
            .collect();
        assert!(cut_off(&noisy, 0.0).is_empty());
        assert!(cut_off(&cut, 0.0).contains(&(0.93 * largest)));
    }

    #[test]
    fn steps_and_square_waves_are_not_cut() {
        let square: Vec<f64> = (0..400).map(|i| f64::from(i / 40 % 2)).collect();
        let step: Vec<f64> = (0..400).map(|i| f64::from(i32::from(i > 300))).collect();
        for values in [square, step] {
            assert!(cut_off(&values, 0.0).is_empty());
        }
    }
}
