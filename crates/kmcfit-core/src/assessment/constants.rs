//! Wald test of a constant against a varying function.

use crate::functions::Basis;
use crate::problem::Problem;
use crate::record::{Channel, Loss, Weighting};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// p-value of the Wald test of function `f` against a constant: the probability that noise alone causes at least the variation
/// found. With the parameters `p`, their `covariance` `C` and the parameters `e` of the constant 1, `min_a (p - a e)' C^-1 (p - a e)` has
/// a chi-square distribution with one degree of freedom less than there are parameters; divided by that number, an F
/// distribution where the noise is estimated from the residuals. A penalised function with `effective` parameters counts as having
/// that many, rounded: `C` is inverted on as many of its directions of largest variance less one (Wood 2013). `None` for a function whose basis contains no constant, or
/// nothing else, for one whose jumps were found in the same samples, and under a robust loss, which has another covariance.
pub fn constant_probability(
    problem: &Problem,
    f: usize,
    theta: &[f64],
    covariance: &DMatrix<f64>,
    effective: Option<f64>,
) -> Option<f64> {
    let function = problem.functions.get(f);
    let range = problem.functions.ranges()[f].clone();
    let n = range.len();
    let one = match function.basis.as_ref()? {
        Basis::Constant => return None,
        Basis::Polynomial { .. } => DVector::from_fn(n, |i, _| f64::from(i == 0)),
        Basis::Nodal
        | Basis::PiecewiseConstant { .. }
        | Basis::PiecewiseLinear { .. }
        | Basis::BSpline { .. } => DVector::from_element(n, 1.0),
    };
    let is_robust = problem.channels().any(|c| c.loss() != Loss::Squares);
    let is_found = problem.jumps.iter().any(|jumps| jumps.function == f);
    if is_robust || is_found || function.offset.iter().any(|x| *x != 0.0) {
        return None;
    }
    let block = covariance.view((range.start, range.start), (n, n));
    let values = DVector::from_column_slice(&theta[range]);
    let (distance, degrees) = match effective {
        Some(effective) => distance_of_smooth(block.into_owned(), &values, &one, effective),
        None => {
            let root = block.into_owned().cholesky()?.l();
            let values = root.solve_lower_triangular(&values)?;
            let one = root.solve_lower_triangular(&one)?;
            let along = values.dot(&one) / one.norm_squared();
            (
                (values - one * along).norm_squared(),
                n.checked_sub(1)? as f64,
            )
        }
    };
    let is_given =
        |c: &Channel| matches!(c.weighting(), Weighting::Sigma(_) | Weighting::Sigmas(_));
    let p = match problem.channels().all(is_given) {
        true => ChiSquared::new(degrees).ok()?.sf(distance),
        false => {
            let left = problem.sample_count().checked_sub(problem.parameters())?;
            let law = FisherSnedecor::new(degrees, left as f64).ok()?;
            law.sf(distance / degrees)
        }
    };
    p.is_finite().then_some(p)
}

/// Squared distance of the parameters `values` from constants `a one`, and its degrees of freedom, on the directions of largest
/// variance.
fn distance_of_smooth(
    covariance: DMatrix<f64>,
    values: &DVector<f64>,
    one: &DVector<f64>,
    effective: f64,
) -> (f64, f64) {
    let n = values.len();
    let projection = DMatrix::identity(n, n) - one * one.transpose() / one.norm_squared();
    let eigen = (&projection * covariance * &projection).symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let degrees = (effective.round() - 1.0).clamp(1.0, (n - 1) as f64);
    let squares = order.iter().take(degrees as usize).map(|&k| {
        let part = eigen.eigenvectors.column(k).dot(values);
        part * part / eigen.eigenvalues[k]
    });
    (squares.sum(), degrees)
}
