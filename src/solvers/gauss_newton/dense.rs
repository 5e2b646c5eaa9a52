//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use crate::lanes::LANES;
use crate::lanes::tall::{Piece, Triangle};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::solvers::{Timings, timed};
use nalgebra::{DMatrix, DVector};
use std::time::{Duration, Instant};

/// How the residuals of the readings of all channels are weighed.
struct Residuals {
    /// `sqrt(w)`.
    roots: Vec<f64>,
    /// `sqrt(w) r`.
    weighted: Vec<f64>,
}

impl Residuals {
    /// At an evaluated point.
    fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let mut roots = Vec::with_capacity(problem.reading_count());
        let mut weighted = Vec::with_capacity(problem.reading_count());
        for (experiment, predictions) in problem.experiments.iter().zip(&evaluation.predictions) {
            for (channel, predicted) in experiment.channels.iter().zip(predictions) {
                let first = roots.len();
                match channel.uniform_weights() {
                    Some([inner, ends]) => {
                        roots.resize(first + channel.len(), inner.sqrt());
                        let last = roots.len() - 1;
                        (roots[first], roots[last]) = (ends.sqrt(), ends.sqrt());
                    }
                    None => {
                        let each = channel.residuals(predicted).enumerate();
                        roots.extend(each.map(|(i, r)| channel.weight(i, r).sqrt()));
                    }
                }
                let pairs = channel.residuals(predicted).zip(&roots[first..]);
                weighted.extend(pairs.map(|(r, root)| root * r));
            }
        }
        Self { roots, weighted }
    }
}

/// Whether the reduction of rows with so many columns takes much longer than a look at the clock, and than to hand
/// them to another thread.
pub(crate) fn is_wide(columns: usize) -> bool {
    columns > LANES
}

/// The readings, linearised and reduced to as many rows as there are parameters:
/// `|R delta + b|^2 + rest^2`, with the triangular factor `R` of the weighted Jacobian.
pub(crate) struct Reduced {
    triangle: Triangle,
    /// The parameter of each column.
    order: Vec<usize>,
    residuals: Residuals,
    took: Duration,
}

impl Reduced {
    /// Whether a problem's Jacobian can be reduced piece by piece as it comes ([`Problem::each_piece`]), and
    /// is worth it.
    pub fn comes_in_pieces(problem: &Problem) -> bool {
        problem.comes_in_pieces() && problem.reading_count() > problem.parameters()
    }

    /// Of no rows yet, at an evaluated point, for the parameters in `order` ([`Problem::places`]).
    pub fn new(problem: &Problem, evaluation: &Evaluation, order: Vec<usize>) -> Self {
        Self {
            triangle: Triangle::new(order.len()),
            order,
            residuals: Residuals::at(problem, evaluation),
            took: Duration::ZERO,
        }
    }

    /// Adds the rows of a piece.
    pub fn add(&mut self, piece: &mut Piece) {
        let rows = piece.first..piece.first + piece.count;
        let Residuals { roots, weighted } = &self.residuals;
        let (roots, right) = (&roots[rows.clone()], &weighted[rows]);
        let mut add = || self.triangle.add_weighted(piece, roots, right);
        match is_wide(self.order.len()) {
            true => timed(&mut self.took, add),
            false => add(),
        }
    }

    /// How long it took, if it was long enough to be told: else it is part of what brings the rows.
    pub fn took(&self) -> Duration {
        self.took
    }

    /// All rows, piece by piece.
    fn at(problem: &Problem, evaluation: &Evaluation, timings: &mut Timings) -> Self {
        let clock = Instant::now();
        let order = problem.places();
        let mut reduced = Self::new(problem, evaluation, order.clone());
        problem.each_piece(evaluation, &order, |mut piece| {
            reduced.add(&mut piece);
            piece
        });
        timings.linear_algebra += reduced.took;
        timings.tangent += clock.elapsed().saturating_sub(reduced.took);
        reduced
    }
}

/// The subproblem in `delta theta`, with what no step can change as a row of its own.
fn of_triangle(triangle: &Triangle, order: &[usize]) -> Subproblem {
    let mut sub = empty(order.len());
    for (entries, b) in triangle.rows() {
        let entries = entries.map(|(place, r)| (order[place], r));
        sub.residuals.push(entries, -b);
    }
    sub.residuals.push([], triangle.rest());
    sub
}

/// A subproblem whose variables are eliminated all at once.
fn empty(variables: usize) -> Subproblem {
    let mut sub = Subproblem::new(variables);
    sub.stations = vec![0; variables];
    sub
}

/// The subproblem in `delta theta` at an evaluated point, from the readings `ahead` if they have been linearised
/// already: one tangent solve for each parameter.
pub(super) fn subproblem(
    problem: &Problem,
    evaluation: &Evaluation,
    ahead: Option<Reduced>,
    timings: &mut Timings,
) -> Subproblem {
    if Reduced::comes_in_pieces(problem) {
        let reduced = ahead.unwrap_or_else(|| Reduced::at(problem, evaluation, timings));
        // Else in another order of operations.
        if reduced.triangle.is_finite() {
            return timed(&mut timings.linear_algebra, || {
                of_triangle(&reduced.triangle, &reduced.order)
            });
        }
    }
    let residuals = Residuals::at(problem, evaluation);
    let jacobian = timed(&mut timings.tangent, || {
        problem.predictions_jacobian(evaluation)
    });
    timed(&mut timings.linear_algebra, || {
        let Residuals { roots, weighted } = &residuals;
        if jacobian.nrows() > jacobian.ncols() {
            let (triangle, order) = Triangle::of(&jacobian, roots, weighted);
            return of_triangle(&triangle, &order);
        }
        let mut sub = empty(jacobian.ncols());
        for ((row, root), r) in jacobian.row_iter().zip(roots).zip(weighted) {
            let entries = row.iter().map(|a| root * a).enumerate();
            sub.residuals.push(entries.filter(|(_, a)| *a != 0.0), -r);
        }
        // So that the readings' rows end alike.
        sub.residuals.push([], 0.0);
        sub
    })
}

/// `sqrt(w) dz/dtheta` (readings x parameters) and `sqrt(w) r`, for the predictions `z` of all
/// channels.
pub fn weighted_jacobian(
    problem: &Problem,
    evaluation: &Evaluation,
) -> (DMatrix<f64>, DVector<f64>) {
    let Residuals { roots, weighted } = Residuals::at(problem, evaluation);
    let mut jacobian = problem.predictions_jacobian(evaluation);
    for mut column in jacobian.column_iter_mut() {
        for (a, root) in column.iter_mut().zip(&roots) {
            *a *= root;
        }
    }
    (jacobian, DVector::from_vec(weighted))
}
