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
use crate::lanes::tall::Piece;
use crate::objective::{Evaluation, Gradient, GradientKind};
use crate::problem::Problem;
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
mod tests {
    use super::*;
    use crate::dynamics::{ChannelKind, Excitation, Grid, Method, Oscillator, State, Term};
    use crate::functions::{Basis, CoefficientFunction, Functions, Quantity, Scalar};
    use crate::objective::{Channel, Weighting};
    use crate::problem::Experiment;
    use crate::solvers::gauss_newton::GaussNewton;
    use crate::solvers::{Bits, Counts, Descend, Fit, Memory, Step, Work, fit, fit_from};

    /// A decaying oscillator with so many knots for damping and stiffness each, and more readings than a piece holds.
    fn problem(knots: u32) -> Problem {
        let grid = Grid::new(0.0, 20.0, 601).expect("a grid");
        let oscillator = Oscillator {
            grid,
            method: Method::Midpoint,
            terms: vec![Term::Damping, Term::Stiffness],
        };
        let spacing = grid.duration() / f64::from(knots - 1);
        let basis = Basis::PiecewiseLinear {
            knots: (0..knots).map(|i| spacing * f64::from(i)).collect(),
        };
        let on_knots = |quantity, start: f64| {
            let start = vec![start; basis.parameters(&grid)];
            CoefficientFunction::free(quantity, basis.clone(), &grid, start)
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

    /// Two threads and one go the same way, to the last bit: with columns enough to hand rows over, and with few.
    #[test]
    fn who_does_what_changes_nothing() {
        for knots in [6, 3] {
            let problem = problem(knots);
            assert_eq!(is_wide(problem.parameters()), knots == 6);
            let alone = threads::sharing(|| fitted(&problem));
            let settings = FitSettings::default();
            std::thread::scope(|scope| {
                let mut ahead = Ahead::with(Some(scope), &problem, &settings);
                assert!(ahead.companion.is_some() && !ahead.is_halved());
                let evaluation = problem.evaluate(&problem.start()).expect("a motion");
                let gradient = problem.gradient(&problem.start(), &evaluation, settings.gradient);
                let mut timings = Timings::default();
                let found = ahead.point(problem.start(), evaluation.clone(), &mut timings);
                let found = found.expect("the second thread has done its part");
                assert!(found.parameters == problem.start() && found.evaluation == evaluation);
                assert!(found.gradient == gradient);
                let alone = Point::new(problem.start(), evaluation, gradient);
                assert!(found.relative_metric(&problem) == alone.relative_metric(&problem));
                assert!(ahead.linearised(&[0.0]).is_none());
            });
            let together = fitted(&problem);
            assert!(together.history.len() > 3);
            assert!(together.history == alone.history);
            assert_eq!(together.counts, alone.counts);
            assert!(together.best.parameters == alone.best.parameters);
        }
    }

    /// A driven oscillator over a long record, of which displacements are read at every seventh node, accelerations at
    /// every one and velocities between them; its velocity at the start is sought as well. The stiffness has so many knots,
    /// or is a constant.
    fn long_problem(knots: Option<u32>) -> Problem {
        let grid = Grid::new(0.0, 330.0, 33_001).expect("a grid");
        let nodes = grid.nodes();
        let constant = |quantity, start| CoefficientFunction::constant(quantity, start, nodes);
        let stiffness = match knots {
            None => constant(Quantity::Stiffness, 2.2),
            Some(knots) => {
                let spacing = grid.duration() / f64::from(knots - 1);
                let knots: Vec<f64> = (0..knots).map(|i| f64::from(i) * spacing).collect();
                let start = knots.iter().map(|t| 2.2 + 1e-3 * t).collect();
                let basis = Basis::PiecewiseLinear { knots };
                CoefficientFunction::free(Quantity::Stiffness, basis, &grid, start)
            }
        };
        let list = vec![
            constant(Quantity::Mass, 1.1),
            constant(Quantity::Damping, 0.3),
            stiffness,
        ];
        let speed = Scalar {
            name: "speed".into(),
            unit: "m/s".into(),
            start: 0.1,
            size: 1.0,
            prior: None,
        };
        let functions = Functions::new(list, nodes, grid.step()).expect("functions");
        let times = grid.times();
        let force: Vec<f64> = (times.iter())
            .map(|t| (0.9 * t).sin() + (1.7 * t).cos())
            .collect();
        let read = |t: &f64| (0.9 * t).cos() - (1.7 * t).sin();
        let channel = |kind, times: Vec<f64>| {
            let values = times.iter().map(read).collect();
            let weighting = Weighting::Sigma(0.1);
            Channel::new(kind, times, values, weighting, &grid, nodes).expect("readings")
        };
        let sevenths = times.iter().step_by(7).copied().collect();
        let between = times.iter().step_by(50).map(|t| t + 0.3 * grid.step());
        let between = between.filter(|t| *t < grid.duration()).collect();
        let record = Experiment {
            sought: [None, Some(0)],
            ..Experiment::free("driven", State::default(), nodes)
                .with_excitation(Excitation::force_at_nodes(&force))
                .with_channel(channel(ChannelKind::Displacement, sevenths))
                .with_channel(channel(ChannelKind::Velocity, between))
                .with_channel(channel(ChannelKind::Acceleration, times.clone()))
        };
        let oscillator = Oscillator {
            grid,
            method: Method::Rk4,
            terms: vec![Term::Damping, Term::Stiffness],
        };
        let functions = functions.with_scalars(vec![speed]);
        Problem::new(oscillator, functions, vec![record])
    }

    /// Both halves together say what the whole record says, and what the adjoint does: for few parameters, and for as many as
    /// leave one lane or none for the state in the middle.
    #[test]
    fn halves_of_a_long_record() {
        for (knots, parameters) in [(None, 4), (Some(4), 7), (Some(5), 8)] {
            let problem = long_problem(knots);
            assert_eq!(problem.parameters(), parameters);
            let theta = problem.start();
            let halfway = halfway(&problem).expect("it is long");
            let evaluation = problem.evaluate(&theta).expect("a motion");
            let second = Half::second(&problem, &evaluation, halfway);
            let joined = Half::first(&problem, &evaluation, halfway).join(&second);
            let order = problem.places();
            let mut whole = Reduced::new(&problem, &evaluation, order.clone());
            problem.each_piece(&evaluation, &order, |mut piece| {
                whole.add(&mut piece);
                piece
            });
            let solution = |reduced: &Reduced| reduced.solution().expect("independent columns");
            for (joined, whole) in solution(&joined).iter().zip(solution(&whole)) {
                let off = (joined - whole).abs();
                assert!(off <= 1e-10 * whole.abs(), "{joined} {whole}");
            }
            let found = joined.misfit_gradient().expect("finite numbers");
            let expected = problem.gradient(&theta, &evaluation, GradientKind::Discrete);
            for (found, expected) in found.iter().zip(&expected.euclidean) {
                let off = (found - expected).abs();
                assert!(off <= 1e-10 * expected.abs(), "{found} {expected}");
            }
        }
    }

    /// After short steps there are adjoint solves in place of tangents, with the same end: the gradient there is that of an
    /// adjoint, and the linearised readings ask for no further step.
    #[test]
    fn after_short_steps_the_jacobian_stays() {
        let mut problem = long_problem(None);
        let truth: Vec<f64> = problem.start().iter().map(|p| 1.02 * p).collect();
        let motion = problem.evaluate(&truth).expect("a motion");
        let channels = problem.experiments[0].channels.iter_mut();
        for (channel, predicted) in channels.zip(&motion.predictions[0]) {
            let noise: Vec<f64> = (0..channel.len()).map(|i| (7.0 * i as f64).sin()).collect();
            *channel = channel.clone().with_simulated(predicted, &noise);
        }
        let settings = FitSettings::default();
        let fit = fit_from(&problem, &problem.start(), &settings).expect("a motion");
        let points = fit.history.len() as u64 + 1;
        let parameters = problem.parameters() as u64;
        let Counts {
            adjoint, tangent, ..
        } = fit.counts;
        assert!(0 < adjoint && adjoint < points);
        assert_eq!(tangent, (points - adjoint) * parameters);
        let theta = &fit.best.parameters;
        // Of two ways to the gradient one may have been gone at the end: both have the rounding of the one at the start.
        let at_start = problem.evaluate(&problem.start()).expect("a motion");
        let at_start = problem.gradient(&problem.start(), &at_start, GradientKind::Discrete);
        let expected = problem.gradient(theta, &fit.best.evaluation, GradientKind::Discrete);
        let gradients = fit.best.gradient.euclidean.iter().zip(&expected.euclidean);
        for ((found, expected), size) in gradients.zip(&at_start.euclidean) {
            assert!(
                (found - expected).abs() <= 1e-11 * size.abs(),
                "{found} {expected} {size}"
            );
        }
        let mut timings = Timings::default();
        let reduced = Reduced::at(&problem, &fit.best.evaluation, &mut timings);
        let step = reduced.solution().expect("independent columns");
        let order = problem.places();
        for (step, j) in step.iter().zip(order) {
            assert!(
                step.abs() <= 1e-9 * theta[j].abs(),
                "{step} of {}",
                theta[j]
            );
        }
    }

    /// A step that the Jacobian of another point leads astray is made again with the one of its own.
    #[test]
    fn a_jacobian_that_leads_astray_is_made_anew() {
        let problem = long_problem(None);
        let settings = FitSettings::default();
        let start = problem.start();
        let stepped = |elsewhere: Option<&[f64]>| {
            std::thread::scope(|scope| {
                let mut counted = argmin::core::Problem::new(&problem);
                let ahead = Ahead::new(scope, &problem, &settings);
                let mut work = Work::new(&mut counted, ahead, &settings);
                let evaluation = problem.evaluate(&start).expect("a motion");
                let point = work.complete(start.clone(), evaluation);
                let mut method = GaussNewton::default();
                let memory = Memory::GaussNewton {
                    numbers: Bits(vec![1e-10]),
                    made_at: elsewhere.map(|at| Bits(at.to_vec())),
                };
                assert!(method.recall(memory, &problem, &point));
                if elsewhere.is_some() {
                    work.linearise_again(&point, elsewhere);
                }
                let Step::Moved { point, .. } = method.step(&mut work, &point) else {
                    panic!("no step");
                };
                drop(work);
                (point.parameters, Counts::of(&counted))
            })
        };
        let (expected, before) = stepped(None);
        let elsewhere = [2.0, 1.0, 3.0, 1.0].iter().zip(&start);
        let elsewhere: Vec<f64> = elsewhere.map(|(factor, p)| factor * p).collect();
        let (found, after) = stepped(Some(&elsewhere));
        assert_eq!(found, expected);
        assert_eq!(after.tangent, before.tangent + problem.parameters() as u64);
    }

    /// On one thread and on two the same, to the last bit.
    #[test]
    fn a_long_record_on_two_threads() {
        let problem = long_problem(None);
        let alone = threads::sharing(|| fitted(&problem));
        let together = fitted(&problem);
        assert!(together.history == alone.history && !together.history.is_empty());
        assert_eq!(together.counts, alone.counts);
        assert_eq!(together.best.parameters, alone.best.parameters);
    }

    /// By the continuous gradient, too, which needs an adjoint.
    #[test]
    fn a_long_record_by_the_continuous_gradient() {
        let mut problem = long_problem(None);
        let grid = problem.oscillator.grid;
        let readings = grid.times().iter().map(|t| (0.9 * t).cos()).collect();
        let spacing = grid.step();
        let weighting = Weighting::Integral { spacing };
        let channel = Channel::displacement_at_nodes(readings, 1, weighting, &grid);
        problem.experiments[0].channels = vec![channel];
        assert!(problem.supports_continuous() && halfway(&problem).is_some());
        let mut settings = FitSettings {
            gradient: GradientKind::Continuous,
            ..FitSettings::default()
        };
        settings.stopping.iterations = 3;
        let run = || fit(&problem, &problem.start(), &settings, &mut |_| {}).expect("a motion");
        let (alone, together) = (threads::sharing(run), run());
        assert!(together.history == alone.history && !together.history.is_empty());
        assert_eq!(together.counts, alone.counts);
    }
}
