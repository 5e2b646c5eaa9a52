//! Steepest descent with the paper's trial steps.

use super::{Step, StepRule};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::Weighting;
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::reason::Reason;
use crate::step::{EngineMode, SearchRay, is_linear_midpoint};

/// Number of trial steps.
const TRIALS: u32 = 50;
/// Factor of the longest trial step: `5 sqrt(G^2)`.
const LONGEST: f64 = 5.0;

/// Tries the steps `5 sqrt(G^2) / i^4`, `i = 1..50`, along the negative L2 gradient and takes the trial of lowest cost, if it
/// is strictly lower than the current one.
///
/// For the paper's problem eight trials at a time choose the candidates for the lowest cost, and these alone are computed in the paper's
/// order of operations: the results are the same bits.
#[derive(Default)]
pub struct SteepestDescent {
    workspace: Vec<Evaluation>,
}

/// A trial that lowers the cost.
struct Best {
    length: f64,
    parameters: Vec<f64>,
    evaluation: Evaluation,
}

impl StepRule for SteepestDescent {
    fn step(&mut self, work: &mut CountedEvaluator, point: &Iterate) -> Step {
        let lengths = lengths(point);
        let (problem, mode) = (work.problem(), work.mode);
        let best = work.forwards(lengths.len() as u64, || match ray(problem, point) {
            Some(ray) => {
                let candidates = ray.candidates(&lengths).into_iter();
                let candidates: Vec<f64> = candidates.map(|which| lengths[which]).collect();
                self.lowest(problem, EngineMode::Reference, point, &candidates)
            }
            None => self.lowest(problem, mode, point, &lengths),
        });
        match best {
            Some(best) => Step::Moved {
                point: Box::new(work.complete(best.parameters, best.evaluation)),
                length: best.length,
                limited: false,
            },
            None => Step::Stuck(Reason::NoLowerTrial(TRIALS)),
        }
    }

    fn recycle(&mut self, evaluation: Evaluation) {
        self.workspace.push(evaluation);
    }
}

impl SteepestDescent {
    /// Best trial, if it lowers the cost.
    fn lowest(
        &mut self,
        problem: &Problem,
        mode: EngineMode,
        point: &Iterate,
        lengths: &[f64],
    ) -> Option<Best> {
        let mut best = None;
        for &length in lengths {
            let parameters = trial(point, length);
            let mut evaluation = take(&mut self.workspace, problem);
            let found = problem.evaluate_for(mode, &parameters, &mut evaluation);
            if found.is_err() {
                self.workspace.push(evaluation);
                continue;
            }
            let trial = Best {
                length,
                parameters,
                evaluation,
            };
            trial.or_lower(&mut best, point, &mut self.workspace);
        }
        best
    }
}

impl Best {
    /// Replaces `best` if its cost is strictly lower than that of `best` and of the point; unused storage is added to `workspace`.
    fn or_lower(self, best: &mut Option<Best>, point: &Iterate, workspace: &mut Vec<Evaluation>) {
        let lowest = best
            .as_ref()
            .map_or(point.evaluation.cost, |b| b.evaluation.cost);
        let left = match self.evaluation.cost < lowest {
            true => best.replace(self),
            false => Some(self),
        };
        workspace.extend(left.map(|left| left.evaluation));
    }
}

/// Lengths of the trial steps, longest first.
fn lengths(point: &Iterate) -> Vec<f64> {
    let root = point.gradient.norm_squared.sqrt();
    (1..=TRIALS)
        .map(|i| LONGEST * root / f64::from(i.pow(4)))
        .collect()
}

/// Storage for an evaluation.
fn take(workspace: &mut Vec<Evaluation>, problem: &Problem) -> Evaluation {
    workspace.pop().unwrap_or_else(|| problem.workspace())
}

/// Parameters `p - length g`.
fn trial(point: &Iterate, length: f64) -> Vec<f64> {
    let moves = point.parameters.iter().zip(&point.gradient.l2);
    moves.map(|(p, g)| p - length * g).collect()
}

/// Trial systems as a search ray, for the paper's problem: one free record with a sample at every node, nodal functions,
/// linear terms, the midpoint rule and the integral cost alone; `None` for any other problem.
fn ray<'a>(problem: &'a Problem, point: &'a Iterate) -> Option<SearchRay<'a>> {
    let (experiment, channel, _) = problem.one_full_record()?;
    let system = &problem.system;
    let nodes = experiment.nodes;
    let is_integral = matches!(channel.weighting(), Weighting::Integral { .. });
    let fits = is_integral
        && is_linear_midpoint(system)
        && experiment.excitation.is_none()
        && !problem.is_regularised()
        && point.parameters.len() == 3 * nodes;
    let parts = |values: &'a [f64]| {
        let (mass, others) = values.split_at(nodes);
        let (damping, stiffness) = others.split_at(nodes);
        [mass, damping, stiffness]
    };
    fits.then(|| SearchRay {
        functions: parts(&point.parameters),
        direction: parts(&point.gradient.l2),
        initial: &experiment.initial,
        samples: channel.observed(),
        step: system.grid.step(),
    })
}

#[cfg(test)]
mod tests;
