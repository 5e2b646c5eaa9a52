//! Counted and timed evaluations: all solves of a search.

use super::iterate::Iterate;
use super::linearization::{Linearization, halfway, in_halves};
use super::settings::{FitSettings, QpSolver, Solver};
use super::solve_counts::{ADJOINT, FORWARD, QP, TANGENT};
use super::timings::{Timings, timed};
use crate::objective::{Evaluation, Gradient, GradientKind};
use crate::problem::Problem;
use crate::record::{Channel, Loss};
use crate::step::{EngineMode, SimulationError};
use std::sync::OnceLock;

/// Evaluator of a problem with argmin's counters; the solvers evaluate through it alone.
pub(crate) struct CountedEvaluator<'a, 'p> {
    problem: &'a mut argmin::core::Problem<&'p Problem>,
    kind: GradientKind,
    pub mode: EngineMode,
    /// Step at which the record is divided in two, for gradients from tangent solves without an adjoint.
    halfway: Option<usize>,
    /// Iteration limit of a quadratic program.
    pub program_iterations: u32,
    /// Solver of the programs.
    pub qp: QpSolver,
    /// Limit of the change in the last step, if the fit has one: then steps continue below the rounding error of the cost.
    pub step_limit: Option<f64>,
    /// Time by kind of work.
    pub timings: Timings,
}

impl<'a, 'p> CountedEvaluator<'a, 'p> {
    pub fn new(
        problem: &'a mut argmin::core::Problem<&'p Problem>,
        settings: &FitSettings,
    ) -> Self {
        let needs_jacobians =
            settings.solver == Solver::GaussNewton && settings.gradient == GradientKind::Discrete;
        let halfway = problem
            .problem
            .filter(|_| needs_jacobians)
            .and_then(halfway);
        let has_paper_order = settings.solver == Solver::SteepestDescent
            || settings.gradient == GradientKind::Continuous;
        Self {
            problem,
            halfway,
            kind: settings.gradient,
            mode: match has_paper_order {
                true => EngineMode::Reference,
                false => EngineMode::Fastest,
            },
            program_iterations: settings.stopping.program_iterations,
            qp: settings.qp,
            step_limit: settings.stopping.step,
            timings: Timings::default(),
        }
    }

    /// The problem, for operations without a solve.
    pub fn problem(&self) -> &'p Problem {
        self.problem
            .problem
            .expect("the executor holds the problem")
    }

    /// One forward solve into `evaluation`.
    pub fn evaluate_into(
        &mut self,
        parameters: &[f64],
        evaluation: &mut Evaluation,
    ) -> Result<(), SimulationError> {
        self.count(FORWARD, 1);
        let (problem, mode) = (self.problem(), self.mode);
        timed(&mut self.timings.forward, || {
            problem.evaluate_for(mode, parameters, evaluation)
        })
    }

    /// Several forward solves together.
    pub fn forwards<T>(&mut self, solves: u64, solve: impl FnOnce() -> T) -> T {
        self.count(FORWARD, solves);
        timed(&mut self.timings.forward, solve)
    }

    /// One adjoint solve at an evaluated point.
    pub fn gradient(&mut self, parameters: &[f64], evaluation: &Evaluation) -> Gradient {
        self.count(ADJOINT, 1);
        let (problem, kind) = (self.problem(), self.kind);
        timed(&mut self.timings.adjoint, || {
            problem.gradient(parameters, evaluation, kind)
        })
    }

    /// Counts the tangent solves of a linearisation that is not yet counted at its point.
    pub fn count_linearisation(&mut self, solves: u64) {
        if self.halfway.is_none() {
            self.count_tangents(solves);
        }
    }

    /// Counts tangent solves.
    pub fn count_tangents(&mut self, solves: u64) {
        self.count(TANGENT, solves);
    }

    /// One quadratic program.
    pub fn program<T>(&mut self, solve: impl FnOnce() -> T) -> T {
        self.count(QP, 1);
        timed(&mut self.timings.qp, solve)
    }

    /// Times linear algebra between solves.
    pub fn algebra<T>(&mut self, work: impl FnOnce() -> T) -> T {
        timed(&mut self.timings.linear_algebra, work)
    }

    /// Linearisation for a step from `point`.
    pub fn linearization(&mut self, point: &Iterate) -> Linearization {
        match point.linearization() {
            Linearization::Fresh if self.halfway.is_some() => self.linearise_again(point),
            known => known.clone(),
        }
    }

    /// Linearisation at `point` itself, without counting.
    pub fn linearise_again(&mut self, point: &Iterate) -> Linearization {
        Linearization::at(self.problem(), &point.evaluation, &mut self.timings)
    }

    /// [`CountedEvaluator::complete`] after a short step from `before`, whose `linearization` is reused where possible.
    pub fn complete_nearby(
        &mut self,
        before: &Iterate,
        linearization: &Linearization,
        parameters: Vec<f64>,
        evaluation: Evaluation,
    ) -> Iterate {
        let problem = self.problem();
        let is_squares = |c: &Channel| c.loss() == Loss::Squares;
        if linearization.reduced().is_none()
            || problem.is_regularised()
            || !problem.channels().all(is_squares)
        {
            return self.complete(parameters, evaluation);
        }
        let gradient = self.gradient(&parameters, &evaluation);
        match linearization.nearby(&before.parameters, &evaluation, &gradient) {
            Some(reused) => {
                Iterate::new(parameters, evaluation, gradient).with_cached(OnceLock::new(), reused)
            }
            None => self.complete(parameters, evaluation),
        }
    }

    /// Iterate from an evaluation, completed by its gradient.
    pub fn complete(&mut self, parameters: Vec<f64>, evaluation: Evaluation) -> Iterate {
        let mut timings = Timings::default();
        let point = self.completed(parameters, evaluation, &mut timings);
        self.timings += timings;
        if self.halfway.is_some() {
            self.count_tangents(point.parameters.len() as u64);
        }
        if point.linearization().reduced().is_none() {
            self.count(ADJOINT, 1);
        }
        point
    }

    /// [`CountedEvaluator::complete`] without counting: from the linearised halves of a long record, otherwise by an adjoint solve.
    fn completed(
        &self,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        timings: &mut Timings,
    ) -> Iterate {
        let problem = self.problem();
        if let Some(halfway) = self.halfway {
            let (reduced, sizes) = timed(&mut timings.tangent, || {
                let sizes = || problem.natural_scales(&evaluation);
                in_halves(problem, &evaluation, halfway, sizes)
            });
            if let Some(misfit) = reduced.misfit_gradient() {
                let gradient = problem.gradient_of_misfit(&parameters, misfit);
                let halves = Linearization::Halves(reduced);
                let point = Iterate::new(parameters, evaluation, gradient);
                return point.with_cached(sizes.into(), halves);
            }
        }
        let gradient = timed(&mut timings.adjoint, || {
            problem.gradient(&parameters, &evaluation, self.kind)
        });
        Iterate::new(parameters, evaluation, gradient)
    }

    fn count(&mut self, key: &'static str, solves: u64) {
        *self.problem.counts.entry(key).or_insert(0) += solves;
    }
}
