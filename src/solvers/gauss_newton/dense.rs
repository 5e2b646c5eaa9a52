//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use super::triangle::Triangle;
use crate::lanes::sum::dot;
use crate::objective::{Evaluation, Gradient};
use crate::problem::Problem;
use crate::qp::Subproblem;
use nalgebra::{DMatrix, DVector};

/// The linearised predictions, and how their residuals are weighed.
#[derive(Clone)]
pub struct Linearised {
    /// `dz/dtheta` (readings x parameters), for the predictions `z` of all channels.
    jacobian: DMatrix<f64>,
    /// `sqrt(w)`.
    roots: Vec<f64>,
    /// `sqrt(w) r`.
    residuals: Vec<f64>,
}

impl Linearised {
    /// At an evaluated point: one tangent solve for each parameter.
    pub fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let nowhere = Self {
            jacobian: DMatrix::zeros(0, 0),
            roots: Vec::with_capacity(problem.reading_count()),
            residuals: Vec::with_capacity(problem.reading_count()),
        };
        nowhere.moved_to(problem, evaluation)
    }

    /// At another point, in the same storage: page for page new memory would take as long as filling it.
    pub fn moved_to(self, problem: &Problem, evaluation: &Evaluation) -> Self {
        let Self {
            jacobian,
            mut roots,
            mut residuals,
        } = self;
        roots.clear();
        residuals.clear();
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
                let weighted = channel.residuals(predicted).zip(&roots[first..]);
                residuals.extend(weighted.map(|(r, root)| root * r));
            }
        }
        Self {
            jacobian: problem.predictions_jacobian_in(evaluation, jacobian),
            roots,
            residuals,
        }
    }

    /// `2 A' W r` and the penalties' part: the gradient of the cost from what is known here, without an
    /// adjoint solve. `None` where that leaves the finite numbers.
    pub fn gradient(&self, problem: &Problem, theta: &[f64]) -> Option<Gradient> {
        let weighted: Vec<f64> = (self.residuals.iter().zip(&self.roots))
            .map(|(r, root)| 2.0 * root * r)
            .collect();
        let columns = self.jacobian.as_slice().chunks_exact(weighted.len().max(1));
        let misfit: Vec<f64> = columns.map(|column| dot(column, &weighted)).collect();
        let finite = misfit.len() == theta.len() && misfit.iter().all(|g| g.is_finite());
        finite.then(|| problem.gradient_from_misfit(theta, misfit))
    }

    /// The subproblem in `delta theta`: `|R delta - b|^2` with the triangular factor `R` of the weighted
    /// Jacobian, and the rest of the residuals as a row of its own.
    pub fn subproblem(&self) -> Subproblem {
        let n = self.jacobian.ncols();
        let mut sub = Subproblem::new(n);
        if self.jacobian.nrows() <= n {
            let (jacobian, residuals) = self.clone().weighted();
            for (row, r) in jacobian.row_iter().zip(&residuals) {
                let entries = row.iter().copied().enumerate().filter(|(_, a)| *a != 0.0);
                sub.residuals.push(entries, -r);
            }
            sub.residuals.push([], 0.0);
            return sub;
        }
        let triangle = Triangle::of(&self.jacobian, &self.roots, &self.residuals);
        for (entries, b) in triangle.rows() {
            sub.residuals.push(entries, -b);
        }
        // What no step can change, so that the subproblem's value is the whole linearised cost.
        sub.residuals.push([], triangle.rest());
        sub
    }

    /// `sqrt(w) dz/dtheta` and `sqrt(w) r`.
    fn weighted(mut self) -> (DMatrix<f64>, DVector<f64>) {
        for mut column in self.jacobian.column_iter_mut() {
            for (a, root) in column.iter_mut().zip(&self.roots) {
                *a *= root;
            }
        }
        (self.jacobian, DVector::from_vec(self.residuals))
    }
}

/// `sqrt(w) dz/dtheta` (readings x parameters) and `sqrt(w) r`, for the predictions `z` of all
/// channels.
pub fn weighted_jacobian(
    problem: &Problem,
    evaluation: &Evaluation,
) -> (DMatrix<f64>, DVector<f64>) {
    Linearised::at(problem, evaluation).weighted()
}
