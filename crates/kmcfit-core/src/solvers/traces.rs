//! Traces of the matrix that maps the right-hand sides of linearised rows to their fitted values: effective numbers of
//! parameters of samples and penalties, estimated with random signs (Hutchinson).

use super::fit::Fit;
use super::linearization::{Linearization, linearise};
use super::timings::{Timings, timed};
use crate::identifiability::Factorisation;
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::rows::Rows;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// Number of random vectors of a trace; its error is about `sqrt(2 trace / 16)`.
const PROBES: usize = 16;
/// Seed of those vectors.
pub(super) const SEED: u64 = 1;

/// Linearised rows at the optimum of a fit: samples, then penalties.
pub(super) struct Traces {
    subproblem: Subproblem,
    samples: usize,
}

impl Traces {
    pub fn at(problem: &Problem, found: &Fit, timings: &mut Timings) -> Self {
        let (parameters, evaluation) = (&found.best.parameters, &found.best.evaluation);
        let fresh = Linearization::Fresh;
        let (mut subproblem, samples) = linearise(problem, parameters, evaluation, &fresh, timings);
        // The linearisation at the end has no proximal term.
        subproblem.proximal.fill(0.0);
        Self {
            subproblem,
            samples,
        }
    }

    /// Squared residuals of the samples and of each penalty at the minimum of the linearised rows, without inequalities; `None` where
    /// the Hessian is singular.
    pub fn squares(&self, problem: &Problem, timings: &mut Timings) -> Option<(f64, Vec<f64>)> {
        let rows = &self.subproblem.residuals;
        let minimum = timed(&mut timings.linear_algebra, || {
            self.subproblem
                .solve_equality_constrained_for(&[rows.right().to_vec()])
        });
        let fitted = rows.multiply(&minimum?.pop()?);
        let squares = |block: Range<usize>| {
            let pairs = fitted[block.clone()].iter().zip(&rows.right()[block]);
            pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
        };
        let mut first = self.samples;
        let penalties = problem.penalties.iter().map(|penalty| {
            let block = first..first + penalty.rows.len();
            first = block.end;
            squares(block)
        });
        Some((squares(0..self.samples), penalties.collect()))
    }

    /// Effective number of parameters that the samples determine; `None` where the Hessian is singular.
    pub fn of_samples(&self, timings: &mut Timings) -> Option<f64> {
        let block = 0..self.samples;
        let probes = signs(block.len());
        self.explained(&block, &probes, timings)
    }

    /// Effective number of parameters beyond the null space of the penalty `index`, `rank(L) - w tr(H^-1 L^T L)`; `None` where the
    /// Hessian is singular. The vectors are projected onto the range of `L`: the variance then falls with the number itself.
    pub fn freedom(&self, problem: &Problem, index: usize, timings: &mut Timings) -> Option<f64> {
        let before = problem.penalties[..index].iter().map(|p| p.rows.len());
        let first = self.samples + before.sum::<usize>();
        let penalty = &problem.penalties[index];
        let block = first..first + penalty.rows.len();
        let parameters = problem.functions.ranges()[penalty.function].len();
        let mut probes = signs(block.len());
        if block.len() > parameters.saturating_sub(penalty.order) {
            onto_range(&penalty.rows, parameters, &mut probes);
        }
        let size: f64 = probes.iter().flatten().map(|z| z * z).sum();
        let explained = self.explained(&block, &probes, timings)?;
        Some(size / PROBES as f64 - explained)
    }

    /// Mean of `z^T S z` over vectors `z` on the rows `block`, with the matrix `S` of the fitted values.
    fn explained(
        &self,
        block: &Range<usize>,
        probes: &[Vec<f64>],
        timings: &mut Timings,
    ) -> Option<f64> {
        let mut homogeneous = self.subproblem.clone();
        homogeneous.homogeneous();
        let rows = homogeneous.residuals.len();
        let targets: Vec<Vec<f64>> = (probes.iter())
            .map(|probe| {
                let mut target = vec![0.0; rows];
                target[block.clone()].copy_from_slice(probe);
                target
            })
            .collect();
        let solutions = timed(&mut timings.linear_algebra, || {
            homogeneous.solve_equality_constrained_for(&targets)
        })?;
        let products = solutions.iter().zip(probes).map(|(z, probe)| {
            let fitted = homogeneous.residuals.multiply(z);
            let pairs = fitted[block.clone()].iter().zip(probe);
            pairs.map(|(a, b)| a * b).sum::<f64>()
        });
        Some(products.sum::<f64>() / probes.len() as f64)
    }
}

/// Vectors of random signs.
fn signs(length: usize) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut sign = || if random.random_bool(0.5) { 1.0 } else { -1.0 };
    (0..PROBES)
        .map(|_| (0..length).map(|_| sign()).collect())
        .collect()
}

/// Projects vectors onto the range of the matrix `rows` with this number of columns.
fn onto_range(rows: &Rows, columns: usize, vectors: &mut [Vec<f64>]) {
    let mut matrix = DMatrix::zeros(columns, rows.len());
    for i in 0..rows.len() {
        rows.row(i).for_each(|(j, a)| matrix[(j, i)] = a);
    }
    let factorisation = Factorisation::of(&matrix);
    let range = factorisation.determined();
    for vector in vectors {
        let inside = range * range.tr_mul(&DVector::from_column_slice(vector));
        vector.copy_from_slice(inside.as_slice());
    }
}
