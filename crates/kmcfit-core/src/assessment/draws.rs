//! Draws from the distribution of the estimates.
//!
//! Parameters are normally distributed about the estimates with their covariance, or by Student's t distribution where sigma is estimated from
//! few samples, and draws that violate a constraint are repeated. Every draw gives the estimates of the record; the error of
//! interpolation between knots is not included.

use super::estimates::{Estimate, estimates_at};
use crate::identifiability::Bands;
use crate::problem::Problem;
use crate::solvers::Fit;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

/// Largest mean number of attempts for a draw that satisfies the constraints.
const ATTEMPTS: usize = 1000;
/// Violation of a constraint, relative to its size, that rounding explains.
const TOLERANCE: f64 = 1e-9;

/// Reason why there are no draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoDraws {
    /// The estimates have no covariance.
    NoCovariance,
    /// Fewer than one draw in a thousand satisfies the constraints.
    Constraints,
}

/// One draw: the parameters, and the estimates with their names.
#[derive(Debug, Clone)]
pub struct Draw {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Estimates in the order of `estimates`.
    pub estimates: Vec<(String, Estimate)>,
}

/// `number` draws from the distribution of the estimates of `fit`, by the generator ChaCha8 with this seed.
///
/// # Errors
/// A [`NoDraws`] without a covariance, and where the constraints leave too few draws.
pub fn draws(
    problem: &Problem,
    fit: &Fit,
    bands: &Bands,
    number: usize,
    seed: u64,
) -> Result<Vec<Draw>, NoDraws> {
    let covariance = bands.covariance.as_ref().ok_or(NoDraws::NoCovariance)?;
    let root = root(covariance);
    let least = bands.degrees_of_freedom.iter().copied();
    let degrees = least.fold(f64::INFINITY, f64::min);
    let chi_squared = ChiSquared::new(degrees)
        .ok()
        .filter(|_| degrees.is_finite());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let centre = DVector::from_column_slice(&fit.best.parameters);
    let mut draws = Vec::new();
    let mut attempts = 0;
    while draws.len() < number {
        attempts += 1;
        if attempts > ATTEMPTS * number {
            return Err(NoDraws::Constraints);
        }
        let normal = DVector::from_fn(root.ncols(), |_, _| StandardNormal.sample(&mut random));
        let scale: f64 = match &chi_squared {
            Some(distribution) => (degrees / distribution.sample(&mut random)).sqrt(),
            None => 1.0,
        };
        let parameters = &centre + &root * normal * scale;
        let parameters = parameters.as_slice().to_vec();
        if !problem.constraints.hold(&parameters, TOLERANCE) {
            continue;
        }
        let nodal = problem.functions.nodal(&parameters);
        draws.push(Draw {
            estimates: estimates_at(problem, &parameters, &nodal, None),
            parameters,
        });
    }
    Ok(draws)
}

/// A root `R` of a covariance, `C = R R^T`, from the eigenvalues of the correlation matrix, of which rounding may make some negative.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let sizes: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt()).collect();
    let correlation =
        DMatrix::from_fn(sizes.len(), sizes.len(), |i, j| match sizes[i] * sizes[j] {
            size if size > 0.0 => covariance[(i, j)] / size,
            _ => 0.0,
        });
    let eigen = correlation.symmetric_eigen();
    DMatrix::from_fn(sizes.len(), sizes.len(), |i, j| {
        sizes[i] * eigen.eigenvectors[(i, j)] * eigen.eigenvalues[j].max(0.0).sqrt()
    })
}
