//! Stopping tests and outcome of a fit.

use super::history::IterationRecord;
use super::reason::{BoundedValue, Reason};
use crate::qp::Subproblem;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Status of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A stopping test of the model was met.
    Converged,
    /// Exactly the requested iterations were run, without a stopping test.
    Completed,
    /// The iteration limit was reached before a stopping test was met.
    MaxIterations,
    /// The wall-clock limit was reached.
    TimeLimit,
    /// No step lowers the cost although no stopping test is met.
    Stalled,
    /// Interrupted by the user.
    Interrupted,
    /// No feasible point can be simulated.
    Infeasible,
    /// The start cannot be simulated.
    Failed,
}

impl Status {
    /// Name in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::Completed => "completed",
            Status::MaxIterations => "max-iterations",
            Status::TimeLimit => "time-limit",
            Status::Stalled => "stalled",
            Status::Interrupted => "interrupted",
            Status::Infeasible => "infeasible",
            Status::Failed => "failed",
        }
    }
}

/// Status of a fit and its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Status.
    pub status: Status,
    /// Reason; displayed as one sentence.
    pub reason: Reason,
}

impl Outcome {
    pub(crate) fn new(status: Status, reason: Reason) -> Self {
        Self { status, reason }
    }
}

/// Stopping tests and limits. The iteration limit always applies, the others where set.
#[derive(Debug, Clone, PartialEq)]
pub struct Stopping {
    /// Iteration limit. Without another test the fit runs exactly so many iterations and is `completed`.
    pub iterations: u64,
    /// Converged when `J / J0` is at most this (and `gradient_ratio` holds, if given).
    pub cost_ratio: Option<f64>,
    /// Converged when `G^2 / G0^2` is at most this (and `cost_ratio` holds, if given). `G^2` is taken
    /// at the start of the iteration, as in the paper.
    pub gradient_ratio: Option<f64>,
    /// Converged when an iteration lowers `J` by at most this fraction and changes no function by more than its square root,
    /// relative to its natural size; or when it changes none by more than this.
    pub tolerance: Option<f64>,
    /// Converged when an iteration changes no function by more than this, relative to its natural
    /// size ([`crate::problem::Problem::relative_change`]).
    pub step: Option<f64>,
    /// Wall-clock limit.
    pub limit: Option<Duration>,
    /// Iteration limit of a quadratic program ([`Subproblem::ITERATIONS`] by default), beyond which it has stalled.
    pub program_iterations: u32,
}

impl Default for Stopping {
    /// 1000 iterations or a tolerance of 1e-10.
    fn default() -> Self {
        Self {
            tolerance: Some(1e-10),
            ..Self::exactly(1000)
        }
    }
}

impl Stopping {
    /// Exactly `iterations` iterations.
    pub fn exactly(iterations: u64) -> Self {
        Self {
            iterations,
            cost_ratio: None,
            gradient_ratio: None,
            tolerance: None,
            step: None,
            limit: None,
            program_iterations: Subproblem::ITERATIONS,
        }
    }

    /// True if any convergence test is set.
    pub fn has_test(&self) -> bool {
        let tests = [
            self.cost_ratio,
            self.gradient_ratio,
            self.tolerance,
            self.step,
        ];
        tests.iter().any(Option::is_some)
    }

    /// Outcome after the latest iteration, if the fit ends. `previous_cost` is J before it; a small step that was `limited` is no
    /// sign of convergence.
    pub(crate) fn after(
        &self,
        row: &IterationRecord,
        previous_cost: f64,
        limited: bool,
    ) -> Option<Outcome> {
        let small_step = || (!limited).then(|| self.small_step(row, previous_cost));
        self.ratios_met(row)
            .or_else(|| small_step().flatten())
            .map(|reason| Outcome::new(Status::Converged, reason))
            .or_else(|| self.out_of_iterations(row.iteration))
    }

    pub(crate) fn out_of_iterations(&self, iteration: u64) -> Option<Outcome> {
        let exhausted = iteration >= self.iterations;
        exhausted.then(|| match self.has_test() {
            true => Outcome::new(Status::MaxIterations, Reason::IterationLimit(iteration)),
            false => Outcome::new(Status::Completed, Reason::AllIterations(iteration)),
        })
    }

    /// Ratios of cost and gradient of `row`, if within all limits that are set; no sign of a minimum.
    pub(super) fn ratios_met(&self, row: &IterationRecord) -> Option<Reason> {
        let test =
            |value: f64, limit: Option<f64>| limit.map(|limit| BoundedValue { value, limit });
        let cost = test(row.cost_ratio, self.cost_ratio);
        let gradient = test(row.gradient_norm_squared_ratio, self.gradient_ratio);
        let is_met = |test: &BoundedValue| test.value <= test.limit;
        let mut given = cost.iter().chain(&gradient).peekable();
        (given.peek().is_some() && given.all(is_met)).then_some(Reason::Ratios { cost, gradient })
    }

    fn small_step(&self, row: &IterationRecord, previous_cost: f64) -> Option<Reason> {
        let change = row.relative_change;
        let decrease = (previous_cost - row.cost) / previous_cost.max(f64::MIN_POSITIVE);
        let within = |limit: Option<f64>, value: f64| limit.is_some_and(|limit| value <= limit);
        let limits = [self.step, self.tolerance];
        if let Some(limit) = limits.into_iter().flatten().find(|limit| change <= *limit) {
            let value = change;
            return Some(Reason::SmallChange(BoundedValue { value, limit }));
        }
        let is_flat =
            within(self.tolerance, decrease) && within(self.tolerance.map(f64::sqrt), change);
        is_flat.then_some(Reason::SmallDecrease { decrease, change })
    }
}
