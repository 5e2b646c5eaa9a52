//! Result of a fit.

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
use crate::step::SimulationError;
use std::time::Duration;

/// Result of a fit: best point, history and outcome.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The point with the lowest cost.
    pub best: Iterate,
    /// Cost at the start values of the functions, also if the search started elsewhere.
    pub initial_cost: f64,
    /// Cost at the starting point of the search.
    pub started_from: f64,
    /// `G^2` at the start values.
    pub initial_norm_squared: f64,
    /// Iterations.
    pub history: Vec<IterationRecord>,
    /// Responses during the search.
    pub snapshots: Vec<ResponseSnapshot>,
    /// Outcome.
    pub outcome: Outcome,
    /// Number of solves.
    pub counts: SolveCounts,
    /// Time by kind of work; the rest of `elapsed` is overhead.
    pub timings: Timings,
    /// Wall-clock time.
    pub elapsed: Duration,
    /// Attempts, in order.
    pub attempts: Vec<Attempt>,
    /// First-order condition at the best point, if measured.
    pub optimality: Option<Optimality>,
}

impl Fit {
    /// The fit with the work of another one added.
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

    /// Ratio `J / J0`.
    pub fn cost_ratio(&self) -> f64 {
        ratio(self.best.evaluation.cost, self.initial_cost)
    }
}

/// One attempt: a search from one starting point.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Start strategy.
    pub start: StartStrategy,
    /// Cost at the starting point; NaN if the simulation failed.
    pub initial_cost: f64,
    /// Cost at the end; NaN if the simulation at the starting point failed.
    pub cost: f64,
    /// Iterations.
    pub history: Vec<IterationRecord>,
    /// Outcome.
    pub outcome: Outcome,
}

impl Attempt {
    /// Attempt that ended with `fit`.
    pub(super) fn of(start: StartStrategy, fit: &Fit) -> Self {
        Self {
            start,
            initial_cost: fit.started_from,
            cost: fit.best.evaluation.cost,
            history: fit.history.clone(),
            outcome: fit.outcome.clone(),
        }
    }

    /// Attempt whose simulation at the starting point failed.
    pub(super) fn failed(start: StartStrategy, breakdown: SimulationError) -> Self {
        Self {
            start,
            initial_cost: f64::NAN,
            cost: f64::NAN,
            history: Vec::new(),
            outcome: Outcome::new(Status::Failed, Reason::NoResponse(breakdown)),
        }
    }
}

/// Measures the first-order condition of `fit` and revokes `converged` where it does not hold.
///
/// A fit that ended by a limit on `J / J0` or `G^2 / G0^2` claims no minimum and is not measured. The work is not counted.
pub(super) fn measured(problem: &Problem, mut fit: Fit, settings: &FitSettings) -> Fit {
    let status = fit.outcome.status;
    let cost = fit.best.evaluation.cost;
    let is_asked = |row: &IterationRecord| settings.stopping.ratios_met(row).is_some();
    // The equation error has its own measure; with J = 0 nothing can be lowered.
    let is_search = settings.solver != Solver::EquationError && problem.parameters() > 0;
    let is_measurable = cost > 0.0 && cost.is_finite();
    // A fit that claims no minimum is not measured, which saves the linearisation.
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
