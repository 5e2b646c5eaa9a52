//! A finished fit.

use super::history::{IterationRecord, ResponseSnapshot, ratio};
use super::iterate::Iterate;
use super::optimality::{Optimality, judged};
use super::reason::Reason;
use super::settings::{FitSettings, Solver, StartStrategy};
use super::solve_counts::SolveCounts;
use super::termination::{Outcome, Status};
use super::timings::Timings;
use crate::host::Instant;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use std::time::Duration;

/// A finished fit: the best point, how it was reached and how it ended.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The point with the lowest cost.
    pub best: Iterate,
    /// Cost at the start values of the functions, whatever start the search took.
    pub initial_cost: f64,
    /// Cost at the point from which the search set out.
    pub started_from: f64,
    /// `G^2` at the start values.
    pub initial_norm_squared: f64,
    /// One row per iteration.
    pub history: Vec<IterationRecord>,
    /// Motions on the way.
    pub snapshots: Vec<ResponseSnapshot>,
    /// How it ended.
    pub outcome: Outcome,
    /// Work done.
    pub counts: SolveCounts,
    /// What that work took; the rest of `elapsed` is bookkeeping.
    pub timings: Timings,
    /// Wall-clock time.
    pub elapsed: Duration,
    /// The starts that were tried, in order.
    pub attempts: Vec<Attempt>,
    /// The first-order condition at the best point, once it is measured.
    pub optimality: Option<Optimality>,
}

impl Fit {
    /// This fit with the work of another one besides.
    pub(super) fn with_work_of(
        self,
        counts: SolveCounts,
        timings: Timings,
        elapsed: Duration,
    ) -> Self {
        Self {
            counts: self.counts + counts,
            timings: self.timings + timings,
            elapsed: self.elapsed + elapsed,
            ..self
        }
    }

    /// `J / J0`.
    pub fn cost_ratio(&self) -> f64 {
        ratio(self.best.evaluation.cost, self.initial_cost)
    }
}

/// One of several attempts: a search from one starting point.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Where it started.
    pub start: StartStrategy,
    /// J at its start; NaN if the start had no response.
    pub initial_cost: f64,
    /// J at its end; NaN if the start had no response.
    pub cost: f64,
    /// Iterations it took.
    pub iterations: u64,
    /// How it ended.
    pub outcome: Outcome,
}

impl Attempt {
    /// The attempt that ended with `fit`.
    pub(super) fn of(start: StartStrategy, fit: &Fit) -> Self {
        Self {
            start,
            initial_cost: fit.started_from,
            cost: fit.best.evaluation.cost,
            iterations: fit.history.len() as u64,
            outcome: fit.outcome.clone(),
        }
    }

    /// An attempt without a response at its start.
    pub(super) fn failed(start: StartStrategy, breakdown: SimulationError) -> Self {
        Self {
            start,
            initial_cost: f64::NAN,
            cost: f64::NAN,
            iterations: 0,
            outcome: Outcome::new(Status::Failed, Reason::NoResponse(breakdown)),
        }
    }
}

/// `fit` with its first-order condition measured, and `converged` taken back where it does not hold.
///
/// A fit that ended by a limit on `J / J0` or `G^2 / G0^2` did what was asked of it, whether there is a minimum or not.
/// The work is not counted: it is no part of the search.
pub(super) fn measured(problem: &Problem, mut fit: Fit, settings: &FitSettings) -> Fit {
    let status = fit.outcome.status;
    let cost = fit.best.evaluation.cost;
    let is_asked = |row: &IterationRecord| settings.stopping.ratios_met(row).is_some();
    // The equation error is measured by its own method; where J is zero there is nothing to be lowered.
    let is_search = settings.solver != Solver::EquationError && problem.parameters() > 0;
    let is_measurable = cost > 0.0 && cost.is_finite();
    // A fit that has done what it was asked for claims no minimum, and linearising takes time and memory.
    let is_claimed = status == Status::Converged && !fit.history.last().is_some_and(is_asked);
    if !is_search || !is_measurable || !is_claimed {
        return fit;
    }
    let clock = Instant::now();
    let tolerance = settings.stopping.tolerance.unwrap_or(0.0);
    fit.optimality = Optimality::at(problem, &fit.best, tolerance.max(Optimality::LEAST));
    fit.outcome = judged(fit.outcome, fit.optimality.as_ref());
    let took = clock.elapsed();
    fit.timings.linear_algebra += took;
    fit.elapsed += took;
    fit
}
