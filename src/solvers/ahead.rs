//! What the next step will need, made while the gradient is: by two threads at once.
//!
//! A Gauss–Newton search needs at each of its points the gradient, to be told and tested, and the linearised readings,
//! for the step from there. Neither waits for the other. Where a processor is to spare, a second thread does
//! the adjoint solve, while this one goes along the tangents and reduces the rows of the Jacobian; the first to be
//! done with its own, the second thread goes on with reducing. Who does what changes no bit.

use super::gauss_newton::{FEW_PARAMETERS, Reduced, Residuals};
use super::{FitSettings, Solver, Timings};
use crate::lanes::tall::Piece;
use crate::objective::{Evaluation, Gradient, GradientKind};
use crate::problem::Problem;
use crate::threads::{self, Companion};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Scope;
use std::time::{Duration, Instant};

/// Entries of a Jacobian from which on two threads are quicker than one: it takes microseconds to hand over.
const WORTH_SHARING: usize = 4000;

/// The second thread of a search, and what it was for.
pub(crate) struct Ahead<'s, 'p> {
    problem: &'p Problem,
    companion: Companion<'s, Job<'p>>,
    /// Readings linearised at these parameters.
    linearised: Option<(Vec<f64>, Reduced)>,
}

/// A point to be completed.
struct Input {
    parameters: Vec<f64>,
    evaluation: Evaluation,
    reduction: Mutex<Reduction>,
    /// Whether the second thread reduces all rows that are still to come.
    taken_over: AtomicBool,
}

/// The rows reduced so far, and the residuals of all.
struct Reduction {
    reduced: Reduced,
    residuals: Residuals,
    took: Duration,
}

impl Input {
    fn reduce(&self, piece: &mut Piece) {
        let clock = Instant::now();
        let mut reduction = (self.reduction.lock()).unwrap_or_else(PoisonError::into_inner);
        let Reduction {
            reduced,
            residuals,
            took,
        } = &mut *reduction;
        reduced.add(piece, residuals);
        *took += clock.elapsed();
    }
}

/// What the second thread does.
struct Job<'p> {
    problem: &'p Problem,
    kind: GradientKind,
    input: Option<Arc<Input>>,
    /// Pieces with rows, and the way back for those without.
    full: Option<Receiver<Piece>>,
    empty: Option<Sender<Piece>>,
    gradient: Option<Gradient>,
    adjoint: Duration,
}

impl Job<'_> {
    fn run(&mut self) {
        let (Some(input), Some(full)) = (self.input.take(), self.full.take()) else {
            return;
        };
        let clock = Instant::now();
        let (parameters, evaluation) = (&input.parameters, &input.evaluation);
        self.gradient = Some(self.problem.gradient(parameters, evaluation, self.kind));
        self.adjoint = clock.elapsed();
        input.taken_over.store(true, Ordering::Release);
        loop {
            match full.try_recv() {
                Ok(mut piece) => {
                    input.reduce(&mut piece);
                    if let Some(empty) = &self.empty {
                        // Nobody may want it any more.
                        let _ = empty.send(piece);
                    }
                }
                Err(TryRecvError::Empty) => std::hint::spin_loop(),
                Err(TryRecvError::Disconnected) => return,
            }
        }
    }
}

impl<'s, 'p> Ahead<'s, 'p> {
    /// For a search by these settings; `None` where one thread is as good.
    pub fn new(
        scope: &'s Scope<'s, 'p>,
        problem: &'p Problem,
        settings: &FitSettings,
    ) -> Option<Self> {
        let parameters = problem.parameters();
        let is_wanted = settings.solver == Solver::GaussNewton
            && parameters <= FEW_PARAMETERS
            && problem.reading_count() * parameters >= WORTH_SHARING
            && Reduced::comes_in_pieces(problem)
            && threads::spare();
        is_wanted.then_some(())?;
        Self::with(scope, problem, settings)
    }

    /// [`Ahead::new`], whether it is worth it or not; `None` if the system has no thread to give.
    fn with(
        scope: &'s Scope<'s, 'p>,
        problem: &'p Problem,
        settings: &FitSettings,
    ) -> Option<Self> {
        let job = Job {
            problem,
            kind: settings.gradient,
            input: None,
            full: None,
            empty: None,
            gradient: None,
            adjoint: Duration::ZERO,
        };
        Some(Self {
            problem,
            companion: Companion::within(scope, job, Job::run)?,
            linearised: None,
        })
    }

    /// The gradient at an evaluated point, if it was made by a second thread; the readings are then linearised,
    /// too.
    pub fn gradient(
        &mut self,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        timings: &mut Timings,
    ) -> (Vec<f64>, Evaluation, Option<Gradient>) {
        self.linearised = None;
        let clock = Instant::now();
        let problem = self.problem;
        let order = problem.places();
        let input = Arc::new(Input {
            reduction: Mutex::new(Reduction {
                reduced: Reduced::new(order.clone()),
                residuals: Residuals::at(problem, &evaluation),
                took: Duration::ZERO,
            }),
            parameters,
            evaluation,
            taken_over: AtomicBool::new(false),
        });
        let its = Arc::clone(&input);
        let (full, to_reduce) = mpsc::channel();
        let (reduced, again) = mpsc::channel();
        let (gradient, adjoint) = self.companion.with(
            |job| {
                job.input = Some(its);
                (job.full, job.empty) = (Some(to_reduce), Some(reduced));
            },
            || {
                problem.each_piece(&input.evaluation, &order, |mut piece| {
                    if !input.taken_over.load(Ordering::Acquire) {
                        input.reduce(&mut piece);
                        return piece;
                    }
                    // It is there until it has been told that there are no more.
                    let _ = full.send(piece);
                    (again.try_recv()).unwrap_or_else(|_| Piece::new(order.len()))
                });
                drop(full);
            },
            |(), job| (job.gradient.take(), job.adjoint),
        );
        let input = Arc::into_inner(input).expect("the second thread has given it back");
        let Reduction { reduced, took, .. } =
            (input.reduction.into_inner()).unwrap_or_else(PoisonError::into_inner);
        // What was done at once is told once: first the adjoint, then linear algebra.
        let all = clock.elapsed();
        let adjoint = adjoint.min(all);
        let algebra = took.min(all - adjoint);
        timings.adjoint += adjoint;
        timings.linear_algebra += algebra;
        timings.tangent += all - adjoint - algebra;
        let parameters = input.parameters;
        let is_whole = gradient.is_some();
        self.linearised = is_whole.then(|| (parameters.clone(), reduced));
        (parameters, input.evaluation, gradient)
    }

    /// The readings linearised at the point with these parameters, if they are.
    pub fn linearised(&mut self, parameters: &[f64]) -> Option<Reduced> {
        let (at, reduced) = self.linearised.take()?;
        (at == parameters).then_some(reduced)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{Grid, Method, Oscillator, State, Term};
    use crate::functions::{Basis, CoefficientFunction, Functions, Quantity};
    use crate::objective::{Channel, Weighting};
    use crate::problem::Experiment;
    use crate::solvers::{Fit, fit};

    /// A decaying oscillator on knots, with more readings than a piece holds.
    fn problem() -> Problem {
        let grid = Grid::new(0.0, 20.0, 601).expect("a grid");
        let oscillator = Oscillator {
            grid,
            method: Method::Midpoint,
            terms: vec![Term::Damping, Term::Stiffness],
        };
        let knots = Basis::PiecewiseLinear {
            knots: (0..6).map(|i| 4.0 * f64::from(i)).collect(),
        };
        let on_knots = |quantity, start: f64| {
            CoefficientFunction::free(quantity, knots.clone(), &grid, vec![start; 6])
        };
        let list = vec![
            CoefficientFunction::constant(Quantity::Mass, 1.3, grid.nodes()),
            on_knots(Quantity::Damping, 0.2),
            on_knots(Quantity::Stiffness, 1.6),
        ];
        let functions = Functions::new(list, grid.nodes(), grid.step()).expect("functions");
        let times = grid.times().into_iter();
        let readings = times.map(|t| (-0.05 * t).exp() * (1.2 * t).cos());
        let weighting = Weighting::Sigma(0.01);
        let channel = Channel::displacement_at_nodes(readings.collect(), 1, weighting, &grid);
        let initial = State {
            displacement: 1.0,
            velocity: 0.0,
        };
        let experiment = Experiment::free("decay", initial, grid.nodes()).with_channel(channel);
        Problem::new(oscillator, functions, vec![experiment])
    }

    fn fitted(problem: &Problem) -> Fit {
        let settings = FitSettings::default();
        fit(problem, &problem.start(), &settings, &mut |_| {}).expect("a motion")
    }

    /// Two threads and one go the same way, to the last bit.
    #[test]
    fn who_does_what_changes_nothing() {
        let problem = problem();
        let alone = threads::sharing(|| fitted(&problem));
        let settings = FitSettings::default();
        std::thread::scope(|scope| {
            let mut ahead = Ahead::with(scope, &problem, &settings).expect("a thread");
            let evaluation = problem.evaluate(&problem.start()).expect("a motion");
            let gradient = problem.gradient(&problem.start(), &evaluation, settings.gradient);
            let mut timings = Timings::default();
            let found = ahead.gradient(problem.start(), evaluation.clone(), &mut timings);
            assert!(found == (problem.start(), evaluation, Some(gradient)));
            assert!(ahead.linearised(&[0.0]).is_none());
        });
        let together = fitted(&problem);
        assert!(together.history.len() > 3);
        assert!(together.history == alone.history);
        assert_eq!(together.counts, alone.counts);
        assert!(together.best.parameters == alone.best.parameters);
    }
}
