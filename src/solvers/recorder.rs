//! What happened, iteration by iteration.

use super::Point;
use crate::dynamics::Trajectory;
use crate::problem::Problem;

/// One iteration: the cost after it, the gradient before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Iteration, from 1.
    pub iteration: u64,
    /// `J` after the iteration.
    pub cost: f64,
    /// `J / J0`.
    pub cost_ratio: f64,
    /// `G^2` before the iteration over its first value.
    pub gradient_norm_squared_ratio: f64,
    /// Step length along the solver's direction.
    pub step: f64,
    /// Largest change of a function relative to its natural size ([`Problem::relative_change`]).
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
        };
        recorder.keep_snapshot(0, start);
        recorder
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
            relative_change: problem.relative_change(
                &before.evaluation,
                &before.parameters,
                &after.parameters,
            ),
        });
        self.keep_snapshot(iteration, after);
    }

    fn keep_snapshot(&mut self, iteration: u64, point: &Point) {
        if SNAPSHOT_ITERATIONS.contains(&iteration) {
            self.snapshots.push(Snapshot {
                iteration,
                trajectories: point.evaluation.trajectories.clone(),
            });
        }
    }
}

/// `value / reference`, and 0 where both are zero: a start without misfit stays without misfit.
pub(super) fn ratio(value: f64, reference: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / reference }
}
