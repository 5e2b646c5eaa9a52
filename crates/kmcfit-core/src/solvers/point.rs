//! A point of the search, and the counted and timed work that makes one.

use super::ahead::Ahead;
use super::gauss_newton::Reduced;
use super::timings::{Timings, timed};
use super::{FitSettings, Solver};
use crate::dynamics::{Breakdown, Trajectory};
use crate::objective::{Channel, Evaluation, Gradient, GradientKind, Loss};
use crate::problem::Problem;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Parameters with everything known about them.
#[derive(Debug, Clone)]
pub struct Point {
    /// Parameters of all functions.
    pub parameters: Vec<f64>,
    /// Cost, device and motions.
    pub evaluation: Evaluation,
    /// Gradient of the cost.
    pub gradient: Gradient,
    sizes: Sizes,
}

/// The natural sizes at a point, once somebody has asked for them.
#[derive(Clone, Default)]
struct Sizes(OnceLock<Vec<f64>>);

impl std::fmt::Debug for Sizes {
    /// Whether somebody has asked is no part of a point.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("…")
    }
}

impl Point {
    pub(crate) fn new(parameters: Vec<f64>, evaluation: Evaluation, gradient: Gradient) -> Self {
        Self {
            parameters,
            evaluation,
            gradient,
            sizes: Sizes::default(),
        }
    }

    /// With [`Problem::natural_sizes`] here.
    pub(crate) fn with_sizes(self, sizes: Vec<f64>) -> Self {
        let sizes = Sizes(OnceLock::from(sizes));
        Self { sizes, ..self }
    }

    /// [`Problem::natural_sizes`] here.
    fn natural_sizes(&self, problem: &Problem) -> &[f64] {
        (self.sizes.0).get_or_init(|| problem.natural_sizes(&self.evaluation))
    }

    /// [`Functions::relative_metric`](crate::functions::Functions::relative_metric) with the sizes here, over the
    /// whole grid.
    pub(crate) fn relative_metric(&self, problem: &Problem) -> Vec<f64> {
        let duration = problem.oscillator.grid.duration();
        (problem.functions).relative_metric(self.natural_sizes(problem), duration)
    }

    /// [`Problem::relative_change`] from here to the parameters `after`.
    pub(crate) fn relative_change(&self, problem: &Problem, after: &[f64]) -> f64 {
        self.distance(problem, &self.parameters, after)
    }

    /// [`Problem::relative_change`] between two lists of parameters, by the sizes here.
    pub(crate) fn distance(&self, problem: &Problem, from: &[f64], to: &[f64]) -> f64 {
        problem.change_in_sizes(self.natural_sizes(problem), from, to)
    }
}

/// How often the equations were solved; one count is one pass over all experiments, or over the part of them that a
/// start is sought in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Forward solves.
    pub forward: u64,
    /// Adjoint solves.
    pub adjoint: u64,
    /// Tangent solves, one for each parameter.
    pub tangent: u64,
    /// Quadratic programs.
    pub qp: u64,
}

/// The problem behind argmin's counters: the one door through which solvers evaluate.
pub(crate) struct Work<'a, 's, 'p> {
    problem: &'a mut argmin::core::Problem<&'p Problem>,
    /// What the next step will need.
    pub ahead: Option<Ahead<'s, 'p>>,
    kind: GradientKind,
    /// Whether every operation has its place: the paper's run depends on every bit.
    in_order: bool,
    /// Most iterations of one quadratic program.
    pub program_iterations: u32,
    /// What the work took.
    pub timings: Timings,
}

const FORWARD: &str = "forward_count";
const ADJOINT: &str = "adjoint_count";
const TANGENT: &str = "tangent_count";
const QP: &str = "qp_count";

impl<'a, 's, 'p> Work<'a, 's, 'p> {
    pub fn new(
        problem: &'a mut argmin::core::Problem<&'p Problem>,
        ahead: Option<Ahead<'s, 'p>>,
        settings: &FitSettings,
    ) -> Self {
        Self {
            problem,
            ahead,
            kind: settings.gradient,
            in_order: settings.solver == Solver::SteepestDescent
                || settings.gradient == GradientKind::Continuous,
            program_iterations: settings.stopping.program_iterations,
            timings: Timings::default(),
        }
    }

    /// The problem itself, for what costs no solve.
    pub fn problem(&self) -> &'p Problem {
        self.problem
            .problem
            .expect("the executor holds the problem")
    }

    /// A point that was there before, computed again without counting: the way its gradient had been computed shows by
    /// the `fingerprint`. `None` if there is no such point.
    pub fn again(&self, parameters: Vec<f64>, fingerprint: u64) -> Option<Point> {
        let problem = self.problem();
        let mut evaluation = problem.workspace();
        let evaluated = match self.in_order {
            true => problem.evaluate_in_order_into(&parameters, &mut evaluation),
            false => problem.evaluate_into(&parameters, &mut evaluation),
        };
        evaluated.ok()?;
        let by_adjoint = problem.gradient(&parameters, &evaluation, self.kind);
        let point = Point::new(parameters, evaluation, by_adjoint);
        if point.fingerprint() == fingerprint || !self.is_halved() {
            return Some(point).filter(|point| point.fingerprint() == fingerprint);
        }
        let reduced = Reduced::at(problem, &point.evaluation, &mut Timings::default());
        let misfit = reduced.misfit_gradient()?;
        let gradient = problem.gradient_of_misfit(&point.parameters, misfit);
        let point = Point { gradient, ..point };
        (point.fingerprint() == fingerprint).then_some(point)
    }

    /// Whether points are completed by tangents, and only after short steps by an adjoint.
    fn is_halved(&self) -> bool {
        self.ahead.as_ref().is_some_and(Ahead::is_halved)
    }

    /// The motions at a point that was there before, computed again without counting.
    pub fn motions_again(&self, parameters: &[f64]) -> Result<Vec<Trajectory>, Breakdown> {
        let problem = self.problem();
        let mut evaluation = problem.workspace();
        match self.in_order {
            true => problem.evaluate_in_order_into(parameters, &mut evaluation)?,
            false => problem.evaluate_into(parameters, &mut evaluation)?,
        }
        Ok(evaluation.trajectories)
    }

    /// One forward solve into `evaluation`.
    pub fn evaluate_into(
        &mut self,
        parameters: &[f64],
        evaluation: &mut Evaluation,
    ) -> Result<(), Breakdown> {
        *self.problem.counts.entry(FORWARD).or_insert(0) += 1;
        let (problem, in_order) = (self.problem(), self.in_order);
        timed(&mut self.timings.forward, || match in_order {
            true => problem.evaluate_in_order_into(parameters, evaluation),
            false => problem.evaluate_into(parameters, evaluation),
        })
    }

    /// Several forward solves at once.
    pub fn forwards<T>(&mut self, solves: u64, solve: impl FnOnce() -> T) -> T {
        *self.problem.counts.entry(FORWARD).or_insert(0) += solves;
        timed(&mut self.timings.forward, solve)
    }

    /// One adjoint solve at an evaluated point.
    pub fn gradient(&mut self, parameters: &[f64], evaluation: &Evaluation) -> Gradient {
        *self.problem.counts.entry(ADJOINT).or_insert(0) += 1;
        let (problem, kind) = (self.problem(), self.kind);
        timed(&mut self.timings.adjoint, || {
            problem.gradient(parameters, evaluation, kind)
        })
    }

    /// Counts the tangent solves of a linearisation, where those of its point have not been counted.
    pub fn count_linearisation(&mut self, solves: u64) {
        if !self.is_halved() {
            self.count_tangents(solves);
        }
    }

    /// Counts tangent solves.
    pub fn count_tangents(&mut self, solves: u64) {
        *self.problem.counts.entry(TANGENT).or_insert(0) += solves;
    }

    /// One quadratic program.
    pub fn program<T>(&mut self, solve: impl FnOnce() -> T) -> T {
        *self.problem.counts.entry(QP).or_insert(0) += 1;
        timed(&mut self.timings.qp, solve)
    }

    /// The readings linearised at the point with these parameters, if that was done ahead.
    pub fn linearised(&mut self, parameters: &[f64]) -> Option<Reduced> {
        self.ahead.as_mut()?.linearised(parameters)
    }

    /// Linear algebra between the solves.
    pub fn algebra<T>(&mut self, work: impl FnOnce() -> T) -> T {
        timed(&mut self.timings.linear_algebra, work)
    }

    /// [`Work::complete`] after a short step: the Jacobian of the point before is taken for that of this one where that can
    /// be done, and whether it was.
    pub fn complete_nearby(
        &mut self,
        parameters: Vec<f64>,
        evaluation: Evaluation,
    ) -> (Point, bool) {
        let problem = self.problem();
        let is_squares = |c: &Channel| c.loss() == Loss::Squares;
        let (mut parameters, mut evaluation) = (parameters, evaluation);
        if let Some(ahead) = &mut self.ahead
            && ahead.can_stay()
            && !problem.is_regularised()
            && problem.channels().all(is_squares)
        {
            *self.problem.counts.entry(ADJOINT).or_insert(0) += 1;
            match ahead.point_nearby(parameters, evaluation, &mut self.timings) {
                Ok(point) => return (point, true),
                Err(back) => (parameters, evaluation) = back,
            }
        }
        (self.complete(parameters, evaluation), false)
    }

    /// Linearises the readings at a `point` of a record that is cut in two, or `made_at` other parameters nearby, without
    /// counting.
    pub fn linearise_again(&mut self, point: &Point, made_at: Option<&[f64]>) {
        let timings = &mut self.timings;
        if let Some(ahead) = self.ahead.as_mut().filter(|ahead| ahead.is_halved()) {
            ahead.linearise_again(point, made_at, timings);
        }
    }

    /// The point that an evaluation belongs to, completed by its gradient.
    pub fn complete(&mut self, parameters: Vec<f64>, evaluation: Evaluation) -> Point {
        let Some(ahead) = &mut self.ahead else {
            let gradient = self.gradient(&parameters, &evaluation);
            return Point::new(parameters, evaluation, gradient);
        };
        let solves = parameters.len() as u64;
        let point = ahead.point(parameters, evaluation, &mut self.timings);
        let is_halved = self.is_halved();
        if is_halved {
            self.count_tangents(solves);
        }
        let (parameters, evaluation) = match point {
            Ok(point) => {
                if !is_halved {
                    *self.problem.counts.entry(ADJOINT).or_insert(0) += 1;
                }
                return point;
            }
            Err(back) => back,
        };
        let gradient = self.gradient(&parameters, &evaluation);
        Point::new(parameters, evaluation, gradient)
    }
}

impl std::ops::Add for Counts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            forward: self.forward + other.forward,
            adjoint: self.adjoint + other.adjoint,
            tangent: self.tangent + other.tangent,
            qp: self.qp + other.qp,
        }
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Counts {
    pub(crate) fn of(problem: &argmin::core::Problem<&Problem>) -> Self {
        let count = |key| problem.counts.get(key).copied().unwrap_or(0);
        Self {
            forward: count(FORWARD),
            adjoint: count(ADJOINT),
            tangent: count(TANGENT),
            qp: count(QP),
        }
    }
}
