//! Lengths of the bump functions of a record.

use super::bumps::{Bumps, noise_gain};
use crate::problem::Problem;
use crate::record::{ChannelKind, Experiment, Measured};
use crate::simd::sum::rms;
use crate::solvers::state_estimation::{noise_of, unsensed};
use std::f64::consts::TAU;

/// Half length of a bump function in periods.
const HALF_LENGTH: f64 = 0.35;
/// Noise of the averaged acceleration relative to its root mean square, up to which a bump function is as short as the acceleration
/// allows, and shorter where that lowers the errors. The noise of the factors biases the estimates by about the square of this ratio.
const NOISE_SHARE: f64 = 0.01;

/// Bump functions of a record, whose width is halved `halvings` times, but not below that of [`NOISE_SHARE`].
pub(super) fn bumps(
    problem: &Problem,
    experiment: &Experiment,
    measured: &Measured,
    halvings: i32,
) -> Bumps {
    let [widest, quiet] = half_lengths(experiment, measured);
    let half = (widest * 0.5f64.powi(halvings)).max(quiet.min(widest));
    let samples = (half / measured.weight).round() as usize;
    let runs = measured.runs(problem.system.grid.step());
    Bumps::of(&runs, samples.clamp(1, measured.positions.len()))
}

/// Largest and smallest half length of the bump functions of a record, s. The largest is 0.35 periods of the acceleration, whose
/// frequency is `rms(y'')/rms(y')`. Where the noise of the averaged acceleration then exceeds [`NOISE_SHARE`], it is longer, up to 0.35
/// periods of the displacement, `rms(y')/rms(y)`. The smallest has that noise.
fn half_lengths(experiment: &Experiment, measured: &Measured) -> [f64; 2] {
    let series = [&measured.y, &measured.v, &measured.a];
    let [y, v, a] = series.map(|series| {
        let filtered = measured.filtered(series.clone());
        let mean = filtered.iter().sum::<f64>() / filtered.len().max(1) as f64;
        rms(&filtered.iter().map(|x| x - mean).collect::<Vec<f64>>())
    });
    let length = |ratio: f64| HALF_LENGTH * TAU * ratio;
    let (shortest, longest) = (length(v / a), length(y / v));
    let quiet = experiment.channels.iter().map(|channel| {
        let order = match channel.kind() {
            ChannelKind::Displacement => 2,
            ChannelKind::Velocity => 1,
            ChannelKind::Acceleration => 0,
        };
        let times = channel.times();
        let spacing = (times[times.len() - 1] - times[0]) / (times.len().max(2) - 1) as f64;
        let (values, gain) = unsensed(channel, &[]);
        let noise = noise_of(channel, &values) / gain.abs();
        let variance = noise_gain(order) * spacing * noise * noise;
        let ratio = variance / (NOISE_SHARE * a).powi(2);
        ratio.powf(1.0 / (2 * order + 1) as f64)
    });
    let quiet = quiet.fold(f64::INFINITY, f64::min);
    let widest = quiet.max(shortest.min(longest)).min(shortest.max(longest));
    [widest, quiet]
}
