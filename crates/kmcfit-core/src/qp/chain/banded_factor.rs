//! Banded factor of the normal matrix, and what is computed from it: variances and covariances of combinations of the variables.
//!
//! The rows of the factor in the order of elimination, each divided by its weight, are independent errors of unit variance, those of the
//! equalities are zero. With the factor `R` and the diagonal `D` of ones and zeros the covariance of the minimiser is
//!
//! ```text
//! C = R^-1 D R^-T,    g^T C g = |D R^-T g|^2
//! ```
//!
//! for unit errors of all residuals. Its diagonal follows by recursion from the last front to the first (Takahashi, Fagan and Chin 1973).

use super::triangular_rows::TriangularRows;
use super::{Chain, Front};
use crate::qp::Subproblem;
use nalgebra::DMatrix;

/// Factor of `F^T F` on the null space of the equalities, in the elimination order of a [`Subproblem`].
#[derive(Debug, Clone)]
pub struct BandedFactor {
    rows: TriangularRows,
    /// Place of each variable.
    places: Vec<u32>,
    fronts: Vec<FrontColumns>,
}

/// Columns of a front and the rows eliminated in it.
#[derive(Debug, Clone)]
struct FrontColumns {
    /// Places of the variables: first those that are eliminated here.
    columns: Vec<u32>,
    own: usize,
    /// One past its last row in the factor.
    end: usize,
}

/// An entry of the factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorEntry {
    /// Row, in the order of elimination.
    pub row: usize,
    /// Variable.
    pub variable: usize,
    /// Value.
    pub value: f64,
    /// True in the row of an equality, which has no error.
    pub is_exact: bool,
}

impl BandedFactor {
    /// Factor of the residual rows of `sub` with its equalities; absolute values, inequalities and cones are ignored. `None` without an
    /// elimination order, with too wide fronts, and where the rows do not determine all variables.
    pub fn of(sub: &Subproblem) -> Option<Self> {
        let chain = Chain::of(sub)?;
        let mut rows = TriangularRows::new(sub.variables, 0);
        let mut front = Front::new(sub.variables, 0);
        let mut fronts = Vec::with_capacity(chain.blocks());
        for block in 0..chain.blocks() {
            chain.assemble(block, &mut front, &[]);
            front.eliminate(&mut rows)?;
            fronts.push(FrontColumns {
                columns: front.columns().to_vec(),
                own: front.own(),
                end: rows.len(),
            });
        }
        Some(Self {
            rows,
            places: chain.places,
            fronts,
        })
    }

    /// `C g` for the combination of the variables with these entries, and its variance `g^T C g`.
    pub fn times(&self, entries: &[(usize, f64)]) -> (Vec<f64>, f64) {
        let at_places = entries.iter().map(|(j, a)| (self.places[*j] as usize, *a));
        let mut errors = self.rows.substitute_transposed(at_places);
        for (i, error) in errors.iter_mut().enumerate() {
            if self.rows.is_exact(i) {
                *error = 0.0;
            }
        }
        let variance = errors.iter().map(|y| y * y).sum();
        let by_place = self.rows.substitute_right(&errors);
        let by_variable = self.places.iter().map(|place| by_place[*place as usize]);
        (by_variable.collect(), variance)
    }

    /// Variances of all variables.
    pub fn variances(&self) -> Vec<f64> {
        let mut by_place = vec![0.0; self.places.len()];
        // Covariance of the columns of the front that follows.
        let mut next: (Vec<u32>, DMatrix<f64>) = (Vec::new(), DMatrix::zeros(0, 0));
        let mut index = vec![0usize; self.places.len()];
        for (b, front) in self.fronts.iter().enumerate().rev() {
            let first = b.checked_sub(1).map_or(0, |before| self.fronts[before].end);
            let n = front.columns.len();
            let mut here = DMatrix::zeros(n, n);
            for (k, place) in next.0.iter().enumerate() {
                index[*place as usize] = k;
            }
            let passed: Vec<usize> = front.columns[front.own..]
                .iter()
                .map(|place| index[*place as usize])
                .collect();
            for (i, from) in passed.iter().enumerate() {
                for (j, other) in passed.iter().enumerate() {
                    here[(front.own + i, front.own + j)] = next.1[(*from, *other)];
                }
            }
            for (k, place) in front.columns.iter().enumerate() {
                index[*place as usize] = k;
            }
            let mut known: Vec<usize> = (front.own..n).collect();
            for row in (first..front.end).rev() {
                let own = self.add_row(row, &index, &known, &mut here);
                known.push(own);
                by_place[front.columns[own] as usize] = here[(own, own)];
            }
            next = (front.columns.clone(), here);
        }
        let by_variable = self.places.iter().map(|place| by_place[*place as usize]);
        by_variable.collect()
    }

    /// Adds the covariances of the variable of `row` with the `known` columns; its column.
    fn add_row(
        &self,
        row: usize,
        index: &[usize],
        known: &[usize],
        covariance: &mut DMatrix<f64>,
    ) -> usize {
        let (place, pivot, others) = self.rows.row(row);
        let own = index[place as usize];
        let mut with_known = vec![0.0; known.len()];
        for (column, a) in others {
            let other = index[column as usize];
            for (sum, k) in with_known.iter_mut().zip(known) {
                *sum -= a * covariance[(other, *k)];
            }
        }
        for (sum, k) in with_known.iter().zip(known) {
            covariance[(own, *k)] = sum / pivot;
            covariance[(*k, own)] = sum / pivot;
        }
        let (_, _, others) = self.rows.row(row);
        let with_others: f64 = others
            .map(|(column, a)| a * covariance[(own, index[column as usize])])
            .sum();
        let error = match self.rows.is_exact(row) {
            true => 0.0,
            false => 1.0 / pivot,
        };
        covariance[(own, own)] = (error - with_others) / pivot;
        own
    }

    /// All entries, row by row in the order of elimination; the variable that a row determines comes first.
    pub fn entries(&self) -> impl Iterator<Item = FactorEntry> + '_ {
        let mut variables = vec![0usize; self.places.len()];
        for (j, place) in self.places.iter().enumerate() {
            variables[*place as usize] = j;
        }
        (0..self.rows.len()).flat_map(move |i| {
            let (place, pivot, others) = self.rows.row(i);
            let entry = |(place, value): (u32, f64)| FactorEntry {
                row: i,
                variable: variables[place as usize],
                value,
                is_exact: self.rows.is_exact(i),
            };
            let all = std::iter::once((place, pivot)).chain(others).map(entry);
            all.collect::<Vec<_>>()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for (j, variance) in factor.variances().iter().enumerate() {
            assert!((variance - dense[(j, j)]).abs() < 1e-9 * scale, "{j}");
        }
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

    #[test]
    fn the_entries_are_a_triangular_factor() {
        let sub = example();
        let factor = BandedFactor::of(&sub).unwrap();
        let mut matrix = DMatrix::zeros(40, 40);
        let mut errors = DMatrix::identity(40, 40);
        for entry in factor.entries() {
            matrix[(entry.row, entry.variable)] = entry.value;
            if entry.is_exact {
                errors[(entry.row, entry.row)] = 0.0;
            }
        }
        let inverse = matrix.try_inverse().unwrap();
        let covariance = &inverse * errors * inverse.transpose();
        let dense = dense(&sub);
        assert!((covariance - &dense).amax() < 1e-9 * dense.diagonal().amax());
    }
}
