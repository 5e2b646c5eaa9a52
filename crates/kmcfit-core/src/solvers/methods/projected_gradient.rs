//! Spectral projected gradient: a gradient step projected onto the constraints, then a line search towards the projection.
//!
//! After E. G. Birgin, J. M. Martinez, M. Raydan, *Nonmonotone spectral projected gradient methods on
//! convex sets*, SIAM J. Optim. 10 (2000), with a monotone line search, so that the last point is the best one. Metric and
//! projection are those of functions, `sum_f 1/T integral (delta p_f / size_f)^2 dt`, with the sizes at the start.

use super::{Step, StepRule, difference, no_step};
use crate::constraints::TOLERANCE;
use crate::qp::{ConicStatus, StageLayout, Subproblem, project_by};
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::reason::Reason;
use crate::solvers::settings::QpSolver;

/// Sufficient decrease along the feasible direction.
const DECREASE: f64 = 1e-4;
/// Largest number of halvings of a step.
const HALVINGS: u32 = 40;
/// Range of the spectral step, relative to the first one.
const STEP_RANGE: [f64; 2] = [1e-10, 1e10];

/// The method: metric of the search, first and last step length.
#[derive(Default)]
pub struct ProjectedGradient {
    metric: Vec<f64>,
    first_length: f64,
    length: f64,
}

impl StepRule for ProjectedGradient {
    fn step(&mut self, work: &mut CountedEvaluator, point: &Iterate) -> Step {
        if self.metric.is_empty() {
            self.prepare(work, point);
        }
        let target = match self.target(work, point) {
            Ok(target) => target,
            Err(status) => return no_step(work.problem(), point, status),
        };
        let direction = difference(&target, &point.parameters);
        let slope = dot(&point.gradient.euclidean, &direction);
        if slope.abs() <= f64::EPSILON * point.evaluation.cost {
            return Step::Minimum(Reason::ZeroProjectedGradient);
        }
        // Also for NaN: the cost falls towards a correct projection.
        if slope.is_nan() || slope > 0.0 {
            return Step::Stuck(Reason::NoDescentToProjection);
        }
        let mut evaluation = work.problem().workspace();
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let trial: Vec<f64> = (point.parameters.iter().zip(&direction))
                .map(|(p, d)| p + share * d)
                .collect();
            let lower = work.evaluate_into(&trial, &mut evaluation).is_ok()
                && evaluation.cost <= point.evaluation.cost + DECREASE * share * slope
                && evaluation.cost < point.evaluation.cost;
            if lower {
                let next = work.complete(trial, evaluation);
                self.learn(point, &next);
                return Step::Moved {
                    point: Box::new(next),
                    length: share,
                    limited: false,
                };
            }
            share *= 0.5;
        }
        Step::Stuck(Reason::NoLowerStepToProjection)
    }
}

impl ProjectedGradient {
    fn prepare(&mut self, work: &CountedEvaluator, point: &Iterate) {
        let problem = work.problem();
        self.metric = point.relative_metric(problem);
        // Step at which the linear model of J reaches zero.
        let gradient = &point.gradient.euclidean;
        let squared: f64 = gradient
            .iter()
            .zip(&self.metric)
            .map(|(g, m)| g * g / m)
            .sum();
        self.first_length = point.evaluation.cost / squared.max(f64::MIN_POSITIVE);
        self.length = self.first_length;
    }

    /// Projection of the gradient step.
    fn target(
        &self,
        work: &mut CountedEvaluator,
        point: &Iterate,
    ) -> Result<Vec<f64>, ConicStatus> {
        let constraints = &work.problem().constraints;
        let steps = point.gradient.euclidean.iter().zip(&self.metric);
        let mut target: Vec<f64> = (point.parameters.iter().zip(steps))
            .map(|(p, (g, m))| p - self.length * g / m)
            .collect();
        let wants_clarabel = work.qp == QpSolver::Clarabel && !constraints.is_empty();
        if constraints.are_simple() && !wants_clarabel {
            // In a diagonal metric the projection is clipping.
            constraints.clip(&mut target);
            return Ok(target);
        }
        if constraints.hold(&target, 0.0) && !wants_clarabel {
            return Ok(target);
        }
        let iterations = work.program_iterations;
        let solve = |sub: &Subproblem| match wants_clarabel {
            true => sub.solve_by_clarabel(iterations),
            false => sub.solve_within(iterations),
        };
        let layout = StageLayout::of(&work.problem().functions);
        let projection =
            work.program(|| project_by(constraints, &target, &self.metric, layout, solve));
        match projection.status {
            ConicStatus::Solved | ConicStatus::Almost
                if constraints.hold(&projection.theta, TOLERANCE) =>
            {
                Ok(projection.theta)
            }
            ConicStatus::Solved | ConicStatus::Almost => Err(ConicStatus::Stalled),
            status => Err(status),
        }
    }

    /// Spectral step `|s|^2 / <s, z>` in the metric.
    fn learn(&mut self, before: &Iterate, after: &Iterate) {
        let s = difference(&after.parameters, &before.parameters);
        let z = difference(&after.gradient.euclidean, &before.gradient.euclidean);
        let squared: f64 = s.iter().zip(&self.metric).map(|(s, m)| m * s * s).sum();
        let curvature = dot(&s, &z);
        let [low, high] = STEP_RANGE.map(|factor| factor * self.first_length);
        self.length = if curvature > 0.0 {
            (squared / curvature).clamp(low, high)
        } else {
            high.min(10.0 * self.length)
        };
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
