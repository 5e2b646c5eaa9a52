//! Gauss–Newton steps with a proximal term, under constraints.

mod dense;
mod structured;

use super::point::Work;
use super::{Descend, Point, Step};
use crate::problem::Problem;
use crate::qp::Subproblem;

/// Up to so many parameters the Jacobian is formed by one tangent solve each.
const FEW_PARAMETERS: usize = 64;
/// First weight of the proximal term, relative to J.
const FIRST_DAMPING: f64 = 1e-2;
/// Smallest weight: less is lost in the factorisation's own shift.
const LEAST_DAMPING: f64 = 1e-10;
/// Most tries in one iteration.
const TRIES: usize = 30;

/// The method and its damping.
pub struct GaussNewton {
    damping: f64,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self {
            damping: FIRST_DAMPING,
        }
    }
}

impl Descend for GaussNewton {
    fn step(&mut self, work: &mut Work, point: &Point) -> Step {
        let problem = work.problem();
        let mut sub = linearise(problem, point);
        let scales = proximal_scales(problem, point);
        let n = problem.functions.parameters();
        let mut evaluation = problem.workspace();
        for _ in 0..TRIES {
            let weight = self.damping * point.evaluation.cost;
            for (d, s) in sub.proximal.iter_mut().zip(&scales) {
                *d = weight * s;
            }
            let Some(z) = sub.solve_plain() else {
                self.damping *= 10.0;
                continue;
            };
            let predicted = point.evaluation.cost - sub.value(&z);
            let trial: Vec<f64> =
                point.parameters.iter().zip(&z[..n]).map(|(p, d)| p + d).collect();
            let result = work.evaluate_into(&trial, &mut evaluation);
            let gain = match result {
                Ok(()) => (point.evaluation.cost - evaluation.cost) / predicted,
                Err(_) => f64::NAN,
            };
            if std::env::var_os("GN_TRACE").is_some() {
                eprintln!("    damping {:.1e} predicted {predicted:.3e} gain {gain:.3} {:?}", self.damping, result.is_ok().then_some(evaluation.cost));
            }
            if gain > 0.05 {
                if gain > 0.7 {
                    self.damping = (self.damping / 10.0).max(LEAST_DAMPING);
                } else if gain < 0.3 {
                    self.damping *= 3.0;
                }
                return Step::Moved {
                    point: work.complete(trial, evaluation),
                    length: 1.0,
                };
            }
            self.damping *= 8.0;
        }
        Step::Stuck("no Gauss-Newton step lowers the cost".into())
    }
}

/// The subproblem at a point: readings, penalties, constraints, without the proximal term.
fn linearise(problem: &Problem, point: &Point) -> Subproblem {
    let mut sub = match problem.functions.parameters() {
        0..=FEW_PARAMETERS => dense::subproblem(problem, &point.evaluation),
        _ => structured::subproblem(problem, &point.evaluation),
    };
    for penalty in &problem.penalties {
        let range = problem.functions.ranges()[penalty.function].clone();
        let root = penalty.weight.sqrt();
        let residuals = penalty.residuals(&point.parameters[range.clone()]);
        for (i, r) in residuals.iter().enumerate() {
            let row = penalty.rows.row(i).map(|(j, a)| (range.start + j, root * a));
            sub.residuals.push(row, -root * r);
        }
    }
    for group in &problem.constraints.groups {
        let values = group.rows.multiply(&point.parameters);
        for (i, value) in values.iter().enumerate() {
            let (lower, upper) = group.bounds(i);
            if lower == upper {
                sub.equalities.push(group.rows.row(i), lower - value);
            } else {
                sub.bound(group.rows.row(i), lower - value, upper - value);
            }
        }
    }
    sub
}

/// Diagonal of the proximal term: `1/T integral (delta p / size of p)^2 dt`, summed over functions.
fn proximal_scales(problem: &Problem, point: &Point) -> Vec<f64> {
    let mut scales = vec![0.0; problem.functions.parameters()];
    let duration = problem.oscillator.grid.duration();
    let diagonal = problem.functions.gram_diagonal();
    let sizes: Vec<f64> = (point.evaluation.device.functions())
        .map(|f| f.iter().fold(0.0f64, |m, p| m.max(p.abs())))
        .collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    for (range, size) in problem.functions.ranges().iter().zip(sizes) {
        // A function that is zero has no size of its own.
        let size = if size > 0.0 { size } else { largest };
        for j in range.clone() {
            scales[j] = diagonal[j] / (duration * size * size);
        }
    }
    scales
}
