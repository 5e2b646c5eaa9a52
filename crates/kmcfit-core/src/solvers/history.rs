//! History of a fit: one record per iteration.

use super::iterate::Iterate;
use crate::number_format::number_or_nan;
use crate::problem::Problem;
use crate::record::{ChannelKind, Experiment};
use crate::step::Trajectory;
use serde::{Deserialize, Serialize};

/// One iteration: cost after it, gradient before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Iteration, from 1.
    pub iteration: u64,
    /// Cost `J` after the iteration.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost: f64,
    /// Ratio `J / J0`.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost_ratio: f64,
    /// `G^2` before the iteration, relative to its first value.
    #[serde(deserialize_with = "number_or_nan")]
    pub gradient_norm_squared_ratio: f64,
    /// Step length along the solver's direction.
    #[serde(deserialize_with = "number_or_nan")]
    pub step: f64,
    /// Largest change of a function, relative to its natural size ([`Problem::relative_change`]).
    #[serde(deserialize_with = "number_or_nan")]
    pub relative_change: f64,
}

/// Responses after an iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSnapshot {
    /// Iteration; 0 is the start.
    pub iteration: u64,
    /// Displacements (m) of each experiment at its nodes; none for an experiment without measured displacements.
    pub displacements: Vec<Vec<f64>>,
}

impl ResponseSnapshot {
    fn new(iteration: u64, problem: &Problem, responses: &[Trajectory]) -> Self {
        let of = |(experiment, response): (&Experiment, &Trajectory)| {
            let mut channels = experiment.channels.iter();
            match channels.any(|c| c.kind() == ChannelKind::Displacement) {
                true => response.displacement(0).to_vec(),
                false => Vec::new(),
            }
        };
        let pairs = problem.experiments.iter().zip(responses);
        Self {
            iteration,
            displacements: pairs.map(of).collect(),
        }
    }
}

/// Iterations whose responses are kept for figures: the paper's Fig. 3b and its continuation.
pub const SNAPSHOT_ITERATIONS: [u64; 8] = [0, 10, 30, 100, 300, 1000, 3000, 10_000];

/// Reference values `J0` and `G0^2` of the ratios.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reference {
    pub cost: f64,
    pub norm_squared: f64,
}

/// History and snapshots of one search.
#[derive(Debug)]
pub(super) struct Recorder {
    pub rows: Vec<IterationRecord>,
    pub snapshots: Vec<ResponseSnapshot>,
    pub initial_cost: f64,
    pub started_from: f64,
    pub initial_norm_squared: f64,
}

impl Recorder {
    /// Starts at `start`, with ratios to `reference`, by default the start.
    pub fn new(problem: &Problem, start: &Iterate, reference: Option<Reference>) -> Self {
        let reference = reference.unwrap_or(Reference {
            cost: start.evaluation.cost,
            norm_squared: start.gradient.norm_squared,
        });
        let mut recorder = Self {
            rows: Vec::new(),
            snapshots: Vec::new(),
            initial_cost: reference.cost,
            started_from: start.evaluation.cost,
            initial_norm_squared: reference.norm_squared,
        };
        recorder.keep_snapshot(problem, 0, start);
        recorder
    }

    /// Records the iteration from `before` to `after`.
    pub fn record(&mut self, problem: &Problem, before: &Iterate, after: &Iterate, step: f64) {
        let iteration = self.rows.len() as u64 + 1;
        self.rows.push(IterationRecord {
            iteration,
            cost: after.evaluation.cost,
            cost_ratio: ratio(after.evaluation.cost, self.initial_cost),
            gradient_norm_squared_ratio: ratio(
                before.gradient.norm_squared,
                self.initial_norm_squared,
            ),
            step,
            relative_change: before.relative_change(problem, &after.parameters),
        });
        self.keep_snapshot(problem, iteration, after);
    }

    fn keep_snapshot(&mut self, problem: &Problem, iteration: u64, point: &Iterate) {
        if SNAPSHOT_ITERATIONS.contains(&iteration) {
            let responses = &point.evaluation.trajectories;
            (self.snapshots).push(ResponseSnapshot::new(iteration, problem, responses));
        }
    }
}

/// Ratio `value / reference`, and 0 where both are zero.
pub(super) fn ratio(value: f64, reference: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / reference }
}
