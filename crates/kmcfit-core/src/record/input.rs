//! Inputs as functions of time, from which excitations on any grid are sampled.

use super::ChannelKind;
use crate::signal::{ExcitationShape, Interpolation, Signal};
use crate::system::{Excitation, Grid, StageSamples};
use std::sync::Arc;

/// A force over time.
#[derive(Debug, Clone, PartialEq)]
pub enum Waveform {
    /// Measured, N.
    Samples(Signal),
    /// A formula, N.
    Shape(ExcitationShape),
}

/// A measured motion of the base.
#[derive(Debug, Clone, PartialEq)]
pub enum BaseMotion {
    /// Its acceleration, m/s^2.
    Acceleration(Signal),
    /// Its displacement, m, as a smooth function: it is differentiated twice.
    Displacement(Signal),
}

/// Force and motion of the base as functions of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Input {
    /// The force.
    pub force: Option<Waveform>,
    /// The motion of the base.
    pub base: Option<BaseMotion>,
    /// Index of the coordinate on which the force acts.
    pub coordinate: usize,
    /// Index of the last coordinate: all are relative to the base.
    pub last: usize,
}

impl Input {
    /// Excitation at the stages of the steps of a response over the first `nodes` nodes of `grid`.
    pub fn on(&self, grid: &Grid, nodes: usize) -> Excitation {
        let sample = |at: &dyn Fn(f64) -> f64, before: &dyn Fn(f64) -> f64| {
            let step = |i: usize| {
                let (left, right) = (grid.time(i), grid.time(i + 1));
                [at(left), at(0.5 * (left + right)), before(right)]
            };
            StageSamples::new((0..nodes - 1).map(step))
        };
        let interpolated = |signal: &Signal| {
            if signal.interpolation() == Interpolation::Hold {
                return sample(&|t| signal.value(t), &|t| signal.value_before(t));
            }
            // Without jumps a step begins with the value with which the last one ended.
            let mut end = signal.value(grid.time(0));
            let step = |i: usize| {
                let (left, right) = (grid.time(i), grid.time(i + 1));
                let begin = std::mem::replace(&mut end, signal.value(right));
                [begin, signal.value(0.5 * (left + right)), end]
            };
            StageSamples::new((0..nodes - 1).map(step))
        };
        let force = self.force.as_ref().map(|force| match force {
            Waveform::Samples(s) => interpolated(s),
            Waveform::Shape(s) => sample(&|t| s.value(t), &|t| s.value_before(t)),
        });
        let base = self.base.as_ref().map(|base| match base {
            BaseMotion::Acceleration(s) => interpolated(s),
            BaseMotion::Displacement(s) => {
                sample(&|t| s.second_derivative(t), &|t| s.second_derivative(t))
            }
        });
        let frames = base
            .iter()
            .flat_map(|base| (0..=self.last).map(|j| (j, base.clone())));
        Excitation {
            frames: frames.collect(),
            forces: force
                .into_iter()
                .map(|force| (self.coordinate, force))
                .collect(),
            supports: Vec::new(),
        }
    }

    /// Shares `times` (s) with the signals that have the same.
    pub fn share_times(&mut self, times: &Arc<Vec<f64>>) {
        if let Some(Waveform::Samples(signal)) = &mut self.force {
            signal.share_times(times);
        }
        if let Some(BaseMotion::Acceleration(signal) | BaseMotion::Displacement(signal)) =
            &mut self.base
        {
            signal.share_times(times);
        }
    }

    /// Force at time `t` (s), N.
    pub fn force_at(&self, t: f64) -> f64 {
        match &self.force {
            None => 0.0,
            Some(Waveform::Samples(signal)) => signal.value(t),
            Some(Waveform::Shape(shape)) => shape.value(t),
        }
    }

    /// Forces (N) and accelerations of the base (m/s^2) at some times (s); empty without them, and shared with a signal at the times of its
    /// samples.
    pub(crate) fn inputs_at(&self, times: &[f64]) -> [Arc<Vec<f64>>; 2] {
        let bases = self.base.as_ref().map(|base| match base {
            BaseMotion::Acceleration(signal) => signal.values_at(times),
            BaseMotion::Displacement(_) => {
                let accelerations = times.iter().map(|t| self.base_acceleration_at(*t));
                Arc::new(accelerations.collect())
            }
        });
        [self.forces_at(times), bases].map(Option::unwrap_or_default)
    }

    /// Forces (N) at some times (s), shared with a signal at the times of its samples; `None` without a force.
    pub fn forces_at(&self, times: &[f64]) -> Option<Arc<Vec<f64>>> {
        Some(match self.force.as_ref()? {
            Waveform::Samples(signal) => signal.values_at(times),
            Waveform::Shape(shape) => Arc::new(times.iter().map(|t| shape.value(*t)).collect()),
        })
    }

    /// Acceleration of the base at time `t` (s), m/s^2.
    pub fn base_acceleration_at(&self, t: f64) -> f64 {
        self.base_motion_at(ChannelKind::Acceleration, t)
            .unwrap_or(0.0)
    }

    /// Motion of the base at time `t` (s) in the SI unit of `kind`; `None` where unknown.
    pub fn base_motion_at(&self, kind: ChannelKind, t: f64) -> Option<f64> {
        match (&self.base, kind) {
            (None, _) => Some(0.0),
            (Some(BaseMotion::Acceleration(signal)), ChannelKind::Acceleration) => {
                Some(signal.value(t))
            }
            (Some(BaseMotion::Acceleration(_)), _) => None,
            (Some(BaseMotion::Displacement(signal)), kind) => Some(match kind {
                ChannelKind::Displacement => signal.value(t),
                ChannelKind::Velocity => signal.derivative(t),
                ChannelKind::Acceleration => signal.second_derivative(t),
            }),
        }
    }
}
