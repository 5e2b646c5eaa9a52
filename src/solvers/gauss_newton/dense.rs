//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use nalgebra::{DMatrix, DVector};

/// The subproblem in `delta theta`: `|R delta - b|^2` with the triangular factor `R` of the weighted
/// Jacobian `sqrt(w) dz/dtheta`, and the rest of the residuals as a row of its own. Both are those of
/// [`weighted_jacobian`].
pub fn subproblem(jacobian: DMatrix<f64>, residuals: DVector<f64>) -> Subproblem {
    let n = jacobian.ncols();
    let mut sub = Subproblem::new(n);
    let rows = jacobian.nrows();
    let (r, b) = if rows > n {
        let qr = jacobian.qr();
        let mut rotated = residuals;
        qr.q_tr_mul(&mut rotated);
        (qr.r(), rotated)
    } else {
        (jacobian, residuals)
    };
    for i in 0..r.nrows() {
        let row = (0..n).map(|j| (j, r[(i, j)])).filter(|(_, a)| *a != 0.0);
        sub.residuals.push(row, -b[i]);
    }
    // What no step can change, so that the subproblem's value is the whole linearised cost.
    let rest = b.rows_range(r.nrows()..).norm();
    sub.residuals.push([], rest);
    sub
}

/// `sqrt(w) dz/dtheta` (readings x parameters) and `sqrt(w) r`, for the predictions `z` of all
/// channels.
pub fn weighted_jacobian(
    problem: &Problem,
    evaluation: &Evaluation,
) -> (DMatrix<f64>, DVector<f64>) {
    let n = problem.parameters();
    let mut roots = Vec::with_capacity(problem.reading_count());
    let mut residuals = Vec::with_capacity(problem.reading_count());
    for (experiment, predictions) in problem.experiments.iter().zip(&evaluation.predictions) {
        for (channel, predicted) in experiment.channels.iter().zip(predictions) {
            for (i, r) in channel.residuals(predicted).enumerate() {
                let root = channel.weight(i, r).sqrt();
                roots.push(root);
                residuals.push(root * r);
            }
        }
    }
    let mut jacobian = DMatrix::zeros(residuals.len(), n);
    let mut unit = vec![0.0; n];
    for j in 0..n {
        unit[j] = 1.0;
        let changes = problem.predictions_tangent(evaluation, &unit);
        unit[j] = 0.0;
        let all = changes.iter().flatten().flatten();
        for (row, (change, root)) in all.zip(&roots).enumerate() {
            jacobian[(row, j)] = root * change;
        }
    }
    (jacobian, DVector::from_vec(residuals))
}
