//! Refits of both models to simulated samples, by their linearisation.

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
    /// Orthonormal columns that span what each model can do: constant, varying.
    spans: [DMatrix<f64>; 2],
    /// Root weight times sigma of each sample.
    noise: Vec<f64>,
    /// What penalties and priors ask for.
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

    /// Least costs of both models for simulated samples `index`.
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

/// An orthonormal basis of the columns' span; columns are first scaled to size 1, for parameters have
/// units.
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
