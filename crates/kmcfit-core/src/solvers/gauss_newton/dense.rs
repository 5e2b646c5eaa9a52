//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use crate::objective::{Channel, Evaluation};
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::simd::LANES;
use crate::simd::tall_qr::{PIECE, Piece, Triangle};
use crate::solvers::{Timings, timed};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use std::time::{Duration, Instant};

/// How the residuals of the readings of all channels are weighed.
#[derive(Clone)]
struct Residuals {
    /// `sqrt(w)`.
    roots: Vec<f64>,
    /// `sqrt(w) r`.
    weighted: Vec<f64>,
}

impl Residuals {
    /// At an evaluated point.
    fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let mut all = Self::with_capacity(problem.reading_count());
        for (experiment, predictions) in problem.experiments.iter().zip(&evaluation.predictions) {
            for (channel, predicted) in experiment.channels.iter().zip(predictions) {
                all.push(channel, predicted, 0..channel.len());
            }
        }
        all
    }

    fn with_capacity(readings: usize) -> Self {
        Self {
            roots: Vec::with_capacity(readings),
            weighted: Vec::with_capacity(readings),
        }
    }

    fn clear(&mut self) {
        self.roots.clear();
        self.weighted.clear();
    }

    /// Adds some readings of a channel.
    fn push(&mut self, channel: &Channel, predicted: &[f64], readings: Range<usize>) {
        let Self { roots, weighted } = self;
        let first = roots.len();
        let residuals = || channel.residuals_of(predicted, readings.clone());
        match channel.uniform_weights() {
            Some([inner, ends]) => {
                roots.resize(first + readings.len(), inner.sqrt());
                for end in [0, channel.len() - 1] {
                    if readings.contains(&end) {
                        roots[first + end - readings.start] = ends.sqrt();
                    }
                }
            }
            None => {
                let each = readings.clone().zip(residuals());
                roots.extend(each.map(|(i, r)| channel.weight(i, r).sqrt()));
            }
        }
        let pairs = residuals().zip(&roots[first..]);
        weighted.extend(pairs.map(|(r, root)| root * r));
    }
}

/// Whether the reduction of rows with so many columns takes much longer than a look at the clock, and than to hand
/// them to another thread.
pub(crate) fn is_wide(columns: usize) -> bool {
    columns > LANES
}

/// The readings, linearised and reduced to as many rows as there are parameters:
/// `|R delta + b|^2 + rest^2`, with the triangular factor `R` of the weighted Jacobian.
#[derive(Clone)]
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
    pub fn at(problem: &Problem, evaluation: &Evaluation, timings: &mut Timings) -> Self {
        let clock = Instant::now();
        if let Some(halfway) = halfway(problem) {
            let first = Half::first(problem, evaluation, halfway);
            let second = Half::second(problem, evaluation, halfway);
            timings.tangent += clock.elapsed();
            return first.join(&second);
        }
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

    /// The same Jacobian at a point nearby, where the misfit, a sum of squares, and its gradient are known; `None` if it
    /// cannot be the Jacobian there.
    pub fn nearby(self, misfit: f64, gradient: &[f64]) -> Option<Self> {
        let products: Vec<f64> = self.order.iter().map(|j| 0.5 * gradient[*j]).collect();
        let triangle = self.triangle.beside(&products, misfit)?;
        Some(Self { triangle, ..self })
    }

    /// The step to the minimum, less the sign, in the order of the columns.
    #[cfg(test)]
    pub fn solution(&self) -> Option<Vec<f64>> {
        self.triangle.solve(1e-14)
    }

    /// The gradient of the misfit; `None` where a number has left its range.
    pub fn misfit_gradient(&self) -> Option<Vec<f64>> {
        let mut gradient = vec![0.0; self.order.len()];
        for (product, j) in self.triangle.products().into_iter().zip(&self.order) {
            gradient[*j] = 2.0 * product;
        }
        let is_finite = self.triangle.is_finite() && gradient.iter().all(|g| g.is_finite());
        is_finite.then_some(gradient)
    }
}

/// Where a problem's record is cut into halves that are linearised and reduced each by itself, which two threads can do at
/// once: in the middle of a long record with few parameters. Nothing more is needed for the discrete gradient.
pub(crate) fn halfway(problem: &Problem) -> Option<usize> {
    let is_narrow = !is_wide(problem.parameters()) && Reduced::comes_in_pieces(problem);
    problem.middle().filter(|_| is_narrow)
}

/// The readings of one half of a record, linearised and reduced.
pub(crate) struct Half {
    triangle: Triangle,
    /// The parameter of each column.
    order: Vec<usize>,
    /// How the state at its end answers to each parameter, in the order of the columns.
    states: Vec<[f64; 2]>,
}

impl Half {
    /// The one before the step `halfway`.
    pub fn first(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        Self::of(problem, evaluation, 0..halfway, problem.parameters())
    }

    /// The one from the step `halfway` on. The state that it sets out from has columns of its own.
    pub fn second(problem: &Problem, evaluation: &Evaluation, halfway: usize) -> Self {
        let steps = halfway..problem.experiments[0].nodes - 1;
        Self::of(problem, evaluation, steps, problem.parameters() + 2)
    }

    fn of(problem: &Problem, evaluation: &Evaluation, steps: Range<usize>, columns: usize) -> Self {
        let order = problem.places();
        let experiment = &problem.experiments[0];
        let mut triangle = Triangle::new(columns);
        let mut residuals = Residuals::with_capacity(PIECE);
        let states = problem.each_piece_of_part(evaluation, &order, steps, |mut piece| {
            // All rows of a piece are of one channel.
            let mut first = piece.first;
            let mut of = experiment.channels.iter().zip(&evaluation.predictions[0]);
            let channel = of.find(|(channel, _)| match first.checked_sub(channel.len()) {
                Some(rest) => {
                    first = rest;
                    false
                }
                None => true,
            });
            if let Some((channel, predicted)) = channel {
                residuals.clear();
                residuals.push(channel, predicted, first..first + piece.count);
                triangle.add_weighted(&mut piece, &residuals.roots, &residuals.weighted);
            }
            piece
        });
        Self {
            triangle,
            order,
            states,
        }
    }

    /// Both halves as one: the second sets out from the state at the end of the first.
    pub fn join(self, second: &Half) -> Reduced {
        let mut triangle = self.triangle;
        triangle.join(&second.triangle, &self.states);
        Reduced {
            triangle,
            order: self.order,
            residuals: Residuals::with_capacity(0),
            took: Duration::ZERO,
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Grid;
    use crate::objective::Weighting;

    /// The squares of the weighted residuals are the cost, in which the readings at both ends count half; some readings
    /// at a time are the same.
    #[test]
    fn weighted_residuals() {
        let grid = Grid::new(0.0, 1.0, 11).expect("a grid");
        let spacing = grid.step();
        let readings = (0..11).map(|i| f64::from(i).sin()).collect();
        let weighting = Weighting::Integral { spacing };
        let channel = Channel::displacement_at_nodes(readings, 1, weighting, &grid);
        let predicted: Vec<f64> = (0..11).map(|i| 2.0 - f64::from(i)).collect();
        let mut whole = Residuals::with_capacity(11);
        whole.push(&channel, &predicted, 0..11);
        let squares: f64 = whole.weighted.iter().map(|r| r * r).sum();
        let cost = channel.cost(&predicted);
        assert!((squares - cost).abs() <= 1e-14 * cost, "{squares} {cost}");
        let mut parts = Residuals::with_capacity(11);
        for readings in [0..1, 1..6, 6..10, 10..11] {
            parts.push(&channel, &predicted, readings);
        }
        assert_eq!(parts.weighted, whole.weighted);
        assert_eq!(parts.roots, whole.roots);
    }
}
