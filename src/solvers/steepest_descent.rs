//! Steepest descent exactly as in the paper.

use super::point::Work;
use super::{Descend, Point, Step};
use crate::objective::Evaluation;

/// Number of trial steps.
const TRIALS: u32 = 50;
/// Factor of the longest trial step: `5 sqrt(G^2)`.
const LONGEST: f64 = 5.0;

/// Tries the steps `5 sqrt(G^2) / i^4`, `i = 1..50`, along the L2 gradient and takes the trial with
/// the lowest cost, if it is strictly lower.
#[derive(Default)]
pub struct SteepestDescent {
    spare: Vec<Evaluation>,
}

impl Descend for SteepestDescent {
    fn step(&mut self, work: &mut Work, point: &Point) -> Step {
        let root = point.gradient.norm_squared.sqrt();
        let mut trial = vec![0.0; point.parameters.len()];
        let mut evaluation = self.take_spare(work);
        let mut best: Option<(f64, Vec<f64>, Evaluation)> = None;
        for i in 1..=TRIALS {
            let length = LONGEST * root / f64::from(i.pow(4));
            let moves = point.parameters.iter().zip(&point.gradient.l2);
            for (trial, (p, g)) in trial.iter_mut().zip(moves) {
                *trial = p - length * g;
            }
            if work.evaluate_into(&trial, &mut evaluation).is_err() {
                continue;
            }
            let lowest = best.as_ref().map_or(point.evaluation.cost, |b| b.2.cost);
            if evaluation.cost < lowest {
                let (spare_trial, spare) = match best.take() {
                    Some((_, old_trial, old)) => (old_trial, old),
                    None => (trial.clone(), self.take_spare(work)),
                };
                best = Some((
                    length,
                    std::mem::replace(&mut trial, spare_trial),
                    std::mem::replace(&mut evaluation, spare),
                ));
            }
        }
        self.spare.push(evaluation);
        match best {
            Some((length, parameters, evaluation)) => Step::Moved {
                point: Box::new(work.complete(parameters, evaluation)),
                length,
                hindered: false,
            },
            None => Step::Stuck(format!("none of the {TRIALS} trial steps lowers the cost")),
        }
    }
}

impl SteepestDescent {
    fn take_spare(&mut self, work: &Work) -> Evaluation {
        self.spare
            .pop()
            .unwrap_or_else(|| work.problem().workspace())
    }
}
