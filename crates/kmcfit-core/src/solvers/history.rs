//! The history of a fit: one record for each iteration.

use super::iterate::Iterate;
use crate::problem::Problem;
use crate::simulate::Trajectory;
use serde::{Deserialize, Deserializer, Serialize};

/// One iteration: the cost after it, the gradient before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Iteration, from 1.
    pub iteration: u64,
    /// `J` after the iteration.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost: f64,
    /// `J / J0`.
    #[serde(deserialize_with = "number_or_nan")]
    pub cost_ratio: f64,
    /// `G^2` before the iteration over its first value.
    #[serde(deserialize_with = "number_or_nan")]
    pub gradient_norm_squared_ratio: f64,
    /// Step length along the solver's direction.
    #[serde(deserialize_with = "number_or_nan")]
    pub step: f64,
    /// Largest change of a function relative to its natural size ([`Problem::relative_change`]).
    #[serde(deserialize_with = "number_or_nan")]
    pub relative_change: f64,
}

/// A response on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSnapshot {
    /// After which iteration; 0 is the start.
    pub iteration: u64,
    /// The response in each experiment.
    pub trajectories: Vec<Trajectory>,
}

/// Iterations after which the response is kept for figures: the paper's Fig. 3b and its continuation.
pub const SNAPSHOT_ITERATIONS: [u64; 8] = [0, 10, 30, 100, 300, 1000, 3000, 10_000];

/// What the ratios of a run are taken to: `J0` and `G0^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reference {
    pub cost: f64,
    pub norm_squared: f64,
}

/// History and snapshots of one run.
#[derive(Debug)]
pub(super) struct Recorder {
    pub rows: Vec<IterationRecord>,
    pub snapshots: Vec<ResponseSnapshot>,
    pub initial_cost: f64,
    pub started_from: f64,
    pub initial_norm_squared: f64,
    /// The parameters of the snapshots.
    snapshot_parameters: Vec<Vec<f64>>,
}

impl Recorder {
    /// A record that begins at `start`, with ratios to `reference`, by default the start itself.
    pub fn new(start: &Iterate, reference: Option<Reference>) -> Self {
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
            snapshot_parameters: Vec::new(),
        };
        recorder.keep_snapshot(0, start);
        recorder
    }

    /// The record of a search that stood here: `references` are [`Recorder::references`], `snapshots` those of
    /// [`Recorder::snapshot_points`], with the responses that `at` computes. `None` where it is incomplete.
    pub fn restored(
        rows: Vec<IterationRecord>,
        references: &[f64],
        snapshots: Vec<(u64, Vec<f64>)>,
        at: impl Fn(&[f64]) -> Option<Vec<Trajectory>>,
    ) -> Option<Self> {
        let [initial_cost, started_from, initial_norm_squared] = *references else {
            return None;
        };
        let iterations = rows.len() as u64;
        let known = snapshots.iter().map(|(iteration, _)| iteration);
        let expected = SNAPSHOT_ITERATIONS.iter();
        if !known.eq(expected.take_while(|i| **i <= iterations)) {
            return None;
        }
        let restored = snapshots.iter().map(|(iteration, parameters)| {
            Some(ResponseSnapshot {
                iteration: *iteration,
                trajectories: at(parameters)?,
            })
        });
        Some(Self {
            rows,
            snapshots: restored.collect::<Option<_>>()?,
            initial_cost,
            started_from,
            initial_norm_squared,
            snapshot_parameters: snapshots.into_iter().map(|(_, at)| at).collect(),
        })
    }

    /// `J0`, the cost from which the search set out, and `G0^2`.
    pub fn references(&self) -> Vec<f64> {
        vec![
            self.initial_cost,
            self.started_from,
            self.initial_norm_squared,
        ]
    }

    /// The parameters at the snapshots, by iteration.
    pub fn snapshot_points(&self) -> impl Iterator<Item = (u64, &[f64])> {
        let iterations = self.snapshots.iter().map(|s| s.iteration);
        iterations.zip(self.snapshot_parameters.iter().map(Vec::as_slice))
    }

    /// Records the iteration that led from `before` to `after`.
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
        self.keep_snapshot(iteration, after);
    }

    fn keep_snapshot(&mut self, iteration: u64, point: &Iterate) {
        if SNAPSHOT_ITERATIONS.contains(&iteration) {
            self.snapshots.push(ResponseSnapshot {
                iteration,
                trajectories: point.evaluation.trajectories.clone(),
            });
            self.snapshot_parameters.push(point.parameters.clone());
        }
    }
}

/// `value / reference`, and 0 where both are zero: a start without misfit stays without misfit.
pub(super) fn ratio(value: f64, reference: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / reference }
}

/// JSON has no word for a number that is not finite.
pub fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
