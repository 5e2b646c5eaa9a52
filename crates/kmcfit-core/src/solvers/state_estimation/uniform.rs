//! State estimation from displacements at equally spaced nodes: smoothing, then fourth-order differences.

use super::{Kinematics, noise_of};
use crate::record::{Channel, Differences};
use crate::simd::sum::rms;
use crate::system::State;

/// Fewest samples from which states are estimated.
const LEAST: usize = 8;
/// Weights of the smoothing that are tried at a time.
const LANES: usize = 4;
/// Rounds of the search for the exponent of the smoothing weight, each of which divides its interval by five.
const ROUNDS: u32 = 6;
/// Decimal exponents of the smoothing weight. The rounding error of a smoothed curve, relative to its samples, is the weight
/// times that of a number: 1e-6 at most.
const EXPONENTS: [f64; 2] = [-12.0, 10.0];
/// Samples of a group that are averaged where the largest weight smooths too little. The period at which that weight halves
/// an oscillation is `2 pi 10^(10/6) = 292` samples, on which the mean of five is exact to 5e-4.
const GROUP: usize = 5;
/// Noise level, relative to the size of the samples, below which they are not smoothed.
const NOISELESS: f64 = 1e-6;

/// States at all samples but two at each end; of a long noisy record at the middles of groups of samples.
pub fn kinematics(channel: &Channel, stride: usize, step: f64) -> Option<Kinematics> {
    let Smoothed { y, group, weight } = smoothed(channel)?;
    let spacing = group * stride;
    let first_node = (group - 1) / 2 * stride;
    let h = step * spacing as f64;
    let Differences { y: inner, v, a } = differences(&y, h);
    let first = [-25.0, 48.0, -36.0, 16.0, -3.0];
    let slope = first.iter().zip(&y).map(|(w, y)| w * y).sum::<f64>() / (12.0 * h);
    // From the middle of the first group to the first node.
    let back = step * first_node as f64;
    Some(Kinematics {
        nodes: (2..y.len() - 2).map(|i| first_node + i * spacing).collect(),
        y: inner,
        initial: Some(State::one(y[0] - back * slope, slope - back * a[0])),
        v,
        a,
        size: y.iter().fold(0.0f64, |m, y| m.max(y.abs())),
        weight: channel.weighting().weight(1, channel.len()) * group as f64,
        grouping: Some(Grouping {
            group,
            stride,
            smoothing: weight,
        }),
    })
}

/// Groups of neighbouring samples, each of which is one time of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grouping {
    /// Samples of a group; odd.
    pub group: usize,
    /// Nodes between samples.
    pub stride: usize,
    /// Weight of [`smooth`]; `None` where the samples are not smoothed.
    pub smoothing: Option<f64>,
}

impl Grouping {
    /// Means of the groups of a series with one value per sample.
    pub fn means(self, samples: &[f64]) -> Vec<f64> {
        if self.group == 1 {
            return samples.to_vec();
        }
        let groups = samples.chunks_exact(self.group);
        groups
            .map(|group| group.iter().sum::<f64>() / self.group as f64)
            .collect()
    }
}

/// Fourth-order differences of values that are `spacing` apart.
pub fn differences(values: &[f64], spacing: f64) -> Differences {
    let h = spacing;
    let each = |f: &dyn Fn(&[f64]) -> f64| values.windows(5).map(f).collect::<Vec<f64>>();
    Differences {
        y: each(&|w| w[2]),
        v: each(&|w| (w[0] - 8.0 * w[1] + 8.0 * w[3] - w[4]) / (12.0 * h)),
        a: each(&|w| (-w[0] + 16.0 * w[1] - 30.0 * w[2] + 16.0 * w[3] - w[4]) / (12.0 * h * h)),
    }
}

/// Smoothed samples, or means of groups of them.
struct Smoothed {
    y: Vec<f64>,
    /// Samples of a group; odd, so that its middle is a sample.
    group: usize,
    /// Weight of the third differences, if any.
    weight: Option<f64>,
}

/// Smoothest curve (in third differences) whose distance from the samples is within their noise: the mean square of `n`
/// values of white noise is below `1 + 2 sqrt(2 / n)` times its variance in 98 of 100 records. A curve that is a little too
/// smooth has smaller derivatives of all orders; one that follows the noise has large errors in the second one.
fn smoothed(channel: &Channel) -> Option<Smoothed> {
    let observed = channel.observed();
    if observed.len() < LEAST {
        return None;
    }
    let noise = noise_of(channel, observed);
    let most = 10f64.powf(EXPONENTS[1]);
    let mut samples = observed.to_vec();
    let mut group = 1;
    loop {
        let count = samples.len() as f64;
        // The noise of a mean.
        let noise = noise * ((1.0 + 2.0 * (2.0 / count).sqrt()) / group as f64).sqrt();
        if noise <= NOISELESS * rms(&samples) {
            return Some(Smoothed {
                y: samples,
                group,
                weight: None,
            });
        }
        let is_long = samples.len() >= GROUP * LEAST;
        match is_long && distance(&samples, &smooth(&samples, most)?) <= noise {
            true => {
                let means = samples.chunks_exact(GROUP);
                samples = means
                    .map(|group| group.iter().sum::<f64>() / GROUP as f64)
                    .collect();
                group *= GROUP;
            }
            false => {
                let (y, weight) = smoothed_to(&samples, noise)?;
                return Some(Smoothed { y, group, weight });
            }
        }
    }
}

/// Smoothest curve within `noise` of the samples, and its weight; its distance from the samples increases with the weight.
fn smoothed_to(samples: &[f64], noise: f64) -> Option<(Vec<f64>, Option<f64>)> {
    let [mut low, mut high] = EXPONENTS;
    let mut weight = None;
    for _ in 0..ROUNDS {
        let part = (high - low) / (LANES + 1) as f64;
        let exponents: [f64; LANES] = std::array::from_fn(|lane| low + (lane + 1) as f64 * part);
        let weights = exponents.map(|exponent| 10f64.powf(exponent));
        let curves = penalised(samples, weights);
        let is_within =
            |lane: &usize| distance_of(samples, curves.iter().map(|y| y[*lane])) <= noise;
        let within = (0..LANES).take_while(is_within).count();
        if within > 0 {
            (low, weight) = (exponents[within - 1], Some(weights[within - 1]));
        }
        high = exponents.get(within).copied().unwrap_or(high);
    }
    match weight {
        Some(weight) => Some((smooth(samples, weight)?, Some(weight))),
        None => Some((samples.to_vec(), None)),
    }
}

/// Root mean square of the differences of two curves.
fn distance(one: &[f64], other: &[f64]) -> f64 {
    distance_of(one, other.iter().copied())
}

fn distance_of(one: &[f64], other: impl Iterator<Item = f64>) -> f64 {
    let squares = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b));
    (squares.sum::<f64>() / one.len() as f64).sqrt()
}

/// Minimises `|y - observed|^2 + weight |third differences of y|^2`; `None` for fewer than four values or an infinite result.
pub fn smooth(observed: &[f64], weight: f64) -> Option<Vec<f64>> {
    if observed.len() <= DEGREE {
        return None;
    }
    let curve = |values: &[f64]| -> Vec<f64> {
        let found = penalised(values, [weight]);
        found.into_iter().map(|[y]| y).collect()
    };
    let mut y = curve(observed);
    // One refinement: the factors are rounded by up to 64 times the weight.
    let mut rest: Vec<f64> = observed.iter().zip(&y).map(|(o, y)| o - y).collect();
    for (i, w) in y.windows(DEGREE + 1).enumerate() {
        let difference: f64 = THIRD.iter().zip(w).map(|(d, y)| d * y).sum();
        for (rest, d) in rest[i..].iter_mut().zip(THIRD) {
            *rest -= weight * d * difference;
        }
    }
    for (y, correction) in y.iter_mut().zip(curve(&rest)) {
        *y += correction;
    }
    y.iter().all(|y| y.is_finite()).then_some(y)
}

/// Order of the differences that are penalised.
const DEGREE: usize = 3;
/// A third difference.
const THIRD: [f64; DEGREE + 1] = [-1.0, 3.0, -3.0, 1.0];

/// The minimiser of [`smooth`] for `L` weights at a time, by the factors `L D L'` of the banded matrix `I + weight D3' D3`.
fn penalised<const L: usize>(observed: &[f64], weights: [f64; L]) -> Vec<[f64; L]> {
    let n = observed.len();
    // Products of columns `i` and `i - k` of the differences, summed over the rows that there are.
    let product = |i: usize, k: usize| -> f64 {
        let rows = i.saturating_sub(DEGREE)..(i + 1 - k).min(n - DEGREE);
        rows.map(|row| THIRD[i - row] * THIRD[i - k - row]).sum()
    };
    let inner: [f64; DEGREE + 1] = std::array::from_fn(|k| product(DEGREE.max(n / 2), k));
    let is_inner = |i: usize| i >= 2 * DEGREE && i + 2 * DEGREE < n;
    let mut lower = vec![[[0.0; L]; DEGREE]; n];
    let mut curve = vec![[0.0; L]; n];
    // Of the last three rows: reciprocals of the pivots, and the solution of `L`.
    let mut inverse = [[1.0; L]; DEGREE];
    let mut solved = [[0.0; L]; DEGREE];
    for i in 0..n {
        let entries: [f64; DEGREE + 1] = match is_inner(i) {
            true => inner,
            false => std::array::from_fn(|k| if k <= i { product(i, k) } else { 0.0 }),
        };
        let before = |k: usize| i.checked_sub(k).map_or([[0.0; L]; DEGREE], |j| lower[j]);
        let (one, two) = (before(1), before(2));
        let mut row = [[0.0; L]; DEGREE];
        let (mut reciprocal, mut solution) = ([0.0; L], [0.0; L]);
        for lane in 0..L {
            let w = weights[lane];
            let scaled3 = w * entries[3];
            let scaled2 = w * entries[2] - scaled3 * two[0][lane];
            let scaled1 = w * entries[1] - scaled3 * one[1][lane] - scaled2 * one[0][lane];
            let [l1, l2, l3] = [
                scaled1 * inverse[0][lane],
                scaled2 * inverse[1][lane],
                scaled3 * inverse[2][lane],
            ];
            row[0][lane] = l1;
            row[1][lane] = l2;
            row[2][lane] = l3;
            let pivot = 1.0 + w * entries[0] - l1 * scaled1 - l2 * scaled2 - l3 * scaled3;
            reciprocal[lane] = 1.0 / pivot;
            solution[lane] =
                observed[i] - l1 * solved[0][lane] - l2 * solved[1][lane] - l3 * solved[2][lane];
            curve[i][lane] = solution[lane] * reciprocal[lane];
        }
        lower[i] = row;
        inverse = [reciprocal, inverse[0], inverse[1]];
        solved = [solution, solved[0], solved[1]];
    }
    for i in (0..n).rev() {
        for (k, later) in (i + 1..n.min(i + 1 + DEGREE)).enumerate() {
            for lane in 0..L {
                curve[i][lane] -= lower[later][k][lane] * curve[later][lane];
            }
        }
    }
    curve
}

/// [`differences`] of eighth order, of fourth order at the two values at each end: for values without smoothing on the spacing of groups,
/// of which a cycle may have twelve.
pub fn fine_differences(values: &[f64], spacing: f64) -> Differences {
    let mut all = differences(values, spacing);
    let symmetric = |w: &[f64], sign: f64, weights: [f64; 4]| -> f64 {
        let pair = |k: usize| w[4 + k] + sign * w[4 - k];
        (1..=4).map(|k| weights[k - 1] * pair(k)).sum()
    };
    let inner = values.windows(9).enumerate();
    for (i, w) in inner {
        let slope = symmetric(w, -1.0, [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0]);
        let curvature = symmetric(w, 1.0, [8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0]);
        all.v[i + 2] = slope / spacing;
        all.a[i + 2] = (curvature - 205.0 / 72.0 * w[4]) / (spacing * spacing);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qp::Subproblem;
    use crate::record::Weighting;
    use crate::system::Grid;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// The banded factors against the general solver of least squares.
    #[test]
    fn smoothing_minimises_its_penalised_sum() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for n in [4, 5, 7, 9, 13, 14, 300] {
            let observed: Vec<f64> = (0..n)
                .map(|i| {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    (0.05 * i as f64).sin() + 0.1 * noise
                })
                .collect();
            for weight in [1e-12, 1e-2, 1.0, 1e3, 1e10] {
                let mut sub = Subproblem::new(n);
                sub.elimination_order = (0..n as u32).collect();
                for (i, y) in observed.iter().enumerate() {
                    sub.residuals.push([(i, 1.0)], *y);
                }
                let root = f64::sqrt(weight);
                for i in 0..n - DEGREE {
                    let row = THIRD
                        .iter()
                        .enumerate()
                        .map(|(k, d)| (i + k, root * d))
                        .collect::<Vec<_>>();
                    sub.residuals.push(row, 0.0);
                }
                let exact = sub
                    .solve_equality_constrained()
                    .unwrap_or_else(|| panic!("{n} {weight}"));
                let found = smooth(&observed, weight).expect("a solution");
                // Rounding of a stable least-squares solution: the root of the condition `1 + 64 w`.
                let limit = 4.0 * f64::EPSILON * (1.0 + 64.0 * weight).sqrt();
                let error = distance(&exact, &found);
                assert!(error < limit, "{n} {weight:e}: {error:e}");
            }
        }
    }

    /// Differences of five samples are exact for polynomials of degree 4, for any step and number of steps between samples.
    #[test]
    fn states_of_a_quartic_are_exact() {
        let quartic = |t: f64| {
            [
                0.5 - t + 0.3 * t.powi(2) + 0.2 * t.powi(3) - 0.1 * t.powi(4),
                -1.0 + 0.6 * t + 0.6 * t.powi(2) - 0.4 * t.powi(3),
                0.6 + 1.2 * t - 1.2 * t.powi(2),
            ]
        };
        for (step, stride) in [(0.1, 1), (0.05, 3), (0.02, 8)] {
            let nodes = 10 * stride + 1;
            let grid = Grid::new(0.0, step * (nodes - 1) as f64, nodes).expect("a grid");
            let times: Vec<f64> = (0..=10).map(|i| grid.time(i * stride)).collect();
            let samples: Vec<f64> = times.iter().map(|t| quartic(*t)[0]).collect();
            // Samples without noise are not smoothed.
            let weighting = Weighting::Sigma(1e-9);
            let channel = Channel::displacement_at_nodes(samples, stride, weighting, &grid);
            let found = kinematics(&channel, stride, grid.step()).expect("enough samples");
            let inner: Vec<usize> = (2..9).map(|i| i * stride).collect();
            assert_eq!(found.nodes, inner);
            // A rounding error of a sample of size 1, divided by the square of the spacing of at least 0.1.
            let is_close = |found: f64, exact: f64| (found - exact).abs() < 1e-12;
            let states = found.y.iter().zip(&found.v).zip(&found.a);
            for (((y, v), a), node) in states.zip(inner) {
                let [exact_y, exact_v, exact_a] = quartic(grid.time(node));
                assert!(is_close(*y, exact_y), "y {y} {exact_y}");
                assert!(is_close(*v, exact_v), "v {v} {exact_v}");
                assert!(is_close(*a, exact_a), "a {a} {exact_a}");
            }
            let initial = found.initial.expect("a sample at the first node");
            let [y, v, _] = quartic(0.0);
            assert!(is_close(initial.displacement(0), y) && is_close(initial.velocity(0), v));
        }
    }

    /// On twelve samples per cycle the derivatives of a sine have errors of `(w h)^8/630` and `(w h)^8/3150`, inside.
    #[test]
    fn fine_differences_are_of_eighth_order() {
        let (w, h) = (1.0, std::f64::consts::TAU / 12.0);
        let values: Vec<f64> = (0..40).map(|i| (w * h * f64::from(i)).sin()).collect();
        let found = fine_differences(&values, h);
        assert_eq!(found.y, values[2..38]);
        for i in 4..36 {
            let (sine, cosine) = (w * h * i as f64).sin_cos();
            let (off_v, off_a) = (found.v[i - 2] - cosine, found.a[i - 2] + sine);
            assert!(
                off_v.abs() < 1e-5 && off_a.abs() < 2e-6,
                "{i}: {off_v} {off_a}"
            );
        }
    }

    /// Four periods with noise of a thirtieth of the amplitude: the more samples, the better the states. On 100,000 samples the
    /// noise of the second differences of neighbours is 1e6 times the acceleration.
    #[test]
    fn states_of_long_noisy_records_are_averages() {
        let [amplitude, sigma] = [3.0, 0.1];
        for (samples, seed, groups) in [
            (2000, 1, [1, 5]),
            (20_000, 2, [5, 125]),
            (100_000, 3, [25, 625]),
        ] {
            let grid = Grid::new(0.0, 8.0 * std::f64::consts::PI, samples).expect("a grid");
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let observed: Vec<f64> = (0..samples)
                .map(|i| {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    amplitude * grid.time(i).cos() + sigma * noise
                })
                .collect();
            let channel =
                Channel::displacement_at_nodes(observed, 1, Weighting::Sigma(sigma), &grid);
            let found = kinematics(&channel, 1, grid.step()).expect("enough samples");
            let spacing = found.nodes[1] - found.nodes[0];
            assert!(groups[0] <= spacing && spacing <= groups[1], "{spacing}");
            // Inside, where the smoothed curve has neighbours on both sides: two per cent of the amplitude, of which most
            // is the attenuation by the smoothing.
            let inside = found.nodes.len() / 16..found.nodes.len() * 15 / 16;
            let error = |values: &[f64], exact: fn(f64) -> f64| {
                let errors = inside
                    .clone()
                    .map(|i| values[i] - amplitude * exact(grid.time(found.nodes[i])));
                rms(&errors.collect::<Vec<_>>()) / amplitude
            };
            let errors = [
                error(&found.y, f64::cos),
                error(&found.v, |t| -t.sin()),
                error(&found.a, |t| -t.cos()),
            ];
            assert!(errors.iter().all(|e| *e < 0.02), "{samples}: {errors:?}");
        }
    }
}
