//! The loop around every solver, run by argmin's executor.

use super::gauss_newton::GaussNewton;
use super::lbfgs::Lbfgs;
use super::outcome::{Outcome, Status};
use super::point::{Counts, Point, Work};
use super::projected_gradient::ProjectedGradient;
use super::recorder::{Recorder, Reference, Row, Snapshot, ratio};
use super::steepest_descent::SteepestDescent;
use super::{Descend, FitSettings, Rung, Solver, Step, Timings, equation_error};
use crate::dynamics::{Breakdown, Cause};
use crate::problem::Problem;
use argmin::core::{Error, Executor, IterState, KV, TerminationReason, TerminationStatus};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A finished fit: the best point, how it was reached and how it ended.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The point with the lowest cost.
    pub best: Point,
    /// Cost at the start values of the functions, whatever start the search took.
    pub initial_cost: f64,
    /// Cost at the point from which the search set out.
    pub started_from: f64,
    /// `G^2` at the start values.
    pub initial_norm_squared: f64,
    /// One row per iteration.
    pub history: Vec<Row>,
    /// Motions on the way.
    pub snapshots: Vec<Snapshot>,
    /// How it ended.
    pub outcome: Outcome,
    /// Work done.
    pub counts: Counts,
    /// What that work took; the rest of `elapsed` is bookkeeping.
    pub timings: Timings,
    /// Wall-clock time.
    pub elapsed: Duration,
    /// The starts that were tried, in order.
    pub rungs: Vec<Rung>,
}

impl Fit {
    /// `J / J0`.
    pub fn cost_ratio(&self) -> f64 {
        ratio(self.best.evaluation.cost, self.initial_cost)
    }
}

/// Runs one solver from `start`; `observe` is called after every iteration. `reference` is what the
/// ratios of cost and gradient are taken to, by default the start itself.
///
/// Every method accepts only points of lower cost, so the last point is the best one. The equation
/// error is no search: it is minimised at once.
///
/// # Errors
/// A [`Breakdown`] if the start itself cannot be evaluated.
pub(super) fn search(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    reference: Option<Reference>,
    observe: &mut dyn FnMut(&Row),
) -> Result<Fit, Breakdown> {
    if settings.solver == Solver::EquationError {
        return Ok(equation_error::fit(problem, start, observe));
    }
    let run = Run {
        method: method(settings.solver),
        settings,
        reference,
        clock: Instant::now(),
        timings: Timings::default(),
        progress: Err(NOT_STARTED),
        outcome: None,
        observe,
    };
    let result = Executor::new(problem, run)
        .configure(|state: SearchState| state.param(start.to_vec()))
        .ctrlc(false)
        .timer(false)
        .run()
        .expect("Run reports by outcome and never returns an error to the executor");
    let counts = Counts::of(&result.problem);
    result.solver.finish(counts)
}

/// One search from `start` alone, without the ladder of [`fit`](super::fit): for fits whose start is
/// near an optimum, or whose start is the question.
///
/// # Errors
/// A [`Breakdown`] if the start itself has no motion.
pub fn fit_from(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
) -> Result<Fit, Breakdown> {
    search(problem, start, settings, None, &mut |_| {})
}

fn method(solver: Solver) -> Box<dyn Descend> {
    match solver {
        Solver::SteepestDescent => Box::<SteepestDescent>::default(),
        Solver::Lbfgs { memory } => Box::new(Lbfgs::new(memory)),
        Solver::ProjectedGradient => Box::<ProjectedGradient>::default(),
        Solver::GaussNewton => Box::<GaussNewton>::default(),
        Solver::EquationError => unreachable!("it takes no steps"),
    }
}

/// One method at work, seen by argmin as a solver.
struct Run<'a> {
    method: Box<dyn Descend>,
    settings: &'a FitSettings,
    reference: Option<Reference>,
    clock: Instant,
    timings: Timings,
    progress: Result<Progress, Breakdown>,
    outcome: Option<Outcome>,
    observe: &'a mut dyn FnMut(&Row),
}

struct Progress {
    point: Point,
    recorder: Recorder,
}

/// What `progress` holds until argmin calls `init`.
const NOT_STARTED: Breakdown = Breakdown {
    cause: Cause::Overflow,
    node: 0,
    time: f64::NAN,
    value: f64::NAN,
};

/// argmin's view of the search: parameters and cost; the rest lives in [`Run`].
type SearchState = IterState<Vec<f64>, (), (), (), (), f64>;

impl Run<'_> {
    fn start(&self, work: &mut Work, parameters: Vec<f64>) -> Result<Progress, Breakdown> {
        let mut evaluation = work.problem().workspace();
        work.evaluate_into(&parameters, &mut evaluation)?;
        let point = work.complete(parameters, evaluation);
        Ok(Progress {
            recorder: Recorder::new(&point, self.reference),
            point,
        })
    }

    fn advance(&mut self, work: &mut Work) {
        let Ok(progress) = &mut self.progress else {
            return;
        };
        let before = &progress.point;
        match self.method.step(work, before) {
            Step::Stuck(reason) => self.outcome = Some(Outcome::new(Status::Stalled, reason)),
            Step::Minimum(reason) => self.outcome = Some(Outcome::new(Status::Converged, reason)),
            Step::Infeasible(reason) => {
                self.outcome = Some(Outcome::new(Status::Infeasible, reason))
            }
            Step::Moved {
                point,
                length,
                hindered,
            } => {
                progress
                    .recorder
                    .record(work.problem(), before, &point, length);
                let previous_cost = before.evaluation.cost;
                progress.point = *point;
                if let Some(row) = progress.recorder.rows.last() {
                    (self.observe)(row);
                    let stopping = &self.settings.stopping;
                    self.outcome = stopping.after(row, previous_cost, hindered);
                }
            }
        }
        if self.outcome.is_none() {
            self.outcome = self.ended_from_outside();
        }
    }

    /// The outcome of a search that is over before its first iteration.
    fn nothing_to_do(&self, problem: Option<&Problem>) -> Option<Outcome> {
        let cost = self.progress.as_ref().ok()?.point.evaluation.cost;
        let converged = |reason: &str| Some(Outcome::new(Status::Converged, reason));
        if problem.is_some_and(|p| p.parameters() == 0) {
            return converged("there is nothing to fit: every function is fixed");
        }
        if cost == 0.0 {
            // Squares of readings below 1e-154 are zero.
            return match problem.is_some_and(|p| p.misfit_of_silence() == 0.0) {
                true => converged(
                    "there is nothing to explain: the readings, or their squares, are zero",
                ),
                false => converged("the start fits exactly"),
            };
        }
        self.settings.stopping.out_of_iterations(0)
    }

    fn ended_from_outside(&self) -> Option<Outcome> {
        let flag = self.settings.interrupt.as_ref();
        if flag.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            let reason = "interrupted; the best point so far is kept";
            return Some(Outcome::new(Status::Interrupted, reason));
        }
        let limit = self.settings.stopping.limit?;
        (self.clock.elapsed() >= limit).then(|| {
            let reason = format!("the limit of {} s is reached", limit.as_secs_f64());
            Outcome::new(Status::TimeLimit, reason)
        })
    }

    fn finish(self, counts: Counts) -> Result<Fit, Breakdown> {
        let Progress { point, recorder } = self.progress?;
        Ok(Fit {
            best: point,
            initial_cost: recorder.initial_cost,
            started_from: recorder.started_from,
            initial_norm_squared: recorder.initial_norm_squared,
            history: recorder.rows,
            snapshots: recorder.snapshots,
            outcome: self
                .outcome
                .unwrap_or_else(|| Outcome::new(Status::Failed, "the search ended without a word")),
            counts,
            timings: self.timings,
            elapsed: self.clock.elapsed(),
            rungs: Vec::new(),
        })
    }

    fn view(&self, state: SearchState) -> SearchState {
        match &self.progress {
            Ok(Progress { point, .. }) => state
                .param(point.parameters.clone())
                .cost(point.evaluation.cost),
            Err(_) => state,
        }
    }
}

impl<'p> argmin::core::Solver<&'p Problem, SearchState> for Run<'_> {
    fn name(&self) -> &str {
        self.settings.solver.name()
    }

    fn init(
        &mut self,
        problem: &mut argmin::core::Problem<&'p Problem>,
        mut state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let parameters = state.take_param().unwrap_or_default();
        let mut work = Work::new(problem, self.settings);
        self.progress = self.start(&mut work, parameters);
        self.timings += work.timings;
        self.outcome = self.nothing_to_do(problem.problem);
        Ok((self.view(state), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut argmin::core::Problem<&'p Problem>,
        state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let mut work = Work::new(problem, self.settings);
        self.advance(&mut work);
        self.timings += work.timings;
        Ok((self.view(state), None))
    }

    fn terminate(&mut self, _state: &SearchState) -> TerminationStatus {
        match (&self.outcome, &self.progress) {
            (Some(outcome), _) => {
                TerminationStatus::Terminated(TerminationReason::SolverExit(outcome.reason.clone()))
            }
            (None, Err(breakdown)) => {
                TerminationStatus::Terminated(TerminationReason::SolverExit(breakdown.to_string()))
            }
            (None, Ok(_)) => TerminationStatus::NotTerminated,
        }
    }
}
