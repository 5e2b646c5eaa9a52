//! State estimation from channels of any kind at any times: one smooth curve through all samples.
//!
//! The displacement at the nodes minimises the distance of its values and differences to the samples, plus third differences
//! weighted according to the noise. Without measured displacements, `omega_0^4 |y|^2` is added to `|y'' - a|^2` to keep the
//! curve near zero below the band of the response: an acceleration is integrated twice with the zero-phase frequency response
//! `omega^4 / (omega^4 + omega_0^4)`.

use super::stencil::weights;
use super::{Kinematics, MOST_NODES, noise_of, unsensed};
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::record::{Channel, ChannelKind, Experiment, Weighting};
use crate::signal::median_spacing;
use crate::signal::{Interpolation, Signal, Spectrum};
use crate::simd::sum::rms;
use crate::system::{State, TimePoint};
use std::f64::consts::TAU;

/// Points of a difference stencil; derivatives are at least fourth-order accurate.
const POINTS: usize = 6;
/// Rounds of the search for the smoothing weight, and its decimal exponents.
const ROUNDS: u32 = 12;
const EXPONENTS: [f64; 2] = [-12.0, 12.0];
/// Largest residual of a smooth curve relative to that without smoothing, where it exceeds the noise.
const ALLOWED: f64 = 1.05;
/// Ratio of the dominant frequency to the lower end of the integrated band, for noisy and for exact samples. The ridge term
/// below the band removes a share of `band^(-2 p)` of the samples, with `p` the order of their derivative.
const BAND: [f64; 2] = [6.0, 30.0];
/// Allowance for components below the dominant frequency, which lose a larger share.
const SHARE: f64 = 2.0;
/// Distance from a sample, in median spacings, beyond which nodes lie in a gap.
const GAP: f64 = 1.5;
/// Dominant periods omitted at the ends of an integrated record, because of the transients of the integration.
const SETTLING: f64 = 0.5;

/// A channel corrected to an ideal sensor on the base.
struct Plain<'a> {
    channel: &'a Channel,
    values: Vec<f64>,
    noise: f64,
}

/// States at all nodes near samples.
pub fn kinematics(
    problem: &Problem,
    experiment: &Experiment,
    scalars: &[f64],
) -> Option<Kinematics> {
    let grid = &problem.system.grid;
    let nodes = experiment.nodes;
    if nodes < 2 * POINTS || experiment.sample_count() < 2 * POINTS {
        return None;
    }
    let channels: Vec<Plain> = (experiment.channels.iter())
        .map(|channel| Plain::new(channel, scalars))
        .collect();
    let anchored = channels
        .iter()
        .any(|c| c.channel.kind() == ChannelKind::Displacement && c.channel.filter().is_empty());
    let ridge = match anchored {
        true => None,
        false => Some(ridge(&channels)?),
    };
    let step = grid.step();
    let y = curve(&channels, nodes, step, ridge)?;
    let derivatives = |i: usize| {
        let first = i.saturating_sub(POINTS / 2).min(nodes - POINTS);
        differences(i as f64, first, step).map(|row| -> f64 {
            let values = &y[first..first + POINTS];
            row.iter().zip(values).map(|(w, y)| w * y).sum()
        })
    };
    let settling = ridge.map_or(2.0 * step, |r| SETTLING / r.frequency);
    let near = near_samples(&channels, nodes, grid.start(), step, settling);
    let chosen: Vec<usize> = (0..nodes).filter(|i| near[*i]).collect();
    let all = (0..nodes).map(derivatives).map(|[_, v, a]| (v, a));
    let (v, a): (Vec<f64>, Vec<f64>) = all.unzip();
    let main = channels.first()?;
    let begins = channels
        .iter()
        .any(|c| c.channel.times()[0] - grid.start() <= GAP * c.spacing());
    let initial = begins.then(|| State::one(y[0], v[0]));
    let at_chosen = |f: &[f64]| chosen.iter().map(|&i| f[i]).collect();
    (chosen.len() >= POINTS).then(|| Kinematics {
        y: at_chosen(&y),
        v: at_chosen(&v),
        a: at_chosen(&a),
        initial,
        size: main.values.iter().fold(0.0f64, |m, x| m.max(x.abs())),
        weight: weight_of(main.channel),
        nodes: chosen.clone(),
        grouping: None,
    })
}

/// Typical weight of a channel's samples.
fn weight_of(channel: &Channel) -> f64 {
    channel.weighting().weight(channel.len() / 2, channel.len())
}

impl<'a> Plain<'a> {
    fn new(channel: &'a Channel, scalars: &[f64]) -> Self {
        let (values, gain) = unsensed(channel, scalars);
        let noise = noise_of(channel, &values);
        Self {
            channel,
            noise: (noise / gain.abs())
                .max(1e-6 * rms(&values))
                .max(f64::MIN_POSITIVE.sqrt()),
            values,
        }
    }

    /// Median spacing of the samples, s.
    fn spacing(&self) -> f64 {
        match self.channel.times() {
            [] | [_] => 0.0,
            times => median_spacing(times),
        }
    }

    /// Spectrum of equally spaced values, interpolated linearly between the samples.
    fn spectrum(&self) -> Option<Spectrum> {
        let times = self.channel.times();
        let (first, last) = (times.first()?, times.last()?);
        let spacing = (last - first) / times.len().checked_sub(1)? as f64;
        let samples = Signal::new(times.to_vec(), self.values.clone(), Interpolation::Linear)?;
        let even = (0..times.len()).map(|i| samples.value(first + i as f64 * spacing));
        Spectrum::of(&even.collect::<Vec<f64>>(), spacing)
    }

    fn order(&self) -> usize {
        match self.channel.kind() {
            ChannelKind::Displacement => 0,
            ChannelKind::Velocity => 1,
            ChannelKind::Acceleration => 2,
        }
    }
}

/// Ridge term that keeps an integrated curve near zero below the band.
#[derive(Clone, Copy)]
struct Ridge {
    /// Root of the weight of `y^2` relative to the squared residuals of the highest derivative.
    root: f64,
    /// Dominant frequency, Hz.
    frequency: f64,
    /// Bias of the samples, in units of their noise.
    bias: f64,
}

fn ridge(channels: &[Plain]) -> Option<Ridge> {
    let highest = channels.iter().max_by_key(|c| c.order())?;
    let frequency = highest.spectrum()?.dominant();
    let size = rms(&highest.values) / highest.noise;
    let order = highest.order() as i32;
    // The band widens as the noise falls, so that the bias does not exceed the noise.
    let band = size.powf(0.5 / f64::from(order)).clamp(BAND[0], BAND[1]);
    let root = (TAU * frequency / band).powi(order) / highest.noise;
    (frequency > 0.0 && root.is_finite()).then(|| Ridge {
        root,
        frequency,
        bias: SHARE * size * band.powi(-2 * order),
    })
}

/// Difference weights of order 0, 1 and 2 at `x` (in steps) on the nodes from `first`.
fn differences(x: f64, first: usize, step: f64) -> [Vec<f64>; 3] {
    let nodes: Vec<f64> = (0..POINTS).map(|j| (first + j) as f64).collect();
    let [value, mut slope, mut curvature] = weights(x, &nodes);
    slope.iter_mut().for_each(|w| *w /= step);
    curvature.iter_mut().for_each(|w| *w /= step * step);
    [value, slope, curvature]
}

/// Displacement at the nodes, smoothed as much as the noise allows; in a long record, as much as that of its first [`MOST_NODES`] nodes.
fn curve(channels: &[Plain], nodes: usize, step: f64, ridge: Option<Ridge>) -> Option<Vec<f64>> {
    let part = Equations::of(channels, nodes.min(MOST_NODES), step, ridge);
    let (weight, curve) = part.smoothest(ridge)?;
    match nodes > MOST_NODES {
        true => Equations::of(channels, nodes, step, ridge).smooth(weight),
        false => Some(curve),
    }
}

/// Equations for the displacement at the nodes.
struct Equations {
    program: Subproblem,
    nodes: usize,
    samples: usize,
}

impl Equations {
    /// Equations of the samples at the first `nodes` nodes, and of the ridge term.
    fn of(channels: &[Plain], nodes: usize, step: f64, ridge: Option<Ridge>) -> Self {
        let mut program = Subproblem::new(nodes);
        program.elimination_order = (0..nodes as u32).collect();
        for plain in channels {
            let positions = plain.channel.positions();
            let inside = positions.take_while(|position| position.step + 1 < nodes);
            for (i, (position, value)) in inside.zip(&plain.values).enumerate() {
                let x = position.step as f64 + position.fraction;
                let first = first_point(position, nodes);
                let weight = 1.0 / plain.noise_at(i);
                let row = &differences(x, first, step)[plain.order()];
                let row = row.iter().enumerate().map(|(j, w)| (first + j, weight * w));
                (program.residuals).push(row.filter(|(_, w)| *w != 0.0), weight * value);
            }
        }
        let samples = program.residuals.len();
        if let Some(ridge) = ridge {
            // Weighted like the samples, as if there were as many as nodes.
            let share = (samples as f64 / nodes as f64).sqrt();
            for i in 0..nodes {
                program.residuals.push([(i, ridge.root * share)], 0.0);
            }
        }
        Self {
            program,
            nodes,
            samples,
        }
    }

    /// Squared distance of a curve from the samples, in their noise.
    fn misfit(&self, curve: &[f64]) -> f64 {
        let residuals = &self.program.residuals;
        let fitted = residuals.multiply(curve);
        let pairs = fitted.iter().zip(residuals.right()).take(self.samples);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum()
    }

    /// The largest weight that the noise allows, and its curve.
    fn smoothest(&self, ridge: Option<Ridge>) -> Option<(f64, Vec<f64>)> {
        let [mut low, mut high] = EXPONENTS;
        // The ridge term may exceed the noise.
        let mut best = self.smooth(10f64.powf(low))?;
        let bias = ridge.map_or(1.0, |r| r.bias.max(1.0));
        let enough = (ALLOWED * self.misfit(&best)).max(self.samples as f64 * bias * bias);
        for _ in 0..ROUNDS {
            let middle = 0.5 * (low + high);
            let candidate = self.smooth(10f64.powf(middle))?;
            if self.misfit(&candidate) <= enough {
                low = middle;
                best = candidate;
            } else {
                high = middle;
            }
        }
        Some((10f64.powf(low), best))
    }

    /// The curve with third differences in units of its size, so that the weight is dimensionless.
    fn smooth(&self, weight: f64) -> Option<Vec<f64>> {
        let mut program = self.program.clone();
        let residuals = &mut program.residuals;
        let scale = (0..residuals.len()).map(|i| residuals.scale(i));
        let root = weight.sqrt() * scale.fold(0.0f64, f64::max);
        for i in 0..self.nodes - 3 {
            let row = [
                (i, -root),
                (i + 1, 3.0 * root),
                (i + 2, -3.0 * root),
                (i + 3, root),
            ];
            residuals.push(row, 0.0);
        }
        program.solve_equality_constrained()
    }
}

impl Plain<'_> {
    fn noise_at(&self, i: usize) -> f64 {
        let own = match self.channel.weighting() {
            Weighting::Sigmas(sigmas) => sigmas[i] / rms(sigmas),
            _ => 1.0,
        };
        self.noise * own
    }
}

fn first_point(position: TimePoint, nodes: usize) -> usize {
    let nearest = position.step + usize::from(position.fraction > 0.5);
    nearest.saturating_sub(POINTS / 2).min(nodes - POINTS)
}

/// Nodes near the samples of the channel with the most samples.
fn near_samples(
    channels: &[Plain],
    nodes: usize,
    start: f64,
    step: f64,
    settling: f64,
) -> Vec<bool> {
    let mut near = vec![false; nodes];
    for plain in channels {
        let times = plain.channel.times();
        let reach = GAP * plain.spacing().max(step);
        let (Some(first), Some(last)) = (times.first(), times.last()) else {
            continue;
        };
        for (i, near) in near.iter_mut().enumerate() {
            let t = start + i as f64 * step;
            let after = times.partition_point(|x| *x < t);
            let ahead = times.get(after).map_or(f64::INFINITY, |x| x - t);
            let behind = after.checked_sub(1).map_or(f64::INFINITY, |j| t - times[j]);
            let inside = t >= first + settling && t <= last - settling;
            *near |= inside && ahead.min(behind) <= reach;
        }
    }
    near
}
