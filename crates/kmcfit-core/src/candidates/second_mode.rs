//! The response of a second mode in the samples of a channel: from rest to the input of its experiment, and two free decays,
//!
//! ```text
//! q'' + 2 zeta omega q' + omega^2 q = u
//! ```
//!
//! up to a factor each, exactly for an input that is linear between equally spaced samples.

use crate::problem::Problem;
use crate::record::ChannelKind;
use crate::signal::even_spacing;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Natural frequency (Hz) and damping ratio.
pub type Mode = [f64; 2];

/// Samples of a channel with the input at them.
pub(super) struct ModeSamples {
    kind: ChannelKind,
    pub(super) spacing: f64,
    pub(super) count: usize,
    /// Force or acceleration of the base; `None` for a free record.
    input: Option<Vec<f64>>,
    /// True for a response that begins at rest.
    is_from_rest: bool,
}

impl ModeSamples {
    /// `None` for samples that are not equally spaced, filtered, or relative to a measured base.
    pub(super) fn of(problem: &Problem, e: usize, c: usize) -> Option<Self> {
        let experiment = &problem.experiments[e];
        let channel = &experiment.channels[c];
        let is_plain = channel.filter().is_empty() && channel.base().is_empty();
        let spacing = even_spacing(channel.times()).filter(|_| is_plain)?;
        let excitation = experiment.excitation.as_ref().filter(|e| !e.is_zero());
        let input = excitation.map(|excitation| {
            let at = |i: usize| {
                let sample = channel.input_at_sample(Some(excitation), i);
                match excitation.frame(0).is_some() {
                    true => sample.base,
                    false => sample.force,
                }
            };
            (0..channel.len()).map(at).collect()
        });
        let initial = &experiment.initial;
        let is_still = initial.displacement(0) == 0.0 && initial.velocity(0) == 0.0;
        Some(Self {
            kind: channel.kind(),
            spacing,
            count: channel.len(),
            is_from_rest: is_still && experiment.begins_known() && input.is_some(),
            input,
        })
    }

    /// Responses of a mode, as columns.
    pub(super) fn columns(&self, mode: Mode) -> DMatrix<f64> {
        let still = [[0.0; 2]];
        let mut each = Vec::new();
        if self.input.is_some() {
            each.push(self.responses([mode], [1.0], still));
        }
        if !self.is_from_rest {
            each.push(self.responses([mode], [0.0], [[1.0, 0.0]]));
            each.push(self.responses([mode], [0.0], [[0.0, TAU * mode[0]]]));
        }
        let columns: Vec<_> = each.iter().map(|column| column.column(0)).collect();
        DMatrix::from_columns(&columns)
    }

    /// Responses of modes at the samples, as columns, to factors of the input, linear between samples, from displacements and
    /// velocities, exactly.
    fn responses<const N: usize>(
        &self,
        modes: [Mode; N],
        factors: [f64; N],
        starts: [[f64; 2]; N],
    ) -> DMatrix<f64> {
        let h = self.spacing;
        let steps: [ModeStep; N] = std::array::from_fn(|j| ModeStep::of(modes[j], h));
        let count = self.count;
        let mut out = DMatrix::zeros(count, N);
        let (mut q, mut v) = (starts.map(|s| s[0]), starts.map(|s| s[1]));
        for i in 0..count {
            let [now, next] = self.input.as_ref().map_or([0.0; 2], |input| {
                [input[i], input.get(i + 1).copied().unwrap_or(input[i])]
            });
            for j in 0..N {
                let step = &steps[j];
                let (u, w) = (factors[j] * now, factors[j] * next);
                out[(i, j)] = match self.kind {
                    ChannelKind::Displacement => q[j],
                    ChannelKind::Velocity => v[j],
                    ChannelKind::Acceleration => u - step.pull[0] * q[j] - step.pull[1] * v[j],
                };
                let forced = [0, 1].map(|k| step.input[k][0] * u + step.input[k][1] * w);
                let [a, b] = step.state;
                (q[j], v[j]) = (
                    a[0] * q[j] + a[1] * v[j] + forced[0],
                    b[0] * q[j] + b[1] * v[j] + forced[1],
                );
            }
        }
        out
    }
}

/// Step of a mode from a sample to the next.
struct ModeStep {
    /// Displacement and velocity from those before.
    state: [[f64; 2]; 2],
    /// Displacement and velocity from the input before and after.
    input: [[f64; 2]; 2],
    /// Acceleration from displacement and velocity, negative.
    pull: [f64; 2],
}

impl ModeStep {
    fn of([frequency, ratio]: Mode, h: f64) -> Self {
        let omega = TAU * frequency;
        let decay = ratio * omega;
        let damped = omega * (1.0 - ratio * ratio).max(0.0).sqrt().max(1e-6);
        let (sine, cosine) = (damped * h).sin_cos();
        let (c, s, shrink) = (cosine, sine / damped, (-decay * h).exp());
        let square = omega * omega;
        let state = [
            [shrink * (c + decay * s), shrink * s],
            [-shrink * square * s, shrink * (c - decay * s)],
        ];
        // The particular solution to an input linear in time is linear.
        let slope = 1.0 / (h * square);
        let level = |slope: f64| -2.0 * ratio * slope / omega;
        let from = |level: f64, slope: f64| {
            let end = [level + slope * h, slope];
            [0, 1].map(|k| end[k] - state[k][0] * level - state[k][1] * slope)
        };
        let before = from(1.0 / square + level(-slope), -slope);
        let after = from(level(slope), slope);
        Self {
            state,
            input: [[before[0], after[0]], [before[1], after[1]]],
            pull: [square, 2.0 * decay],
        }
    }
}
