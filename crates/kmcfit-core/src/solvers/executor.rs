//! Loop of a search: initialisation, iterations and stopping tests, run by argmin's executor.

use super::evaluator::CountedEvaluator;
use super::fit::{Fit, measured};
use super::history::{IterationRecord, Recorder, Reference};
use super::iterate::Iterate;
use super::methods::{Step, StepRule, equation_error, step_rule};
use super::observer::Observer;
use super::reason::Reason;
use super::settings::{FitSettings, Solver};
use super::solve_counts::SolveCounts;
use super::termination::{Outcome, Status};
use super::timings::Timings;
use crate::host::Instant;
use crate::objective::{Evaluation, GradientKind};
use crate::problem::Problem;
use crate::record::Channel;
use crate::step::SimulationError;
use crate::threads::is_stopped;
use argmin::core::{Error, Executor, IterState, KV, TerminationReason, TerminationStatus};
use std::sync::atomic::Ordering;

/// Runs one solver from `start`, reporting to `watch`.
///
/// Every method accepts only points of lower cost, so the last point is the best one. The equation error is not a search;
/// it is minimised directly.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the start fails.
pub(super) fn search(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    reference: Option<Reference>,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    let prepared = Prepared {
        parameters: start.to_vec(),
        evaluation: None,
        workspace: None,
    };
    search_prepared(problem, prepared, settings, reference, observer)
}

/// Starting point of a search.
pub(super) struct Prepared {
    /// The parameters.
    pub parameters: Vec<f64>,
    /// Evaluation, if already computed.
    pub evaluation: Option<Evaluation>,
    /// Storage for the first trial, if available.
    pub workspace: Option<Evaluation>,
}

/// [`search`] from a prepared starting point.
pub(super) fn search_prepared(
    problem: &Problem,
    prepared: Prepared,
    settings: &FitSettings,
    reference: Option<Reference>,
    observer: &mut Observer,
) -> Result<Fit, SimulationError> {
    if settings.solver == Solver::EquationError {
        return Ok(equation_error::fit(
            problem,
            &prepared.parameters,
            observer.observe(),
        ));
    }
    // Samples of a part of a record do not cover all nodes of the grid.
    let mut settings = settings.clone();
    if !problem.supports_continuous() {
        settings.gradient = GradientKind::Discrete;
    }
    let settings = &settings;
    let mut method = step_rule(settings.solver);
    if let Some(workspace) = prepared.workspace {
        method.recycle(workspace);
    }
    let run = SearchDriver {
        method,
        settings,
        reference,
        at_start: prepared.evaluation,
        clock: Instant::now(),
        timings: Timings::default(),
        progress: None,
        failure: None,
        outcome: None,
        observer,
    };
    let result = Executor::new(problem, run)
        .configure(|state: SearchState| state.param(prepared.parameters))
        .ctrlc(false)
        .timer(false)
        .run()
        .expect("SearchDriver reports by outcome and never returns an error to the executor");
    let counts = SolveCounts::of(&result.problem);
    result.solver.finish(counts)
}

/// One search from `start`, without the other starting points of [`fit`](super::fit()): for a start near a minimum, and for
/// multistart analyses.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the start fails.
pub fn fit_from(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
) -> Result<Fit, SimulationError> {
    let fit = search_unobserved(problem, start, settings)?;
    Ok(measured(problem, fit, settings))
}

/// [`search`] without an observer.
pub(super) fn search_unobserved(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
) -> Result<Fit, SimulationError> {
    let nothing = &mut |_: &IterationRecord| {};
    search(problem, start, settings, None, &mut Observer::new(nothing))
}

/// A method in the form of an argmin solver.
struct SearchDriver<'a, 'w> {
    method: Box<dyn StepRule>,
    settings: &'a FitSettings,
    reference: Option<Reference>,
    /// Evaluation at the start, if already computed.
    at_start: Option<Evaluation>,
    clock: Instant,
    timings: Timings,
    /// `None` before initialisation, and where the simulation at the start fails.
    progress: Option<SearchProgress>,
    /// Error of the simulation at the start.
    failure: Option<SimulationError>,
    outcome: Option<Outcome>,
    observer: &'a mut Observer<'w>,
}

struct SearchProgress {
    point: Iterate,
    recorder: Recorder,
}

/// State passed to argmin: parameters and cost; the remaining state is in [`SearchDriver`].
type SearchState = IterState<Vec<f64>, (), (), (), (), f64>;

impl SearchDriver<'_, '_> {
    fn start(
        &mut self,
        work: &mut CountedEvaluator,
        parameters: Vec<f64>,
    ) -> Result<SearchProgress, SimulationError> {
        let evaluation = match self.at_start.take() {
            Some(evaluation) => work.forwards(1, || evaluation),
            None => {
                let mut evaluation = work.problem().workspace();
                work.evaluate_into(&parameters, &mut evaluation)?;
                evaluation
            }
        };
        let point = work.complete(parameters, evaluation);
        Ok(SearchProgress {
            recorder: Recorder::new(work.problem(), &point, self.reference),
            point,
        })
    }

    fn advance(&mut self, work: &mut CountedEvaluator) {
        let Some(progress) = &mut self.progress else {
            return;
        };
        let before = &progress.point;
        match self.method.step(work, before) {
            Step::Stuck(reason) => self.outcome = Some(Outcome::new(Status::Stalled, reason)),
            Step::Minimum(reason) => self.outcome = Some(Outcome::new(Status::Converged, reason)),
            Step::Infeasible(reason) => {
                self.outcome = Some(Outcome::new(Status::Infeasible, reason));
            }
            Step::Moved {
                point,
                length,
                limited,
            } => {
                progress
                    .recorder
                    .record(work.problem(), before, &point, length);
                let previous_cost = before.evaluation.cost;
                let left = std::mem::replace(&mut progress.point, *point);
                self.method.recycle(left.evaluation);
                if let Some(row) = progress.recorder.rows.last() {
                    let (constraints, at) = (&work.problem().constraints, &progress.point);
                    self.observer.iteration(row, || {
                        let worst = constraints.largest_violation(&at.parameters)?;
                        Some(worst.relative.max(0.0))
                    });
                    let stopping = &self.settings.stopping;
                    self.outcome = stopping.after(row, previous_cost, limited);
                }
            }
        }
        if self.outcome.is_none() {
            self.outcome = self.out_of_time();
        }
        self.obey();
    }

    /// Outcome of a search that ends before its first iteration.
    fn nothing_to_do(&self, problem: Option<&Problem>) -> Option<Outcome> {
        let cost = self.progress.as_ref()?.point.evaluation.cost;
        let converged = |reason| Some(Outcome::new(Status::Converged, reason));
        if problem.is_some_and(|p| p.parameters() == 0) {
            return converged(Reason::NoParameters);
        }
        if cost == 0.0 {
            // With an infinite sigma, the result of squares beyond 1e308, every residual is zero.
            let infinite = |c: &Channel| c.weighting().sigma(0).is_some_and(|s| !s.is_finite());
            if problem.is_some_and(|p| p.channels().any(infinite)) {
                return Some(Outcome::new(Status::Failed, Reason::Overflow));
            }
            // Squares of samples below 1e-154 underflow.
            return match problem.is_some_and(|p| p.zero_response_misfit() == 0.0) {
                true => converged(Reason::ZeroSamples),
                false => converged(Reason::ExactStart),
            };
        }
        self.settings.stopping.out_of_iterations(0)
    }

    /// Ends a search that is to be interrupted, which others may follow: one that converges in the same iteration as well. Fits within an
    /// assessment have no flag of their own.
    fn obey(&mut self) {
        let flag = self.settings.interrupt.as_ref();
        let is_asked = is_stopped() || flag.is_some_and(|flag| flag.load(Ordering::Relaxed));
        let has_failed = |o: &Outcome| matches!(o.status, Status::Failed | Status::Infeasible);
        if is_asked && !self.outcome.as_ref().is_some_and(has_failed) {
            self.outcome = Some(Outcome::new(Status::Interrupted, Reason::Interrupted));
        }
    }

    fn out_of_time(&self) -> Option<Outcome> {
        let limit = self.settings.stopping.limit?;
        let is_over = self.clock.elapsed() >= limit;
        is_over.then(|| Outcome::new(Status::TimeLimit, Reason::TimeLimit(limit)))
    }

    fn finish(self, counts: SolveCounts) -> Result<Fit, SimulationError> {
        let elapsed = self.clock.elapsed();
        let Some(SearchProgress { point, recorder }) = self.progress else {
            return Err(self.failure.expect("a search starts, or there is a reason"));
        };
        Ok(Fit {
            best: point,
            initial_cost: recorder.initial_cost,
            started_from: recorder.started_from,
            initial_norm_squared: recorder.initial_norm_squared,
            history: recorder.rows,
            snapshots: recorder.snapshots,
            outcome: self.outcome.expect("a search ends with an outcome"),
            counts,
            timings: self.timings,
            elapsed,
            attempts: Vec::new(),
            optimality: None,
        })
    }

    fn view(&self, state: SearchState) -> SearchState {
        match &self.progress {
            Some(SearchProgress { point, .. }) => state
                .param(point.parameters.clone())
                .cost(point.evaluation.cost),
            None => state,
        }
    }
}

impl<'p> argmin::core::Solver<&'p Problem, SearchState> for SearchDriver<'_, '_> {
    fn name(&self) -> &str {
        self.settings.solver.name()
    }

    fn init(
        &mut self,
        problem: &mut argmin::core::Problem<&'p Problem>,
        mut state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let parameters = state.take_param().unwrap_or_default();
        let mut work = CountedEvaluator::new(problem, self.settings);
        match self.start(&mut work, parameters) {
            Ok(progress) => self.progress = Some(progress),
            Err(failure) => self.failure = Some(failure),
        }
        self.timings += work.timings;
        self.outcome = self.nothing_to_do(problem.problem);
        self.obey();
        Ok((self.view(state), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut argmin::core::Problem<&'p Problem>,
        state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let mut work = CountedEvaluator::new(problem, self.settings);
        self.advance(&mut work);
        self.timings += work.timings;
        Ok((self.view(state), None))
    }

    fn terminate(&mut self, _state: &SearchState) -> TerminationStatus {
        let outcome = self
            .outcome
            .as_ref()
            .map(|outcome| outcome.reason.to_string());
        match outcome.or_else(|| Some(self.failure?.to_string())) {
            Some(why) => TerminationStatus::Terminated(TerminationReason::SolverExit(why)),
            None => TerminationStatus::NotTerminated,
        }
    }
}
