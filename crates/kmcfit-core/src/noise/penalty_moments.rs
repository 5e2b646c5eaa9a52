//! Penalties with estimated weights, in the restricted likelihood.
//!
//! At the maximum of the likelihood in the weight `w_j` of `|L_j b|^2`, with the Hessian `H` of half the penalised squares,
//!
//! ```text
//! w_j |L_j b|^2 = rank(L_j) - w_j tr(H^-1 L_j^T L_j)
//! ```
//!
//! The right-hand side over the squares is the next weight (Fellner 1986, Schall 1991; Wood and Fasiolo 2017). The likelihood rises
//! with every step. It has no maximum where the data require no roughness: the weight then stays at a value that leaves the
//! function no freedom beyond the null space of the penalty.

use nalgebra::{DMatrix, DVector};

/// Largest number of steps in the weights.
const STEPS: usize = 200;
/// Change of the logarithm of a weight below which the steps end; Newton steps follow.
const SETTLED: f64 = 1e-3;
/// Effective number of parameters beyond the null space of a penalty below which its weight counts as infinite.
const NO_FREEDOM: f64 = 0.01;
/// Largest change of the logarithm of a weight by one step.
const LONGEST: f64 = 5.0;

/// A penalty in the combinations of parameters of the likelihood.
#[derive(Debug, Clone)]
pub struct PenaltyMoments {
    /// Gram matrix of the rows `L` and, in the last column, their residuals, without the weight.
    pub gram: DMatrix<f64>,
    /// Rank of `L`.
    pub rank: usize,
    /// Logarithm of the weight at the start.
    pub log_weight: f64,
}

impl PenaltyMoments {
    /// Moves the weights to the largest likelihood, for the Gram matrix `others` of all other rows; each penalty with true where
    /// its weight is finite.
    pub(super) fn start<'a>(
        penalties: &'a mut [Self],
        others: &DMatrix<f64>,
    ) -> Vec<(&'a Self, bool)> {
        let mut is_finite = vec![true; penalties.len()];
        for _ in 0..STEPS {
            let Some(terms) = terms(penalties, others) else {
                break;
            };
            let mut largest = 0.0f64;
            for (i, ([freedom, squares], penalty)) in terms.iter().zip(&mut *penalties).enumerate()
            {
                let change = (freedom / squares).ln().clamp(-LONGEST, LONGEST);
                is_finite[i] = *freedom > NO_FREEDOM || change < 0.0;
                if is_finite[i] {
                    penalty.log_weight += change;
                    largest = largest.max(change.abs());
                }
            }
            if largest < SETTLED {
                break;
            }
        }
        penalties.iter().zip(is_finite).collect()
    }
}

/// `rank(L_j) - w_j tr(H^-1 L_j^T L_j)` and `w_j |L_j b|^2` of each penalty at its weight; `None` where the Hessian is singular.
fn terms(penalties: &[PenaltyMoments], others: &DMatrix<f64>) -> Option<Vec<[f64; 2]>> {
    let mut gram = others.clone();
    for penalty in penalties {
        gram += &penalty.gram * penalty.log_weight.exp();
    }
    let q = gram.nrows() - 1;
    let hessian = gram.view((0, 0), (q, q)).into_owned().cholesky()?;
    let change = -hessian.solve(&gram.view((0, q), (q, 1)).into_owned());
    let inverse = hessian.inverse();
    let extended = DVector::from_fn(q + 1, |i, _| if i < q { change[i] } else { 1.0 });
    let each = penalties.iter().map(|penalty| {
        let weight = penalty.log_weight.exp();
        let own = penalty.gram.view((0, 0), (q, q));
        let freedom = penalty.rank as f64 - weight * inverse.dot(&own);
        let squares = weight * extended.dot(&(&penalty.gram * &extended));
        [freedom, squares].map(|x| x.max(f64::MIN_POSITIVE))
    });
    Some(each.collect())
}
