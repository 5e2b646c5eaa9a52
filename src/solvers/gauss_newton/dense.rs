//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use super::triangle::Triangle;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use nalgebra::{DMatrix, DVector};

/// The linearised predictions, and how their residuals are weighed.
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
        let mut roots = Vec::with_capacity(problem.reading_count());
        let mut residuals = Vec::with_capacity(problem.reading_count());
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
            jacobian: problem.predictions_jacobian(evaluation),
            roots,
            residuals,
        }
    }

    /// The subproblem in `delta theta`: `|R delta - b|^2` with the triangular factor `R` of the weighted
    /// Jacobian, and the rest of the residuals as a row of its own.
    pub fn subproblem(self) -> Subproblem {
        let n = self.jacobian.ncols();
        let mut sub = Subproblem::new(n);
        // All at once.
        sub.stations = vec![0; n];
        if self.jacobian.nrows() <= n {
            let (jacobian, residuals) = self.weighted();
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
