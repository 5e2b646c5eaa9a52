//! All trial steps at once, on two threads where there are two.
//!
//! What one thread writes and the other reads is slow to come by, and functions and gradient are as long as the record. So the
//! second thread is told but the step that was taken, goes the same way, and finds the next point and its gradient by itself,
//! with the same bits.

use super::{Best, lengths, take, trial};
use crate::dynamics::{Layout, Ray, Trials, is_linear_midpoint, reference, replay};
use crate::objective::{Evaluation, GradientKind, Weighting};
use crate::problem::Problem;
use crate::simd::{LANES, Row};
use crate::solvers::Point;
use crate::solvers::point::Work;
use crate::threads::{self, Companion};

/// Nodes from which on another thread is asked: to talk to it takes about a microsecond, and a step of four rows 30 ns.
const WORTH_SHARING: usize = 200;

/// The trials of a point, by this thread and another one.
#[derive(Default)]
pub(super) struct SideBySide {
    own: Trials,
    /// Those that the other thread should have done.
    others: Trials,
    /// The other thread, once there was something that was worth it.
    companion: Option<Companion<'static, Follower>>,
    /// Whether the system had none to give.
    is_alone: bool,
    /// Whether it did its share at this point.
    is_accompanied: bool,
    /// Whether it is on its way to the point that comes next.
    is_followed: bool,
}

/// Another thread's way to the same points.
struct Follower {
    problem: Problem,
    kind: GradientKind,
    point: Point,
    /// The step from there that it has not taken yet.
    step: Option<Taken>,
    trials: Trials,
}

/// A step that was taken: its length, and states of the motion that it led to.
#[derive(Clone, Copy)]
struct Taken {
    length: f64,
    states: [Row; 2],
}

impl SideBySide {
    /// The lowest trial, if it lowers the cost.
    pub fn lowest(
        &mut self,
        work: &mut Work,
        point: &Point,
        ray: Ray,
        lengths: &[f64],
        spare: &mut Vec<Evaluation>,
    ) -> Option<Best> {
        let (problem, kind) = (work.problem(), work.kind());
        work.forwards(lengths.len() as u64, || {
            let (_, channel, _) = problem.one_full_record()?;
            let layout = Layout::new(ray, lengths);
            let costs = self.costs(problem, kind, point, ray, &layout);
            let candidates = layout.lowest(&costs).into_iter().map(|which| Taken {
                length: lengths[which],
                states: self.states(layout.place(which)),
            });
            let candidates: Vec<Taken> = candidates.collect();
            // If there is but one, the other thread need not wait until its cost is known to the last bit.
            if let [only] = candidates[..] {
                self.follow(only);
            }
            let (mut best, mut decided) = (None, None);
            for taken in &candidates {
                let parameters = trial(point, taken.length);
                let mut evaluation = take(spare, problem);
                let has_motion = move_to(problem, &parameters, taken.states, &mut evaluation);
                evaluation.misfit = match has_motion {
                    true => channel.cost(&evaluation.predictions[0][0]),
                    false => f64::INFINITY,
                };
                evaluation.regularisation = 0.0;
                evaluation.cost = evaluation.misfit;
                let trial = Best {
                    length: taken.length,
                    parameters,
                    evaluation,
                };
                if trial.or_lower(&mut best, point, spare) {
                    decided = Some(*taken);
                }
            }
            if let Some(taken) = decided.filter(|_| candidates.len() > 1) {
                self.follow(taken);
            }
            best
        })
    }

    /// Lets the other thread take a step from here, if it is here.
    fn follow(&mut self, taken: Taken) {
        let companion = self.companion.as_mut().filter(|_| self.is_accompanied);
        self.is_followed = companion.is_some();
        if let Some(companion) = companion {
            companion.post(|follower| follower.step = Some(taken));
        }
    }

    /// The sums of squares of all rows.
    fn costs(
        &mut self,
        problem: &Problem,
        kind: GradientKind,
        point: &Point,
        ray: Ray,
        layout: &Layout,
    ) -> Vec<Row> {
        let rows = layout.rows();
        let others = rows_of_the_other(rows);
        let is_shared = rows > 1 && point.parameters.len() > 3 * WORTH_SHARING;
        if is_shared && !std::mem::take(&mut self.is_followed) {
            self.begin(problem, kind, point);
        }
        self.own.run(ray, layout, others..rows);
        let norm = point.gradient.norm_squared;
        let is_there = |follower: &Follower| {
            let has_all = follower.trials.costs().len() == others;
            has_all && follower.point.gradient.norm_squared == norm
        };
        let companion = self.companion.as_mut().filter(|_| is_shared);
        let companion = companion.and_then(|c| (c.finish() && c.look(is_there)).then_some(c));
        self.is_accompanied = companion.is_some();
        let costs = match companion {
            Some(companion) => companion.look(|other| other.trials.costs().to_vec()),
            None => {
                self.others.run(ray, layout, 0..others);
                self.others.costs().to_vec()
            }
        };
        [costs.as_slice(), self.own.costs()].concat()
    }

    /// Sets the other thread on its way, if there is one.
    fn begin(&mut self, problem: &Problem, kind: GradientKind, point: &Point) {
        if let Some(companion) = &mut self.companion {
            return companion.post(|follower| {
                follower.point.clone_from(point);
                follower.step = None;
            });
        }
        if self.is_alone || !threads::spare() {
            return;
        }
        let follower = Follower {
            problem: problem.clone(),
            kind,
            point: point.clone(),
            step: None,
            trials: Trials::default(),
        };
        self.companion = Companion::new(follower, Follower::go);
        self.is_alone = self.companion.is_none();
        if let Some(companion) = &mut self.companion {
            companion.post(|_| {});
        }
    }

    /// States of a trial; of one that nobody knows they are no numbers, and no motion is made of them.
    fn states(&self, place: (usize, usize)) -> [Row; 2] {
        let others = match self.companion.as_ref().filter(|_| self.is_accompanied) {
            Some(companion) => companion.look(|follower| follower.trials.states(place)),
            None => self.others.states(place),
        };
        let states = self.own.states(place).or(others);
        states.unwrap_or([[f64::NAN; LANES]; 2])
    }
}

impl Follower {
    /// Takes the step, if there is one, and does its share of the trials from there.
    fn go(&mut self) {
        let point = &mut self.point;
        if let Some(taken) = self.step.take() {
            for (p, g) in point.parameters.iter_mut().zip(&point.gradient.l2) {
                *p -= taken.length * g;
            }
            let evaluation = &mut point.evaluation;
            if !move_to(&self.problem, &point.parameters, taken.states, evaluation) {
                return;
            }
            point.gradient = (self.problem).gradient(&point.parameters, evaluation, self.kind);
        }
        let lengths = lengths(point);
        match ray(&self.problem, point, &lengths) {
            Some(ray) => {
                let layout = Layout::new(ray, &lengths);
                (self.trials).run(ray, &layout, 0..rows_of_the_other(layout.rows()));
            }
            None => self.trials = Trials::default(),
        }
    }
}

/// How many of so many rows, the first ones, the other thread does: it has no report to write, and is earlier at the next
/// point.
fn rows_of_the_other(rows: usize) -> usize {
    rows.div_ceil(2)
}

/// Device, motion and predictions at `parameters`, from states of the motion; whether it has one.
fn move_to(
    problem: &Problem,
    parameters: &[f64],
    states: [Row; 2],
    evaluation: &mut Evaluation,
) -> bool {
    (problem.functions).device_into(parameters, 0, &mut evaluation.device);
    let (oscillator, device) = (&problem.oscillator, &evaluation.device);
    let motion = &mut evaluation.trajectories[0];
    let initial = problem.experiments[0].initial;
    let is_whole = replay(device, initial, states, oscillator.grid.step(), motion);
    if !is_whole && reference::forward_into(oscillator, device, initial, None, motion).is_err() {
        return false;
    }
    evaluation.predictions[0][0].clone_from(&motion.displacement);
    true
}

/// The trials' devices as a ray, on the paper's own problem: one free record seen at every node, one
/// value a node, linear terms, the midpoint rule, and nothing beside the integral cost; `None` for
/// any other, and where the masses are not moderate.
pub(super) fn ray<'a>(problem: &'a Problem, point: &'a Point, lengths: &[f64]) -> Option<Ray<'a>> {
    let (experiment, channel, _) = problem.one_full_record()?;
    let oscillator = &problem.oscillator;
    let nodes = experiment.nodes;
    let is_integral = matches!(channel.weighting(), Weighting::Integral { .. });
    let fits = is_integral
        && is_linear_midpoint(oscillator)
        && experiment.excitation.is_none()
        && !problem.is_regularised()
        && point.parameters.len() == 3 * nodes;
    let parts = |values: &'a [f64]| {
        let (mass, others) = values.split_at(nodes);
        let (damping, stiffness) = others.split_at(nodes);
        [mass, damping, stiffness]
    };
    let ray = fits.then(|| Ray {
        functions: parts(&point.parameters),
        direction: parts(&point.gradient.l2),
        initial: experiment.initial,
        readings: channel.observed(),
        step: oscillator.grid.step(),
    });
    ray.filter(|ray| ray.is_moderate(lengths[0]))
}

#[cfg(test)]
mod tests;
