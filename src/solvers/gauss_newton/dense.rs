//! The Gauss–Newton subproblem from tangent solves, for functions with few parameters.

use crate::dynamics::DeviceTangent;
use crate::dynamics::State;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use nalgebra::{DMatrix, DVector};

/// The subproblem in `delta theta`: `|R delta - b|^2` with the triangular factor `R` of the weighted
/// Jacobian `sqrt(w) dy/dtheta`, and the rest of the residuals as a row of its own.
pub fn subproblem(problem: &Problem, evaluation: &Evaluation) -> Subproblem {
    let n = problem.functions.parameters();
    let (jacobian, residuals) = weighted_jacobian(problem, evaluation);
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

/// `sqrt(w) dy/dtheta` (readings x parameters) and `sqrt(w) r`.
fn weighted_jacobian(problem: &Problem, evaluation: &Evaluation) -> (DMatrix<f64>, DVector<f64>) {
    let n = problem.functions.parameters();
    let residuals: Vec<f64> = (problem.experiments.iter().zip(&evaluation.trajectories))
        .filter_map(|(e, motion)| Some((e.readings.as_ref()?, motion)))
        .flat_map(|(readings, motion)| {
            let all = readings.residuals(&motion.displacement).enumerate();
            all.map(|(i, r)| readings.weight(i).sqrt() * r)
        })
        .collect();
    let mut jacobian = DMatrix::zeros(residuals.len(), n);
    let mut unit = vec![0.0; n];
    for j in 0..n {
        unit[j] = 1.0;
        let direction = DeviceTangent {
            device: problem.functions.direction(&unit),
            initial: State {
                displacement: 0.0,
                velocity: 0.0,
            },
        };
        unit[j] = 0.0;
        let mut row = 0;
        for (experiment, motion) in problem.experiments.iter().zip(&evaluation.trajectories) {
            let Some(readings) = &experiment.readings else {
                continue;
            };
            let change = problem.oscillator.tangent(
                &evaluation.device,
                experiment.force.as_deref(),
                motion,
                &direction,
            );
            // The readings may end before the motion does.
            let seen = change.displacement.iter().step_by(readings.stride());
            for (i, dy) in seen.take(readings.values().len()).enumerate() {
                jacobian[(row, j)] = readings.weight(i).sqrt() * dy;
                row += 1;
            }
        }
    }
    (jacobian, DVector::from_vec(residuals))
}
