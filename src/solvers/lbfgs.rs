//! Limited-memory BFGS in the L2 inner product.
//!
//! The search runs in coordinates `x`: the logarithm of the mass where its parameters can carry
//! one, the parameters themselves elsewhere. A step in `ln m` cannot take the mass through zero,
//! where plain L-BFGS ends. All inner products are those of functions of time, `x^T G x'`, so the
//! path hardly depends on the number of nodes. Pairs that have lost curvature are left out; after
//! a failed line search the memory is dropped once and the search goes on along the gradient.
//!
//! argmin runs the loop and counts the solves; its own L-BFGS is not used, as it has no guard
//! against lost curvature, no step limit, and asks for cost and gradient separately.

use super::line_search::{Line, weak_wolfe};
use super::point::Work;
use super::{Descend, Point, Step};
use crate::functions::{Functions, Quantity};
use crate::objective::Evaluation;
use crate::problem::Problem;
use std::collections::VecDeque;

/// Pairs with `<s, z>` below this fraction of `|s| |z|` carry rounding, not curvature.
const LOST_CURVATURE: f64 = 1e-10;
/// Largest change of `ln m` at the first trial of a step: a factor of e.
const LONGEST_LOG_STEP: f64 = 1.0;

/// The method and its memory.
pub struct Lbfgs {
    memory: usize,
    pairs: VecDeque<Pair>,
}

/// A step `s` and the change `z` of the gradient along it, in coordinates.
struct Pair {
    s: Vec<f64>,
    z: Vec<f64>,
    curvature: f64,
}

impl Lbfgs {
    pub fn new(memory: usize) -> Self {
        Self {
            memory,
            pairs: VecDeque::with_capacity(memory),
        }
    }

    fn attempt(&mut self, work: &mut Work, at: &Coordinates, point: &Point) -> Option<Step> {
        let gradient = at.gradient(point);
        let direction = work.algebra(|| self.direction(at, &gradient));
        let slope = at.inner(&gradient, &direction);
        if slope.is_nan() || slope >= 0.0 {
            return None;
        }
        let first = if self.pairs.is_empty() {
            // The step at which the linear model of J reaches zero.
            -point.evaluation.cost / slope
        } else {
            1.0
        };
        let mut trials = Trials {
            at,
            x: at.forth(&point.parameters),
            direction: &direction,
            spare: Some(work.problem().workspace()),
            candidate: None,
            last: 0.0,
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
        let (length, next) = trials.accepted?;
        work.algebra(|| self.remember(at, point, &next, &gradient));
        Some(Step::Moved {
            point: Box::new(next),
            length,
            hindered: false,
        })
    }

    fn remember(&mut self, at: &Coordinates, before: &Point, after: &Point, gradient: &[f64]) {
        let s = difference(&at.forth(&after.parameters), &at.forth(&before.parameters));
        let z = difference(&at.gradient(after), gradient);
        let curvature = at.inner(&s, &z);
        let scale = (at.inner(&s, &s) * at.inner(&z, &z)).sqrt();
        if curvature > LOST_CURVATURE * scale {
            if self.pairs.len() == self.memory {
                self.pairs.pop_front();
            }
            self.pairs.push_back(Pair { s, z, curvature });
        }
    }

    /// The two-loop recursion, `-H g`.
    fn direction(&self, at: &Coordinates, gradient: &[f64]) -> Vec<f64> {
        let mut q: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut weights = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let weight = at.inner(&pair.s, &q) / pair.curvature;
            add_scaled(&mut q, -weight, &pair.z);
            weights.push(weight);
        }
        if let Some(last) = self.pairs.back() {
            let scale = last.curvature / at.inner(&last.z, &last.z);
            q.iter_mut().for_each(|q| *q *= scale);
        }
        for (pair, weight) in self.pairs.iter().zip(weights.into_iter().rev()) {
            let back = at.inner(&pair.z, &q) / pair.curvature;
            add_scaled(&mut q, weight - back, &pair.s);
        }
        q
    }
}

impl Descend for Lbfgs {
    fn step(&mut self, work: &mut Work, point: &Point) -> Step {
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
        Step::Stuck("no step along the gradient lowers the cost enough".into())
    }
}

/// Which coordinates are logarithms, and the inner product of all.
struct Coordinates<'p> {
    functions: &'p Functions,
    logarithmic: Vec<bool>,
}

impl<'p> Coordinates<'p> {
    fn new(problem: &'p Problem, parameters: &[f64]) -> Self {
        let functions = &problem.functions;
        let mut logarithmic = vec![false; parameters.len()];
        for (function, range) in functions.iter().zip(functions.ranges()) {
            let all_positive = parameters[range.clone()].iter().all(|p| *p > 0.0);
            if function.quantity == Quantity::Mass && function.positive_parameters && all_positive {
                logarithmic[range.clone()].fill(true);
            }
        }
        Self {
            functions,
            logarithmic,
        }
    }

    fn forth(&self, parameters: &[f64]) -> Vec<f64> {
        let pairs = parameters.iter().zip(&self.logarithmic);
        pairs
            .map(|(p, log)| if *log { p.ln() } else { *p })
            .collect()
    }

    fn back(&self, x: &[f64]) -> Vec<f64> {
        let pairs = x.iter().zip(&self.logarithmic);
        pairs
            .map(|(x, log)| if *log { x.exp() } else { *x })
            .collect()
    }

    /// The L2 gradient in these coordinates.
    fn gradient(&self, point: &Point) -> Vec<f64> {
        let chained: Vec<f64> = (point.gradient.euclidean.iter().zip(&point.parameters))
            .zip(&self.logarithmic)
            .map(|((g, p), log)| if *log { g * p } else { *g })
            .collect();
        self.functions.gram_solve(&chained)
    }

    fn inner(&self, a: &[f64], b: &[f64]) -> f64 {
        let weighted = self.functions.gram_multiply(b);
        a.iter().zip(&weighted).map(|(a, b)| a * b).sum()
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
    work: &'a mut Work<'w, 'q>,
    at: &'a Coordinates<'p>,
    x: Vec<f64>,
    direction: &'a [f64],
    spare: Option<Evaluation>,
    candidate: Option<(Vec<f64>, Evaluation)>,
    /// Step of the last trial.
    last: f64,
    /// The lowest trial that lowered the cost enough, and its step.
    accepted: Option<(f64, Point)>,
}

impl Line for Trials<'_, '_, '_, '_> {
    fn cost(&mut self, a: f64) -> Option<f64> {
        self.last = a;
        let mut x = self.x.clone();
        add_scaled(&mut x, a, self.direction);
        let parameters = self.at.back(&x);
        let mut evaluation = match (self.spare.take(), self.candidate.take()) {
            (Some(spare), _) => spare,
            (None, Some((_, used))) => used,
            (None, None) => self.work.problem().workspace(),
        };
        match self.work.evaluate_into(&parameters, &mut evaluation) {
            Ok(()) => {
                let cost = evaluation.cost;
                self.candidate = Some((parameters, evaluation));
                Some(cost)
            }
            Err(_) => {
                self.spare = Some(evaluation);
                None
            }
        }
    }

    fn slope(&mut self) -> f64 {
        let Some((parameters, evaluation)) = self.candidate.take() else {
            return f64::NAN;
        };
        let point = self.work.complete(parameters, evaluation);
        let slope = self.at.inner(&self.at.gradient(&point), self.direction);
        let lowest = self.accepted.as_ref().map(|(_, p)| p.evaluation.cost);
        if lowest.is_none_or(|lowest| point.evaluation.cost < lowest) {
            self.accepted = Some((self.last, point));
        }
        slope
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn add_scaled(a: &mut [f64], factor: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}
