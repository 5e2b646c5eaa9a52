//! What the next step will need, made while the gradient is: by two threads at once.
//!
//! A Gauss–Newton search needs at each of its points the gradient, to be told and tested, and the linearised readings,
//! for the step from there. Neither waits for the other. Where a processor is to spare, a second thread does
//! the adjoint solve, while this one goes along the tangents and reduces the rows of the Jacobian. After that the
//! second thread goes on with reducing or, where there are so few columns that handing rows over takes as long as
//! reducing them, finds the natural sizes. Who does what changes no bit.
//!
//! Otherwise with a long record and few parameters: it is cut in two, and each thread goes along the tangents of one half.
//! Nothing more is needed for the discrete gradient, so there is no adjoint solve, on one thread either. After a step so
//! short that the Jacobian hardly changes the tangents are left out, and there is an adjoint solve in their place.

use super::gauss_newton::{FEW_PARAMETERS, Half, Reduced, halfway, is_wide};
use super::{FitSettings, Point, Solver, Timings};
use crate::objective::{Evaluation, Gradient, GradientKind};
use crate::problem::Problem;
use crate::simd::tall_qr::Piece;
use crate::threads::{self, Companion};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender, TryRecvError};
use std::thread::Scope;
use std::time::{Duration, Instant};

/// Pieces that wait to be reduced, at most.
const WAITING: usize = 16;
/// Entries of a Jacobian from which on two threads are quicker than one: it takes microseconds to hand over.
const WORTH_SHARING: usize = 4000;

/// The second thread of a search, if there is one, and what it was for.
pub(crate) struct Ahead<'s, 'p> {
    problem: &'p Problem,
    companion: Option<Companion<'s, Job<'p>>>,
    /// Where the record is cut in two.
    halfway: Option<usize>,
    /// Readings linearised at these parameters.
    linearised: Option<(Vec<f64>, Reduced)>,
    /// Those that the latest step was made of, if the record is cut in two.
    before: Option<Reduced>,
}

/// A point to be completed.
struct Input {
    parameters: Vec<f64>,
    evaluation: Evaluation,
    /// Whether the second thread reduces what is still to come.
    is_free: AtomicBool,
}

impl Input {
    fn new(parameters: Vec<f64>, evaluation: Evaluation) -> Arc<Self> {
        Arc::new(Self {
            parameters,
            evaluation,
            is_free: AtomicBool::new(false),
        })
    }

    /// What it was made of, once the second thread is done: that drops its own whatever happens to it.
    fn back(this: Arc<Self>) -> (Vec<f64>, Evaluation) {
        let input = Arc::into_inner(this).expect("the second thread has given it back");
        (input.parameters, input.evaluation)
    }
}

/// What is handed over to the second thread.
enum Handed {
    /// What has been reduced until then.
    Reduced(Reduced),
    /// More rows.
    Rows(Piece),
}

/// What the second thread does.
struct Job<'p> {
    problem: &'p Problem,
    kind: GradientKind,
    input: Option<Arc<Input>>,
    /// Where the record is cut in two, of which the second thread has the second half.
    halfway: Option<usize>,
    half: Option<Half>,
    /// Whether it is asked for the natural sizes alone.
    is_nearby: bool,
    handed: Option<Receiver<Handed>>,
    /// The way back for pieces without rows.
    empty: Option<Sender<Piece>>,
    gradient: Option<Gradient>,
    sizes: Option<Vec<f64>>,
    reduced: Option<Reduced>,
    adjoint: Duration,
}

impl Job<'_> {
    fn run(&mut self) {
        let Some(input) = self.input.take() else {
            return;
        };
        if std::mem::take(&mut self.is_nearby) {
            self.sizes = Some(self.problem.natural_sizes(&input.evaluation));
            return;
        }
        if let Some(halfway) = self.halfway {
            self.half = Some(Half::second(self.problem, &input.evaluation, halfway));
            return;
        }
        let Some(handed) = self.handed.take() else {
            return;
        };
        let clock = Instant::now();
        let (parameters, evaluation) = (&input.parameters, &input.evaluation);
        self.gradient = Some(self.problem.gradient(parameters, evaluation, self.kind));
        self.adjoint = clock.elapsed();
        if !is_wide(parameters.len()) {
            self.sizes = Some(self.problem.natural_sizes(evaluation));
            return;
        }
        input.is_free.store(true, Ordering::Release);
        let mut all = None;
        loop {
            match handed.try_recv() {
                Ok(Handed::Reduced(reduced)) => all = Some(reduced),
                Ok(Handed::Rows(mut piece)) => {
                    if let Some(reduced) = &mut all {
                        reduced.add(&mut piece);
                    }
                    if let Some(empty) = &self.empty {
                        // Nobody may want it any more.
                        let _ = empty.send(piece);
                    }
                }
                Err(TryRecvError::Empty) => std::hint::spin_loop(),
                Err(TryRecvError::Disconnected) => break,
            }
        }
        // Only now it is whole.
        self.reduced = all;
    }
}

impl<'s, 'p> Ahead<'s, 'p> {
    /// For a search by these settings; `None` where there is nothing to be made ahead, or one thread is as good.
    pub fn new(
        scope: &'s Scope<'s, 'p>,
        problem: &'p Problem,
        settings: &FitSettings,
    ) -> Option<Self> {
        let parameters = problem.parameters();
        let is_long = halfway(problem).is_some();
        // By the continuous gradient of a long record one thread has nothing to make ahead, and two must not differ.
        let is_exact = settings.gradient == GradientKind::Discrete;
        let is_wanted = settings.solver == Solver::GaussNewton
            && parameters <= FEW_PARAMETERS
            && Reduced::comes_in_pieces(problem)
            && (is_exact || !is_long);
        let is_much = is_long || problem.reading_count() * parameters >= WORTH_SHARING;
        let is_shared = is_much && threads::spare();
        let ahead = is_wanted.then(|| Self::with(is_shared.then_some(scope), problem, settings))?;
        (ahead.companion.is_some() || ahead.is_halved()).then_some(ahead)
    }

    /// [`Ahead::new`], whether it is worth it or not; with a second thread if there is a scope, and the system has one to
    /// give.
    fn with(
        scope: Option<&'s Scope<'s, 'p>>,
        problem: &'p Problem,
        settings: &FitSettings,
    ) -> Self {
        let is_exact = settings.gradient == GradientKind::Discrete;
        let halfway = halfway(problem).filter(|_| is_exact);
        let job = Job {
            problem,
            kind: settings.gradient,
            input: None,
            halfway,
            half: None,
            is_nearby: false,
            handed: None,
            empty: None,
            gradient: None,
            sizes: None,
            reduced: None,
            adjoint: Duration::ZERO,
        };
        Self {
            problem,
            companion: scope.and_then(|scope| Companion::within(scope, job, Job::run)),
            halfway,
            linearised: None,
            before: None,
        }
    }

    /// Whether the record is cut in two, so that points need tangents and no adjoint.
    pub fn is_halved(&self) -> bool {
        self.halfway.is_some()
    }

    /// The point that an evaluation belongs to; the readings are then linearised, too. If the second thread has not
    /// done its part, the parameters and the evaluation come back.
    pub fn point(
        &mut self,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        timings: &mut Timings,
    ) -> Result<Point, (Vec<f64>, Evaluation)> {
        self.linearised = None;
        if let Some(halfway) = self.halfway {
            return self.point_by_halves(halfway, parameters, evaluation, timings);
        }
        let Some(companion) = &mut self.companion else {
            return Err((parameters, evaluation));
        };
        let clock = Instant::now();
        let problem = self.problem;
        let input = Input::new(parameters, evaluation);
        let its = Arc::clone(&input);
        let (hand, handed) = mpsc::sync_channel(WAITING);
        let (empty, again) = mpsc::channel();
        let found = companion.with(
            |job| {
                job.input = Some(its);
                (job.handed, job.empty) = (Some(handed), Some(empty));
            },
            || along(problem, &input, hand, &again),
            |(reduced, sizes), job| {
                let reduced = reduced.or(job.reduced.take());
                let sizes = sizes.or(job.sizes.take());
                (reduced, sizes, job.gradient.take(), job.adjoint)
            },
        );
        let (reduced, sizes, gradient, adjoint) = found;
        // What was done at once is told once: first the adjoint, then linear algebra.
        let all = clock.elapsed();
        let adjoint = adjoint.min(all);
        let algebra = reduced.as_ref().map_or(Duration::ZERO, Reduced::took);
        let algebra = algebra.min(all - adjoint);
        timings.adjoint += adjoint;
        timings.linear_algebra += algebra;
        timings.tangent += all - adjoint - algebra;
        let (parameters, evaluation) = Input::back(input);
        let (Some(gradient), Some(sizes)) = (gradient, sizes) else {
            return Err((parameters, evaluation));
        };
        self.linearised = reduced.map(|reduced| (parameters.clone(), reduced));
        Ok(Point::new(parameters, evaluation, gradient).with_sizes(sizes))
    }

    /// [`Ahead::point`] of a record that is cut in two.
    fn point_by_halves(
        &mut self,
        halfway: usize,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        timings: &mut Timings,
    ) -> Result<Point, (Vec<f64>, Evaluation)> {
        let clock = Instant::now();
        let problem = self.problem;
        let input = Input::new(parameters, evaluation);
        let own = || {
            let first = Half::first(problem, &input.evaluation, halfway);
            (first, problem.natural_sizes(&input.evaluation))
        };
        let ((first, sizes), second) = match &mut self.companion {
            None => (own(), None),
            Some(companion) => companion.with(
                |job| job.input = Some(Arc::clone(&input)),
                own,
                |own, job| (own, job.half.take()),
            ),
        };
        let reduced = first
            .join(&second.unwrap_or_else(|| Half::second(problem, &input.evaluation, halfway)));
        timings.tangent += clock.elapsed();
        let (parameters, evaluation) = Input::back(input);
        let Some(misfit) = reduced.misfit_gradient() else {
            return Err((parameters, evaluation));
        };
        let gradient = problem.gradient_of_misfit(&parameters, misfit);
        self.linearised = Some((parameters.clone(), reduced));
        Ok(Point::new(parameters, evaluation, gradient).with_sizes(sizes))
    }

    /// The readings linearised at the point with these parameters, if they are.
    pub fn linearised(&mut self, parameters: &[f64]) -> Option<Reduced> {
        let (_, reduced) = self.linearised.take_if(|(at, _)| at == parameters)?;
        if self.is_halved() {
            self.before = Some(reduced.clone());
        }
        Some(reduced)
    }

    /// Whether there is a Jacobian that [`Ahead::point_nearby`] can take.
    pub fn can_stay(&self) -> bool {
        self.before.is_some()
    }

    /// The point that an evaluation belongs to, so near to the one before that the Jacobian used there is kept:
    /// the adjoint solve for its gradient, beside the natural sizes. `Err` if it is not, as far as can be told.
    pub fn point_nearby(
        &mut self,
        parameters: Vec<f64>,
        evaluation: Evaluation,
        timings: &mut Timings,
    ) -> Result<Point, (Vec<f64>, Evaluation)> {
        let Some(before) = self.before.take() else {
            return Err((parameters, evaluation));
        };
        let clock = Instant::now();
        let problem = self.problem;
        let input = Input::new(parameters, evaluation);
        let own = || problem.gradient(&input.parameters, &input.evaluation, GradientKind::Discrete);
        let (gradient, sizes) = match &mut self.companion {
            None => (own(), None),
            Some(companion) => companion.with(
                |job| (job.input, job.is_nearby) = (Some(Arc::clone(&input)), true),
                own,
                |own, job| (own, job.sizes.take()),
            ),
        };
        let (parameters, evaluation) = Input::back(input);
        let sizes = sizes.unwrap_or_else(|| problem.natural_sizes(&evaluation));
        timings.adjoint += clock.elapsed();
        let Some(reduced) = before.nearby(evaluation.misfit, &gradient.euclidean) else {
            return Err((parameters, evaluation));
        };
        self.linearised = Some((parameters.clone(), reduced));
        Ok(Point::new(parameters, evaluation, gradient).with_sizes(sizes))
    }

    /// Linearises the readings at a `point`, or `made_at` other parameters nearby, as if it was made by
    /// [`Ahead::point_nearby`].
    pub fn linearise_again(
        &mut self,
        point: &Point,
        made_at: Option<&[f64]>,
        timings: &mut Timings,
    ) {
        let problem = self.problem;
        let reduced = match made_at {
            None => Some(Reduced::at(problem, &point.evaluation, timings)),
            Some(at) => problem.evaluate(at).ok().and_then(|evaluation| {
                let reduced = Reduced::at(problem, &evaluation, timings);
                reduced.nearby(point.evaluation.misfit, &point.gradient.euclidean)
            }),
        };
        self.linearised = reduced.map(|reduced| (point.parameters.clone(), reduced));
    }
}

/// Goes along the tangents and reduces the rows, with many columns until the second thread is free to go on with that.
/// That is then busy with the last rows: meanwhile the sizes are found here.
fn along(
    problem: &Problem,
    input: &Input,
    hand: SyncSender<Handed>,
    again: &Receiver<Piece>,
) -> (Option<Reduced>, Option<Vec<f64>>) {
    let order = problem.places();
    let wide = is_wide(order.len());
    let mut own = Some(Reduced::new(problem, &input.evaluation, order.clone()));
    // It is there until it has been told that there is no more.
    let give = |handed| hand.send(handed).is_ok();
    problem.each_piece(&input.evaluation, &order, |mut piece| {
        if wide && input.is_free.load(Ordering::Acquire) {
            own.take().map(|own| give(Handed::Reduced(own)));
        }
        if let Some(own) = &mut own {
            own.add(&mut piece);
            return piece;
        }
        give(Handed::Rows(piece));
        (again.try_recv()).unwrap_or_else(|_| Piece::new(order.len()))
    });
    drop(hand);
    let sizes = wide.then(|| problem.natural_sizes(&input.evaluation));
    (own, sizes)
}

#[cfg(test)]
mod tests;
