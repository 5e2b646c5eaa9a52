//! What the next step will need, made while the gradient is: by two threads at once.
//!
//! A Gauss–Newton search needs at each of its points the gradient, to be told and tested, and the linearised readings,
//! for the step from there. Neither waits for the other. Where a processor is to spare, a second thread does
//! the adjoint solve and then reduces the rows of the Jacobian, while this one goes along the tangents. Who does what
//! changes no bit.

use super::gauss_newton::{FEW_PARAMETERS, Reduced, Residuals};
use super::{FitSettings, Solver, Timings};
use crate::lanes::tall::Piece;
use crate::objective::{Evaluation, Gradient, GradientKind};
use crate::problem::Problem;
use crate::threads::{self, Companion};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
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
#[derive(Clone)]
struct Input {
    parameters: Vec<f64>,
    evaluation: Evaluation,
    residuals: Residuals,
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
    reduced: Option<Reduced>,
    adjoint: Duration,
    algebra: Duration,
}

impl Job<'_> {
    fn run(&mut self) {
        let (Some(input), Some(full)) = (self.input.take(), self.full.take()) else {
            return;
        };
        let clock = Instant::now();
        let Input {
            parameters,
            evaluation,
            residuals,
        } = &*input;
        self.gradient = Some(self.problem.gradient(parameters, evaluation, self.kind));
        self.adjoint = clock.elapsed();
        self.algebra = Duration::ZERO;
        loop {
            match full.try_recv() {
                Ok(mut piece) => {
                    let clock = Instant::now();
                    if let Some(reduced) = &mut self.reduced {
                        reduced.add(&mut piece, residuals);
                    }
                    self.algebra += clock.elapsed();
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
        let job = Job {
            problem,
            kind: settings.gradient,
            input: None,
            full: None,
            empty: None,
            gradient: None,
            reduced: None,
            adjoint: Duration::ZERO,
            algebra: Duration::ZERO,
        };
        is_wanted.then_some(())?;
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
        let residuals = Residuals::at(problem, &evaluation);
        let input = Arc::new(Input {
            parameters,
            evaluation,
            residuals,
        });
        let (order, its) = (problem.places(), Arc::clone(&input));
        let (full, to_reduce) = mpsc::channel();
        let (reduced, again) = mpsc::channel();
        let found = self.companion.with(
            |job| {
                job.input = Some(its);
                (job.full, job.empty) = (Some(to_reduce), Some(reduced));
                job.reduced = Some(Reduced::new(order.clone()));
            },
            || {
                problem.each_piece(&input.evaluation, &order, |piece| {
                    // It is there until it has been told that there are no more.
                    let _ = full.send(piece);
                    (again.try_recv()).unwrap_or_else(|_| Piece::new(order.len()))
                });
                drop(full);
            },
            |(), job| {
                let (gradient, reduced) = (job.gradient.take(), job.reduced.take());
                (gradient, reduced, job.adjoint, job.algebra)
            },
        );
        let (gradient, reduced, adjoint, algebra) = found;
        // What was done at once is told once: first the adjoint, then linear algebra.
        let all = clock.elapsed();
        let adjoint = adjoint.min(all);
        let algebra = algebra.min(all - adjoint);
        timings.adjoint += adjoint;
        timings.linear_algebra += algebra;
        timings.tangent += all - adjoint - algebra;
        let Input {
            parameters,
            evaluation,
            ..
        } = Arc::unwrap_or_clone(input);
        self.linearised = reduced.map(|reduced| (parameters.clone(), reduced));
        (parameters, evaluation, gradient)
    }

    /// The readings linearised at the point with these parameters, if they are.
    pub fn linearised(&mut self, parameters: &[f64]) -> Option<Reduced> {
        let (at, reduced) = self.linearised.take()?;
        (at == parameters).then_some(reduced)
    }
}
