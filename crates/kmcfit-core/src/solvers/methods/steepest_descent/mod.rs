//! Steepest descent with the paper's trial steps.

mod batched_trials;

use super::{Step, StepRule};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::reason::Reason;

/// Number of trial steps.
const TRIALS: u32 = 50;
/// Factor of the longest trial step: `5 sqrt(G^2)`.
const LONGEST: f64 = 5.0;

/// Tries the steps `5 sqrt(G^2) / i^4`, `i = 1..50`, along the negative L2 gradient and takes the trial of lowest cost, if it
/// is strictly lower than the current one.
///
/// For the paper's problem all trials are computed in batches, with bit-identical results.
#[derive(Default)]
pub struct SteepestDescent {
    spare: Vec<Evaluation>,
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
        let best = match batched_trials::ray(work.problem(), point) {
            Some(ray) => batched_trials::lowest(work, point, ray, &lengths, &mut self.spare),
            None => self.one_by_one(work, point, &lengths),
        };
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
        self.spare.push(evaluation);
    }
}

impl SteepestDescent {
    fn one_by_one(
        &mut self,
        work: &mut CountedEvaluator,
        point: &Iterate,
        lengths: &[f64],
    ) -> Option<Best> {
        let mut best = None;
        for &length in lengths {
            let parameters = trial(point, length);
            let mut evaluation = take(&mut self.spare, work.problem());
            if work.evaluate_into(&parameters, &mut evaluation).is_err() {
                self.spare.push(evaluation);
                continue;
            }
            let trial = Best {
                length,
                parameters,
                evaluation,
            };
            trial.or_lower(&mut best, point, &mut self.spare);
        }
        best
    }
}

impl Best {
    /// Replaces `best` if its cost is strictly lower than that of `best` and of the point; unused storage is added to `spare`.
    fn or_lower(self, best: &mut Option<Best>, point: &Iterate, spare: &mut Vec<Evaluation>) {
        let lowest = best
            .as_ref()
            .map_or(point.evaluation.cost, |b| b.evaluation.cost);
        let left = match self.evaluation.cost < lowest {
            true => best.replace(self),
            false => Some(self),
        };
        spare.extend(left.map(|left| left.evaluation));
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
fn take(spare: &mut Vec<Evaluation>, problem: &Problem) -> Evaluation {
    spare.pop().unwrap_or_else(|| problem.workspace())
}

/// Parameters `p - length g`.
fn trial(point: &Iterate, length: f64) -> Vec<f64> {
    let moves = point.parameters.iter().zip(&point.gradient.l2);
    moves.map(|(p, g)| p - length * g).collect()
}
