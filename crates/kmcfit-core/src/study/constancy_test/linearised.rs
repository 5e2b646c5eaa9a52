//! Least costs of the constant and the varying model for simulated samples, from one linearisation at the constant optimum.
//!
//! With orthonormal columns `Q` of the weighted Jacobian, extended by the rows of penalties and priors, the least cost for
//! a right-hand side `r` is `|r - Q Q^T r|^2`.

use super::reduced::ConstantModel;
use crate::identifiability::Factorisation;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::solvers::{add_penalties, add_priors, weighted_jacobian};
use crate::study::simulate::{normal, sigmas, stream};
use nalgebra::{DMatrix, DVector};

/// Both models, linearised at the constant optimum.
pub struct LinearisedModels {
    /// `Q` of the constant and of the varying model.
    spans: [DMatrix<f64>; 2],
    /// Root weight times sigma of each sample, dimensionless.
    noise: Vec<f64>,
    /// Right-hand sides of the rows of penalties and priors.
    asked: Vec<f64>,
}

impl LinearisedModels {
    pub fn new(
        problem: &Problem,
        reduced: &ConstantModel,
        theta: &[f64],
        here: &Evaluation,
    ) -> Self {
        let jacobian = weighted_jacobian(problem, here);
        let n = theta.len();
        let mut rest = Subproblem::new(n);
        add_penalties(problem, theta, &mut rest);
        add_priors(problem, theta, &mut rest);
        let rest = rest.residuals;
        let samples = jacobian.nrows();
        let mut varying = jacobian.resize_vertically(samples + rest.len(), 0.0);
        for i in 0..rest.len() {
            (rest.row(i)).for_each(|(j, a)| varying[(samples + i, j)] += a);
        }
        let mut embedding = DMatrix::zeros(n, reduced.problem.parameters());
        for j in 0..n {
            let (column, a) = reduced.column(j, 1.0);
            embedding[(j, column)] = a;
        }
        let constant = &varying * embedding;
        let sigmas = sigmas(&reduced.problem, here);
        let roots = problem
            .channels()
            .flat_map(|c| (0..c.len()).map(|i| c.weighting().weight(i, c.len()).sqrt()));
        Self {
            spans: [span(constant), span(varying)],
            noise: roots
                .zip(&sigmas)
                .map(|(root, sigma)| root * sigma)
                .collect(),
            asked: rest.right().to_vec(),
        }
    }

    /// Least costs of the constant and the varying model for simulated samples `index`.
    pub fn costs(&self, seed: u64, index: usize) -> [f64; 2] {
        let mut random = stream(seed, index);
        let unit = normal(&mut random, self.noise.len());
        let errors = unit.iter().zip(&self.noise).map(|(u, s)| u * s);
        let right: Vec<f64> = errors.chain(self.asked.iter().copied()).collect();
        let right = DVector::from_vec(right);
        let cost = |span: &DMatrix<f64>| {
            let inside = span * span.tr_mul(&right);
            (&right - inside).norm_squared()
        };
        [cost(&self.spans[0]), cost(&self.spans[1])]
    }
}

/// Orthonormal basis of the span of the columns. Columns are first scaled to unit length, because parameters have
/// different units.
fn span(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in matrix.column_iter_mut() {
        let size = column.norm();
        if size > 0.0 {
            column /= size;
        }
    }
    // The right singular vectors of the transpose are the left ones.
    let factorisation = Factorisation::of(&matrix.transpose());
    factorisation.determined().into_owned()
}
