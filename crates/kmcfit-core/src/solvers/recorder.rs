//! What happened, iteration by iteration.

use super::Point;
use super::keep::{Bits, Standing, number_or_nan};
use crate::dynamics::Trajectory;
use crate::problem::Problem;
use serde::{Deserialize, Serialize};

/// One iteration: the cost after it, the gradient before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
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

/// A motion on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// After which iteration; 0 is the start.
    pub iteration: u64,
    /// The motion in each experiment.
    pub trajectories: Vec<Trajectory>,
}

/// Iterations after which the motion is kept for figures: the paper's Fig. 3b and its continuation.
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
    pub rows: Vec<Row>,
    pub snapshots: Vec<Snapshot>,
    pub initial_cost: f64,
    pub started_from: f64,
    pub initial_norm_squared: f64,
    /// The parameters of the snapshots.
    snapshot_parameters: Vec<Bits>,
}

impl Recorder {
    /// A record that begins at `start`, with ratios to `reference`, by default the start itself.
    pub fn new(start: &Point, reference: Option<Reference>) -> Self {
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

    /// The record of a search that stood here, with the motions that `at` computes; `None` where it is
    /// not whole.
    pub fn recalled(
        rows: Vec<Row>,
        standing: &Standing,
        at: impl Fn(&[f64]) -> Option<Vec<Trajectory>>,
    ) -> Option<Self> {
        let [initial_cost, started_from, initial_norm_squared] = *standing.references.0.as_slice()
        else {
            return None;
        };
        let known = standing.snapshots.iter().map(|(iteration, _)| iteration);
        let expected = SNAPSHOT_ITERATIONS.iter();
        if !known.eq(expected.take_while(|i| **i <= standing.iterations))
            || rows.len() as u64 != standing.iterations
        {
            return None;
        }
        let snapshots = standing.snapshots.iter().map(|(iteration, parameters)| {
            Some(Snapshot {
                iteration: *iteration,
                trajectories: at(&parameters.0)?,
            })
        });
        Some(Self {
            rows,
            snapshots: snapshots.collect::<Option<_>>()?,
            initial_cost,
            started_from,
            initial_norm_squared,
            snapshot_parameters: (standing.snapshots.iter())
                .map(|(_, parameters)| parameters.clone())
                .collect(),
        })
    }

    /// The points of the snapshots, by iteration.
    pub fn snapshot_points(&self) -> Vec<(u64, Bits)> {
        let iterations = self.snapshots.iter().map(|s| s.iteration);
        iterations
            .zip(self.snapshot_parameters.iter().cloned())
            .collect()
    }

    /// Records the iteration that led from `before` to `after`.
    pub fn record(&mut self, problem: &Problem, before: &Point, after: &Point, step: f64) {
        let iteration = self.rows.len() as u64 + 1;
        self.rows.push(Row {
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

    fn keep_snapshot(&mut self, iteration: u64, point: &Point) {
        if SNAPSHOT_ITERATIONS.contains(&iteration) {
            self.snapshots.push(Snapshot {
                iteration,
                trajectories: point.evaluation.trajectories.clone(),
            });
            self.snapshot_parameters
                .push(Bits(point.parameters.clone()));
        }
    }
}

/// `value / reference`, and 0 where both are zero: a start without misfit stays without misfit.
pub(super) fn ratio(value: f64, reference: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / reference }
}
