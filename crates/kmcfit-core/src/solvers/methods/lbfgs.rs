//! Limited-memory BFGS in the L2 inner product.
//!
//! The search variables `x` are the logarithm of the mass where its basis permits, otherwise the parameters, divided by a
//! [`unit`] where they are very large or small. A step in `ln m` cannot make the mass negative, which ends plain L-BFGS.
//! Inner products are those of functions of time, `x^T G x'`, so the iterates hardly depend on the number of nodes. Pairs
//! without positive curvature are rejected; after a failed line search the memory is cleared once and the search continues
//! along the gradient.
//!
//! argmin runs the loop and counts the solves. Its own L-BFGS is not used: it has no curvature safeguard and no step limit,
//! and evaluates cost and gradient separately.

use super::line_search::{LineFunction, weak_wolfe};
use super::{Step, StepRule, difference};
use crate::functions::{CoefficientKind, Parameterization};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::simd::sum::{dot, largest};
use crate::simd::{self, Elementwise};
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::solvers::reason::Reason;
use std::collections::VecDeque;

/// Share of `|s| |z|` below which `<s, z>` is a rounding error.
const LOST_CURVATURE: f64 = 1e-10;
/// Largest change of `ln m` at the first trial of a step: a factor of e.
const LONGEST_LOG_STEP: f64 = 1.0;

/// Starts of functions within this range need no other unit.
const ORDINARY: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// The method with its memory.
pub struct Lbfgs {
    memory: usize,
    pairs: VecDeque<Pair>,
    /// Point reached by the last step.
    here: Option<Here>,
}

/// A vector `x` with its dual `G x`; an inner product is a sum of products of the two.
struct Vector {
    primal: Vec<f64>,
    dual: Vec<f64>,
}

/// A step `s` and the change `z` of the gradient along it.
struct Pair {
    s: Vector,
    z: Vector,
    curvature: f64,
}

/// A point in search variables.
struct Here {
    parameters: Vec<f64>,
    logarithmic: Vec<bool>,
    x: Vec<f64>,
    gradient: Vector,
}

impl Vector {
    /// Inner product `x^T G x'`.
    fn inner(&self, primal: &[f64]) -> f64 {
        dot(&self.dual, primal)
    }

    fn minus(&self, other: &Self) -> Self {
        Self {
            primal: difference(&self.primal, &other.primal),
            dual: difference(&self.dual, &other.dual),
        }
    }
}

impl Lbfgs {
    pub fn new(memory: usize) -> Self {
        Self {
            memory,
            pairs: VecDeque::with_capacity(memory),
            here: None,
        }
    }

    fn attempt(
        &mut self,
        work: &mut CountedEvaluator,
        at: &Coordinates,
        point: &Iterate,
    ) -> Option<Step> {
        let Here { x, gradient, .. } = self.here(at, point);
        let direction = work.algebra(|| self.direction(&gradient.primal));
        let slope = gradient.inner(&direction);
        if slope.is_nan() || slope >= 0.0 {
            return None;
        }
        let first = if self.pairs.is_empty() {
            // Step at which the linear model of J reaches zero.
            -point.evaluation.cost / slope
        } else {
            1.0
        };
        let mut trials = Trials {
            at,
            x,
            direction: &direction,
            workspace: Some(work.problem().workspace()),
            trial: None,
            accepted: None,
            work,
        };
        let longest = LONGEST_LOG_STEP / at.largest_log_change(&direction);
        weak_wolfe(
            &mut trials,
            point.evaluation.cost,
            slope,
            first.min(longest),
        )?;
        let Accepted {
            length,
            x: next_x,
            point: next,
            gradient: next_gradient,
        } = trials.accepted?;
        let x = trials.x;
        work.algebra(|| {
            let s = difference(&next_x, &x);
            let dual = at.functions.gram_multiply(&s);
            self.remember(Vector { primal: s, dual }, next_gradient.minus(&gradient));
        });
        self.here = Some(Here {
            parameters: next.parameters.clone(),
            logarithmic: at.logarithmic.clone(),
            x: next_x,
            gradient: next_gradient,
        });
        Some(Step::Moved {
            point: Box::new(next),
            length,
            limited: false,
        })
    }

    /// The point in search variables, reused from the last step if unchanged.
    fn here(&mut self, at: &Coordinates, point: &Iterate) -> Here {
        let same =
            |here: &Here| here.parameters == point.parameters && here.logarithmic == at.logarithmic;
        match self.here.take().filter(same) {
            Some(here) => here,
            None => Here {
                parameters: point.parameters.clone(),
                logarithmic: at.logarithmic.clone(),
                x: at.forth(&point.parameters),
                gradient: at.gradient(point),
            },
        }
    }

    fn remember(&mut self, s: Vector, z: Vector) {
        let curvature = s.inner(&z.primal);
        let scale = (s.inner(&s.primal) * z.inner(&z.primal)).sqrt();
        if curvature > LOST_CURVATURE * scale {
            if self.pairs.len() == self.memory {
                self.pairs.pop_front();
            }
            self.pairs.push_back(Pair { s, z, curvature });
        }
    }

    /// Search direction `-H g` by the two-loop recursion.
    fn direction(&self, gradient: &[f64]) -> Vec<f64> {
        let mut q: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut weights = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let weight = pair.s.inner(&q) / pair.curvature;
            add_scaled(&mut q, -weight, &pair.z.primal);
            weights.push(weight);
        }
        if let Some(last) = self.pairs.back() {
            let scale = last.curvature / last.z.inner(&last.z.primal);
            q.iter_mut().for_each(|q| *q *= scale);
        }
        for (pair, weight) in self.pairs.iter().zip(weights.into_iter().rev()) {
            let back = pair.z.inner(&q) / pair.curvature;
            add_scaled(&mut q, weight - back, &pair.s.primal);
        }
        q
    }
}

impl StepRule for Lbfgs {
    fn step(&mut self, work: &mut CountedEvaluator, point: &Iterate) -> Step {
        let at = Coordinates::new(work.problem(), &point.parameters);
        if let Some(step) = self.attempt(work, &at, point) {
            return step;
        }
        if !self.pairs.is_empty() {
            self.pairs.clear();
            if let Some(step) = self.attempt(work, &at, point) {
                return step;
            }
        }
        Step::Stuck(Reason::NoLowerLineStep)
    }
}

/// Search variables: logarithmic flags, units and inner product.
struct Coordinates<'p> {
    functions: &'p Parameterization,
    units: Vec<f64>,
    logarithmic: Vec<bool>,
}

/// Unit of every parameter.
fn units(functions: &Parameterization) -> Vec<f64> {
    let mut units = vec![1.0; functions.parameters()];
    for (function, range) in functions.iter().zip(functions.ranges()) {
        units[range.clone()].fill(unit(largest(&function.start)));
    }
    units
}

/// Unit of a parameter: the power of two nearest to its start if that is very large or small, otherwise one. Without it the
/// first steps would change such a parameter not at all, or it alone.
fn unit(size: f64) -> f64 {
    let ordinary = size == 0.0 || ORDINARY.contains(&size) || !size.is_finite();
    if ordinary {
        1.0
    } else {
        size.log2().round().exp2()
    }
}

impl<'p> Coordinates<'p> {
    fn new(problem: &'p Problem, parameters: &[f64]) -> Self {
        let functions = &problem.functions;
        let mut logarithmic = vec![false; parameters.len()];
        for (function, range) in functions.iter().zip(functions.ranges()) {
            let all_positive = parameters[range.clone()].iter().all(|p| *p > 0.0);
            if function.quantity == CoefficientKind::MASS
                && function.positive_parameters
                && all_positive
            {
                logarithmic[range.clone()].fill(true);
            }
        }
        Self {
            functions,
            units: units(functions),
            logarithmic,
        }
    }

    /// Logarithmic flag and unit of each parameter.
    fn kinds(&self) -> impl Iterator<Item = (bool, f64)> {
        self.logarithmic
            .iter()
            .copied()
            .zip(self.units.iter().copied())
    }

    fn forth(&self, parameters: &[f64]) -> Vec<f64> {
        let pairs = parameters.iter().zip(self.kinds());
        pairs
            .map(|(p, (log, unit))| if log { p.ln() } else { p / unit })
            .collect()
    }

    fn back(&self, x: &[f64]) -> Vec<f64> {
        let pairs = x.iter().zip(self.kinds());
        pairs
            .map(|(x, (log, unit))| if log { x.exp() } else { x * unit })
            .collect()
    }

    /// Gradient in the search variables: L2, with the Euclidean one as its dual.
    fn gradient(&self, point: &Iterate) -> Vector {
        let dual: Vec<f64> = (point.gradient.euclidean.iter().zip(&point.parameters))
            .zip(self.kinds())
            .map(|((g, p), (log, unit))| if log { g * p } else { g * unit })
            .collect();
        Vector {
            primal: self.functions.gram_solve(&dual),
            dual,
        }
    }

    fn largest_log_change(&self, direction: &[f64]) -> f64 {
        let logs = direction
            .iter()
            .zip(&self.logarithmic)
            .filter(|(_, log)| **log);
        logs.fold(0.0f64, |most, (d, _)| most.max(d.abs()))
    }
}

/// Trial points along one direction.
struct Trials<'a, 'w, 'q, 'p> {
    work: &'a mut CountedEvaluator<'w, 'q>,
    at: &'a Coordinates<'p>,
    x: Vec<f64>,
    direction: &'a [f64],
    workspace: Option<Evaluation>,
    trial: Option<Trial>,
    /// Lowest trial with sufficient decrease.
    accepted: Option<Accepted>,
}

/// A trial with its cost.
struct Trial {
    length: f64,
    x: Vec<f64>,
    parameters: Vec<f64>,
    evaluation: Evaluation,
}

/// A trial with cost and gradient.
struct Accepted {
    length: f64,
    x: Vec<f64>,
    point: Iterate,
    gradient: Vector,
}

impl LineFunction for Trials<'_, '_, '_, '_> {
    fn cost(&mut self, length: f64) -> Option<f64> {
        let mut x = self.x.clone();
        add_scaled(&mut x, length, self.direction);
        let parameters = self.at.back(&x);
        let mut evaluation = match (self.workspace.take(), self.trial.take()) {
            (Some(workspace), _) => workspace,
            (None, Some(used)) => used.evaluation,
            (None, None) => self.work.problem().workspace(),
        };
        match self.work.evaluate_into(&parameters, &mut evaluation) {
            Ok(()) => {
                let cost = evaluation.cost;
                self.trial = Some(Trial {
                    length,
                    x,
                    parameters,
                    evaluation,
                });
                Some(cost)
            }
            Err(_) => {
                self.workspace = Some(evaluation);
                None
            }
        }
    }

    fn slope(&mut self) -> f64 {
        let Some(trial) = self.trial.take() else {
            return f64::NAN;
        };
        let point = self.work.complete(trial.parameters, trial.evaluation);
        let gradient = self.at.gradient(&point);
        let slope = gradient.inner(self.direction);
        let lowest = self.accepted.as_ref().map(|a| a.point.evaluation.cost);
        if lowest.is_none_or(|lowest| point.evaluation.cost < lowest) {
            self.accepted = Some(Accepted {
                length: trial.length,
                x: trial.x,
                point,
                gradient,
            });
        }
        slope
    }
}

fn add_scaled(a: &mut [f64], factor: f64, b: &[f64]) {
    simd::run(Elementwise(|| {
        for (a, b) in a.iter_mut().zip(b) {
            *a += factor * b;
        }
    }));
}
