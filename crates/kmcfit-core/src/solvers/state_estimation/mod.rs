//! State estimation: displacement, velocity and acceleration from the samples of one experiment, without a model of the
//! system.

mod band_limited;
mod spline;
mod stencil;
mod uniform;

pub(super) use band_limited::PassBand;
use spline::kinematics as by_spline;
use uniform::Grouping;
pub(super) use uniform::{fine_differences, smooth};

use crate::problem::Problem;
use crate::record::{Channel, Experiment, Weighting};
use crate::simd::sum::rms;
use crate::system::State;

/// Smooth states near the samples, at some nodes of the grid.
pub(super) struct Kinematics {
    /// Nodes.
    pub nodes: Vec<usize>,
    /// Displacement, m.
    pub y: Vec<f64>,
    /// Velocity, m/s.
    pub v: Vec<f64>,
    /// Acceleration, m/s^2.
    pub a: Vec<f64>,
    /// State at the first node, if the samples reach it.
    pub initial: Option<State>,
    /// Size of the weighted samples, in their unit.
    pub size: f64,
    /// Weight of a squared residual.
    pub weight: f64,
    /// Groups of samples to which the times belong, for a single displacement at equally spaced nodes.
    pub grouping: Option<Grouping>,
}

/// Nodes of a long record whose samples determine its initial state, which later ones do not change, and its smoothing.
const MOST_NODES: usize = 20_000;

/// Initial state of each experiment, estimated from its samples; `None` if they are too few or start later.
pub fn estimate_states(problem: &Problem) -> Vec<Option<State>> {
    let start = problem.start();
    let scalars = problem.scalars(&start);
    let initial = |experiment: &Experiment| Kinematics::of(problem, experiment, scalars)?.initial;
    (problem.experiments.iter())
        .map(|experiment| match experiment.nodes > MOST_NODES {
            true => initial(&beginning(experiment)),
            false => initial(experiment),
        })
        .collect()
}

/// The samples of an experiment on its first [`MOST_NODES`] nodes.
fn beginning(experiment: &Experiment) -> Experiment {
    let channels = experiment.channels.iter();
    Experiment {
        channels: channels.filter_map(|c| c.within(MOST_NODES - 1)).collect(),
        ..Experiment::free(&*experiment.name, experiment.initial.clone(), MOST_NODES)
    }
}

impl Kinematics {
    /// Estimates the states from all channels of an experiment, for the sensor parameters `scalars`; `None` for too few samples.
    pub fn of(problem: &Problem, experiment: &Experiment, scalars: &[f64]) -> Option<Self> {
        match experiment.channels.as_slice() {
            [] => None,
            [channel] => match channel.stride() {
                Some(stride) => uniform::kinematics(channel, stride, problem.system.grid.step()),
                None => by_spline(problem, experiment, scalars),
            },
            _ => by_spline(problem, experiment, scalars),
        }
    }
}

/// Standard deviation of the noise from fourth differences, in which a smooth response is negligible; their variance is 70
/// times that of white noise.
fn noise_level(observed: &[f64]) -> f64 {
    let fourth = observed
        .windows(5)
        .map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]);
    let squares: f64 = fourth.map(|d| d * d).sum();
    (squares / (70.0 * observed.len().saturating_sub(4).max(1) as f64)).sqrt()
}

/// Standard deviation of the noise of `values`, the samples of a channel or corrected ones: as stated, or else [`noise_level`].
pub(super) fn noise_of(channel: &Channel, values: &[f64]) -> f64 {
    match channel.weighting() {
        Weighting::Sigma(sigma) => *sigma,
        Weighting::Sigmas(sigmas) => rms(sigmas),
        Weighting::Integral { .. } | Weighting::Trapezoid(_) | Weighting::Estimated { .. } => {
            noise_level(values)
        }
    }
}

/// Samples corrected for the sensor parameters `scalars`, as from an ideal sensor on the base, and the gain.
pub(super) fn unsensed(channel: &Channel, scalars: &[f64]) -> (Vec<f64>, f64) {
    let [gain, offset, drift] = channel.sensor().values(scalars);
    let gain = if gain == 0.0 { 1.0 } else { gain };
    let filtered = !channel.filter().is_empty();
    let plain = |(i, sample): (usize, &f64)| match filtered {
        // The filter has removed the offset.
        true => sample / gain,
        false => (sample - offset - drift * channel.elapsed_at(i)) / gain - channel.base_at(i),
    };
    let values = channel.observed().iter().enumerate().map(plain);
    (values.collect(), gain)
}
