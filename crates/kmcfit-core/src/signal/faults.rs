//! Faults of a record: samples held at a constant value, and isolated spikes.

use super::median;
use std::ops::Range;

/// Fewest equal samples in a row, and the largest share of a record in such rows: a larger one is a piecewise constant signal.
const ROW: usize = 5;
const MOST_HELD: f64 = 0.5;
/// Share of the samples at one value above which two rows of it are rests.
const REST: f64 = 0.2;
/// Path beside a row, in quantisation steps, above which quantisation does not explain it: a peak of a quantised sine as wide as the row
/// has a path of 4 to 5 steps.
const FAR: f64 = 30.0;
/// The same where the signal also jumps at an end of the row, by this multiple of a usual change.
const NEAR: f64 = 6.0;
const JUMP: f64 = 4.0;
/// Share of the range of the samples below which a path is rest.
const AT_REST: f64 = 0.02;
/// Distance of a spike from the curve through its neighbours, in robust standard deviations of such distances.
const SPIKE: f64 = 8.0;
/// The same distance in deviations of the samples around, which are few: their deviation is uncertain by a fifth.
const SPIKE_BESIDE: f64 = 5.5;
/// Distances of the neighbours of a single wrong sample relative to its own: -2/3 up to the noise.
const SINGLE: std::ops::RangeInclusive<f64> = -0.93..=-0.4;
/// Distance of a spike from the lines through the two samples before and after it, relative to that from the cubic.
const OFF_LINE: f64 = 0.5;
/// Samples on either side of a spike of which the deviations are compared.
const NEIGHBOURS: usize = 20;
/// Ratio of the median absolute value to the standard deviation of Gaussian noise.
const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// Rows of at least five equal samples in a signal that moves before and after them, longer than its quantisation explains: a logger or a
/// transmission that held its last value. `step` is the quantisation step, 0 where unknown.
///
/// A record that begins with a row is at rest there. Rests between pulses (two rows at the value of a fifth of the samples) and piecewise
/// constant signals are no dropouts.
pub fn dropouts(values: &[f64], step: f64) -> Vec<Range<usize>> {
    let rows: Vec<Range<usize>> = (values.chunk_by(|a, b| a == b))
        .scan(0, |from, row| {
            let start = *from;
            *from += row.len();
            Some(start..*from)
        })
        .filter(|row| row.len() >= ROW)
        .collect();
    let held: usize = rows.iter().map(ExactSizeIterator::len).sum();
    if held as f64 > MOST_HELD * values.len() as f64 {
        return Vec::new();
    }
    let range = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |r, y| {
            [r[0].min(*y), r[1].max(*y)]
        });
    let least = AT_REST * (range[1] - range[0]);
    let is_rest = |level: f64| {
        let all = values.iter().filter(|y| **y == level).count();
        let same = rows.iter().filter(|row| values[row.start] == level).count();
        same > 1 && all as f64 > REST * values.len() as f64
    };
    let is_held = |row: &&Range<usize>| {
        row.start > 0 && explains_nothing(values, row, step, least) && !is_rest(values[row.start])
    };
    rows.iter().filter(is_held).cloned().collect()
}

/// True for a row that neither rest nor quantisation explains.
fn explains_nothing(values: &[f64], row: &Range<usize>, step: f64, least: f64) -> bool {
    let long = row.len();
    let before = &values[row.start.saturating_sub(long)..=row.start];
    let after = &values[row.end - 1..(row.end + long).min(values.len())];
    let sides = [before, after].map(Side::of);
    let existing = || sides.iter().filter(|side| side.changes > 0);
    let path = existing()
        .map(|side| side.path)
        .fold(f64::INFINITY, f64::min);
    let jump = [before.last_chunk::<2>(), after.first_chunk::<2>()];
    let jump = jump.into_iter().flatten().map(|[a, b]| (b - a).abs());
    let usual = existing().map(Side::usual).fold(0.0, f64::max);
    let jumps = jump.fold(0.0, f64::max) > (JUMP * usual).max(JUMP * step);
    path > least && (path > FAR * step || jumps && path > NEAR * step)
}

/// Changes of the samples beside a row, without the largest one, which may be a step of the signal.
struct Side {
    path: f64,
    changes: usize,
}

impl Side {
    fn of(values: &[f64]) -> Self {
        let changes = values.windows(2).map(|w| (w[1] - w[0]).abs());
        let largest = changes.clone().fold(0.0, f64::max);
        Self {
            path: changes.sum::<f64>() - largest,
            changes: values.len() - 1,
        }
    }

    fn usual(&self) -> f64 {
        self.path / self.changes.saturating_sub(1).max(1) as f64
    }
}

/// Indices of single samples far from the cubic through two neighbours on either side, at the times of a clock that may jitter: by eight
/// robust standard deviations of such distances in the whole record and by 5.5 of those in the 40 samples around, and with the neighbours'
/// own distances those of a single wrong sample, `-2/3` of its own. Impacts and steps of several samples have others.
pub fn spikes(times: &[f64], values: &[f64]) -> Vec<usize> {
    let windows = times.windows(5).zip(values.windows(5));
    let distances: Vec<f64> = windows.map(|(t, x)| off_cubic(t, x)).collect();
    if distances.len() <= 2 * NEIGHBOURS {
        return Vec::new();
    }
    let deviation = |part: &[f64]| {
        let sizes: Vec<f64> = part.iter().map(|d| d.abs()).collect();
        MEDIAN_TO_SIGMA * median(sizes)
    };
    let of_all = deviation(&distances);
    let is_spike = |i: &usize| {
        let own = distances[*i];
        if own.abs() <= SPIKE * of_all || !is_even(&times[*i..*i + 5]) {
            return false;
        }
        // The last sample before an impact lies on the line through those before it, the first after a step on the one through those after it.
        let [a, b, here, c, d] = std::array::from_fn(|k| values[i + k]);
        let misses = |line: f64| (here - line).abs() > OFF_LINE * own.abs();
        if !misses(2.0 * b - a) || !misses(2.0 * c - d) {
            return false;
        }
        let around = i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(distances.len());
        let beside = [i.checked_sub(1), Some(i + 1)].map(|i| i.and_then(|i| distances.get(i)));
        // Both have -2/3 of its distance, up to the noise.
        let is_single = beside
            .into_iter()
            .flatten()
            .all(|d| SINGLE.contains(&(d / own)));
        own.abs() > SPIKE_BESIDE * deviation(&distances[around]) && is_single
    };
    let found = (0..distances.len()).filter(is_spike);
    found.map(|i| i + 2).collect()
}

/// Distance of the third of five samples from the cubic through the others, at their times; 0 where two times are equal.
fn off_cubic(times: &[f64], values: &[f64]) -> f64 {
    let others = [0, 1, 3, 4];
    let weight = |j: usize| {
        let factors = others.iter().filter(|k| **k != j);
        factors.fold(1.0, |w, k| {
            w * (times[2] - times[*k]) / (times[j] - times[*k])
        })
    };
    let cubic: f64 = others.iter().map(|j| weight(*j) * values[*j]).sum();
    if cubic.is_finite() {
        values[2] - cubic
    } else {
        0.0
    }
}

/// True for spacings that agree to within a half.
fn is_even(times: &[f64]) -> bool {
    let mut gaps = times.windows(2).map(|w| w[1] - w[0]);
    let [least, most] = gaps
        .by_ref()
        .fold([f64::INFINITY, 0.0], |r: [f64; 2], gap| {
            [r[0].min(gap), r[1].max(gap)]
        });
    most < 1.5 * least
}

/// Quantisation step of samples that are all multiples of it, apart from a common offset; `None` for fewer than 20 samples, three
/// levels, or levels that no step explains. Decimal digits of printed numbers count as a step.
pub fn quantisation(values: &[f64]) -> Option<f64> {
    /// Largest number of steps in the range of the samples, and largest distance of a level from a multiple, in steps.
    const MOST: f64 = 1e7;
    const OFF: f64 = 0.02;
    /// Number of samples that refuse a step before all are sorted, and the ratio of its limit to that of all: samples that count as equal
    /// may be part of a difference.
    const SOME: usize = 8192;
    const SLACK: f64 = 4.0;
    let smallest_of = |levels: &[f64]| levels.windows(2).map(|w| w[1] - w[0]).reduce(f64::min);
    if values.len() > 2 * SOME {
        let mut levels = values[..SOME].to_vec();
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let ends = (values.iter()).fold(ends, |r, y| [r[0].min(*y), r[1].max(*y)]);
        let same = 4.0 * f64::EPSILON * ends[0].abs().max(ends[1].abs());
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|a, b| *a - *b <= same);
        let smallest = smallest_of(&levels);
        if smallest.is_some_and(|smallest| ends[1] - ends[0] > SLACK * MOST * smallest) {
            return None;
        }
    }
    let mut levels = values.to_vec();
    levels.sort_by(f64::total_cmp);
    let (first, last) = (*levels.first()?, *levels.last()?);
    let same = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    levels.dedup_by(|a, b| *a - *b <= same);
    let smallest = smallest_of(&levels)?;
    if values.len() < 20 || levels.len() < 3 || last - first > MOST * smallest {
        return None;
    }
    let step = (last - first) / ((last - first) / smallest).round();
    let off = |level: &f64| {
        let count = (level - first) / step;
        (count - count.round()).abs() > OFF
    };
    (!levels.iter().any(off)).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudorandom numbers between -1 and 1.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1u32 << 30) - 1.0
        }
    }

    fn wave(count: usize, seed: u64) -> Vec<f64> {
        let mut random = noise(seed);
        let at = |i: usize| (0.3 * i as f64).sin() * (-0.003 * i as f64).exp();
        (0..count).map(|i| at(i) + 0.02 * random()).collect()
    }

    fn times(count: usize) -> Vec<f64> {
        (0..count).map(|i| 0.01 * i as f64).collect()
    }

    #[test]
    fn held_values_are_found_and_quantised_peaks_are_not() {
        for seed in 0..20 {
            let clean = wave(400, seed);
            for step in [0.0, 1e-4, 0.01, 0.1] {
                let round = |y: &f64| match step {
                    0.0 => *y,
                    step => (y / step).round() * step,
                };
                let values: Vec<f64> = clean.iter().map(round).collect();
                assert_eq!(dropouts(&values, step), [], "{seed} {step}");
                for long in [6, 12, 21] {
                    let mut held = values.clone();
                    // At the phase of zero crossings, where the signal moves.
                    held[105..105 + long].fill(values[105]);
                    let found = dropouts(&held, step);
                    // Coarse steps hide short rows.
                    if step < 0.1 {
                        assert_eq!(found.len(), 1, "{seed} {step} {long}");
                        assert!(found[0].start <= 105 && found[0].end >= 105 + long);
                    }
                }
            }
        }
    }

    #[test]
    fn rests_between_pulses_and_stairs_are_no_dropouts() {
        let pulse = |i: usize| match i % 100 {
            k @ 20..40 => (0.157 * (k - 20) as f64).sin(),
            _ => 0.0,
        };
        let pulses: Vec<f64> = (0..500).map(pulse).collect();
        assert_eq!(dropouts(&pulses, 0.0), []);
        let stairs: Vec<f64> = (0..500).map(|i| ((i / 10) as f64).sin()).collect();
        assert_eq!(dropouts(&stairs, 0.0), []);
        let step: Vec<f64> = (0..500).map(|i| f64::from(i > 250)).collect();
        assert_eq!(dropouts(&step, 0.0), []);
    }

    #[test]
    fn single_spikes_are_found_and_impacts_are_not() {
        for seed in 0..20 {
            let clean = wave(400, seed);
            let times = times(400);
            assert!(spikes(&times, &clean).is_empty(), "{seed}");
            // Ten times the largest noise of 0.02, at two samples.
            let mut values = clean.clone();
            values[120] += 0.2;
            values[301] -= 0.5;
            assert_eq!(spikes(&times, &values), [120, 301], "{seed}");
            // A clock that jitters by 4 % of a step, before it is read exactly.
            let mut shift = noise(seed + 100);
            let jittered: Vec<f64> = times
                .iter()
                .map(|t| t + 0.04 * shift() * (times[1] - times[0]))
                .collect();
            let at_them: Vec<f64> = jittered
                .iter()
                .map(|t| (0.6 * t / (times[1] - times[0])).sin())
                .collect();
            assert!(spikes(&jittered, &at_them).is_empty(), "{seed}");
            let mut struck = clean;
            for (i, y) in struck.iter_mut().enumerate().skip(200) {
                let since = (i - 200) as f64;
                *y += (-0.05 * since).exp() * (0.9 * since).cos();
            }
            assert!(spikes(&times, &struck).is_empty(), "{seed}");
            // Blows of a hammer, half sines of 8 to 16 samples, in a force that is noise otherwise.
            let mut random = noise(seed);
            let (long, phase) = (8.0 + 0.4 * seed as f64, 0.05 * seed as f64);
            let force = |i: usize| {
                let since = i as f64 - 150.0 - phase;
                let blow = (std::f64::consts::PI * since / long).sin();
                let blow = if (0.0..long).contains(&since) {
                    180.0 * blow
                } else {
                    0.0
                };
                blow + 0.5 * random()
            };
            let force: Vec<f64> = (0..400).map(force).collect();
            assert!(spikes(&times, &force).is_empty(), "{seed}");
        }
    }

    #[test]
    fn steps_of_quantised_samples_are_found() {
        let clean = wave(400, 7);
        assert_eq!(quantisation(&clean), None);
        for step in [0.1, 0.01, 3.0e-4] {
            let values: Vec<f64> = clean.iter().map(|y| (y / step).round() * step).collect();
            let found = quantisation(&values).unwrap();
            assert!((found / step - 1.0).abs() < 1e-9, "{found}");
        }
        assert_eq!(quantisation(&[0.0, 1.0, 2.0]), None);
    }
}
