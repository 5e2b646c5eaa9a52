//! Banded factor of the normal matrix, and covariances of combinations of the variables from it.
//!
//! The rows of the factor in the order of elimination, each divided by its weight, are independent errors of unit variance, those of the
//! equalities are zero. With the factor `R` and the diagonal `D` of ones and zeros the covariance of the minimiser is
//!
//! ```text
//! C = R^-1 D R^-T,    g^T C g = |D R^-T g|^2
//! ```
//!
//! for unit errors of all residuals.

use super::triangular_rows::TriangularRows;
use super::{Chain, Front};
use crate::qp::Subproblem;

/// Factor of `F^T F` on the null space of the equalities, in the elimination order of a [`Subproblem`].
#[derive(Debug, Clone)]
pub struct BandedFactor {
    rows: TriangularRows,
    /// VariableRole of each variable.
    positions: Vec<u32>,
}

impl BandedFactor {
    /// Factor of the residual rows of `sub` with its equalities; absolute values, inequalities and cones are ignored. `None` without an
    /// elimination order, with too wide fronts, and where the rows do not determine all variables.
    pub fn of(sub: &Subproblem) -> Option<Self> {
        let chain = Chain::of(sub)?;
        let mut rows = TriangularRows::new(sub.variables, 0);
        let mut front = Front::new(sub.variables, 0);
        for block in 0..chain.blocks() {
            chain.assemble(block, &mut front, &[]);
            front.eliminate(&mut rows)?;
        }
        Some(Self {
            rows,
            positions: chain.positions,
        })
    }

    /// `C g` for the combination of the variables with these entries, and its variance `g^T C g`.
    pub fn times(&self, entries: &[(usize, f64)]) -> (Vec<f64>, f64) {
        let at_places = entries
            .iter()
            .map(|(j, a)| (self.positions[*j] as usize, *a));
        let mut errors = self.rows.substitute_transposed(at_places);
        for (i, error) in errors.iter_mut().enumerate() {
            if self.rows.is_exact(i) {
                *error = 0.0;
            }
        }
        let variance = errors.iter().map(|y| y * y).sum();
        let by_place = self.rows.substitute_right(&errors);
        let by_variable = self
            .positions
            .iter()
            .map(|position| by_place[*position as usize]);
        (by_variable.collect(), variance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// A chain of 40 variables in 20 blocks with random rows between neighbours, and equalities between every third pair of blocks.
    fn example() -> Subproblem {
        let mut sub = Subproblem::new(40);
        sub.elimination_order = (0..40).map(|j| j / 2).collect();
        let mut state = 1u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(99);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        for j in 0..40usize {
            for _ in 0..2 {
                let row: Vec<(usize, f64)> =
                    (j..40.min(j + 3)).map(|other| (other, random())).collect();
                sub.residuals.push(row, 0.0);
            }
            if j % 6 == 0 && j + 2 < 40 {
                sub.equalities.push([(j, 1.0), (j + 2, random())], 0.0);
            }
        }
        sub
    }

    /// `C = N (N^T F^T F N)^-1 N^T` with a basis `N` of the null space of the equalities, by dense decompositions.
    fn dense(sub: &Subproblem) -> DMatrix<f64> {
        let matrix = |rows: &crate::rows::Rows| {
            let mut out = DMatrix::zeros(rows.len(), sub.variables);
            for i in 0..rows.len() {
                rows.row(i).for_each(|(j, a)| out[(i, j)] += a);
            }
            out
        };
        let (f, e) = (matrix(&sub.residuals), matrix(&sub.equalities));
        let squares: DMatrix<f64> = e.transpose() * &e;
        let eigen = squares.symmetric_eigen();
        let null: Vec<nalgebra::DVector<f64>> = (0..sub.variables)
            .filter(|k| eigen.eigenvalues[*k].abs() < 1e-9)
            .map(|k| eigen.eigenvectors.column(k).into_owned())
            .collect();
        let null = DMatrix::from_columns(&null);
        let reduced = &f * &null;
        let inverse = (reduced.transpose() * reduced).try_inverse().unwrap();
        &null * inverse * null.transpose()
    }

    #[test]
    fn covariances_are_those_of_a_dense_decomposition() {
        let sub = example();
        let factor = BandedFactor::of(&sub).unwrap();
        let dense = dense(&sub);
        let scale = dense.diagonal().amax();
        let entries = [(3, 1.0), (17, -2.0), (38, 0.5)];
        let (product, variance) = factor.times(&entries);
        let mut g = nalgebra::DVector::zeros(40);
        entries.iter().for_each(|(j, a)| g[*j] = *a);
        let expected = &dense * &g;
        for (a, b) in product.iter().zip(expected.iter()) {
            assert!((a - b).abs() < 1e-9 * scale);
        }
        assert!((variance - g.dot(&expected)).abs() < 1e-9 * scale);
    }
}
