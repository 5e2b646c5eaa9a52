//! Steepest descent exactly as in the paper.

use super::point::Work;
use super::{Descend, Point, Step};
use crate::dynamics::{Method, Ray, Term, Trials};
use crate::objective::{Evaluation, Weighting};
use crate::problem::Problem;

/// Number of trial steps.
const TRIALS: u32 = 50;
/// Factor of the longest trial step: `5 sqrt(G^2)`.
const LONGEST: f64 = 5.0;

/// Tries the steps `5 sqrt(G^2) / i^4`, `i = 1..50`, along the L2 gradient and takes the trial with
/// the lowest cost, if it is strictly lower.
///
/// On the paper's own problem all trials are computed side by side; the bits are the same.
#[derive(Default)]
pub struct SteepestDescent {
    spare: Vec<Evaluation>,
    trials: Trials,
}

/// A trial that lowers the cost.
struct Best {
    length: f64,
    parameters: Vec<f64>,
    evaluation: Evaluation,
}

impl Descend for SteepestDescent {
    fn step(&mut self, work: &mut Work, point: &Point) -> Step {
        let root = point.gradient.norm_squared.sqrt();
        let lengths: Vec<f64> = (1..=TRIALS)
            .map(|i| LONGEST * root / f64::from(i.pow(4)))
            .collect();
        let best = match ray(work.problem(), point).filter(|ray| ray.is_moderate(lengths[0])) {
            Some(ray) => self.side_by_side(work, point, ray, &lengths),
            None => self.one_by_one(work, point, &lengths),
        };
        match best {
            Some(best) => Step::Moved {
                point: Box::new(work.complete(best.parameters, best.evaluation)),
                length: best.length,
                hindered: false,
            },
            None => Step::Stuck(format!("none of the {TRIALS} trial steps lowers the cost")),
        }
    }

    fn recycle(&mut self, evaluation: Evaluation) {
        self.spare.push(evaluation);
    }
}

impl SteepestDescent {
    fn side_by_side(
        &mut self,
        work: &mut Work,
        point: &Point,
        ray: Ray,
        lengths: &[f64],
    ) -> Option<Best> {
        let costs = work.forwards(lengths.len() as u64, || self.trials.costs(ray, lengths));
        let mut lowest: Option<(usize, f64)> = None;
        for (which, cost) in costs.into_iter().enumerate() {
            let so_far = lowest.map_or(point.evaluation.cost, |(_, cost)| cost);
            if let Some(cost) = cost.filter(|cost| *cost < so_far) {
                lowest = Some((which, cost));
            }
        }
        let (which, cost) = lowest?;
        let length = lengths[which];
        let mut evaluation = self.take_spare(work);
        let mut parameters = vec![0.0; point.parameters.len()];
        trial_into(point, length, &mut parameters);
        let functions = &work.problem().functions;
        functions.device_into(&parameters, 0, &mut evaluation.device);
        let motion = &mut evaluation.trajectories[0];
        self.trials.motion_into(which, motion);
        evaluation.predictions[0][0].clone_from(&motion.displacement);
        evaluation.misfit = cost;
        evaluation.regularisation = 0.0;
        evaluation.cost = cost;
        Some(Best {
            length,
            parameters,
            evaluation,
        })
    }

    fn one_by_one(&mut self, work: &mut Work, point: &Point, lengths: &[f64]) -> Option<Best> {
        let mut trial = vec![0.0; point.parameters.len()];
        let mut evaluation = self.take_spare(work);
        let mut best: Option<Best> = None;
        for &length in lengths {
            trial_into(point, length, &mut trial);
            if work.evaluate_into(&trial, &mut evaluation).is_err() {
                continue;
            }
            let lowest = best
                .as_ref()
                .map_or(point.evaluation.cost, |b| b.evaluation.cost);
            if evaluation.cost < lowest {
                let (spare_trial, spare) = match best.take() {
                    Some(old) => (old.parameters, old.evaluation),
                    None => (trial.clone(), self.take_spare(work)),
                };
                best = Some(Best {
                    length,
                    parameters: std::mem::replace(&mut trial, spare_trial),
                    evaluation: std::mem::replace(&mut evaluation, spare),
                });
            }
        }
        self.spare.push(evaluation);
        best
    }

    fn take_spare(&mut self, work: &Work) -> Evaluation {
        self.spare
            .pop()
            .unwrap_or_else(|| work.problem().workspace())
    }
}

/// `p - length g`.
fn trial_into(point: &Point, length: f64, trial: &mut [f64]) {
    let moves = point.parameters.iter().zip(&point.gradient.l2);
    for (trial, (p, g)) in trial.iter_mut().zip(moves) {
        *trial = p - length * g;
    }
}

/// The trials' devices as a ray, on the paper's own problem: one free record seen at every node, one
/// value a node, linear terms, the midpoint rule, and nothing beside the integral cost.
fn ray<'a>(problem: &'a Problem, point: &'a Point) -> Option<Ray<'a>> {
    let (experiment, channel, _) = problem.one_full_record()?;
    let Weighting::Integral { spacing } = *channel.weighting() else {
        return None;
    };
    let oscillator = &problem.oscillator;
    let nodes = experiment.nodes;
    let fits = oscillator.method == Method::Midpoint
        && oscillator.terms == [Term::Damping, Term::Stiffness]
        && experiment.excitation.is_none()
        && !problem.is_regularised()
        && point.parameters.len() == 3 * nodes;
    let parts = |values: &'a [f64]| {
        let (mass, others) = values.split_at(nodes);
        let (damping, stiffness) = others.split_at(nodes);
        [mass, damping, stiffness]
    };
    fits.then(|| Ray {
        functions: parts(&point.parameters),
        direction: parts(&point.gradient.l2),
        initial: experiment.initial,
        readings: channel.observed(),
        step: oscillator.grid.step(),
        spacing,
    })
}
