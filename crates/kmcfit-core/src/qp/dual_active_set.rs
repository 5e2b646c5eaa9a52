//! Least squares in few variables under linear inequalities, by the dual active-set method (Goldfarb and Idnani, Mathematical
//! Programming 27, 1983).
//!
//! With the cost as a triangle, `|R x - b|^2`, the variables `w = R x - b` make the program the search for the shortest `w` under the rows
//! `n_i' w >= h_i`, `n_i = R^-T g_i`: rows of very different size lose no digits, and residuals of the optimality conditions are shares of the
//! cost.

use super::few_variables::{INDEPENDENT, Reduced};
use super::kkt::ROUNDING;
use super::{Kkt, PrimalDual, Subproblem};

/// Share of its length below which the rest of a row depends on the active ones.
const DEPENDENT: f64 = 1e-12;
/// Largest number of changes of the active set for each variable and row.
const CHANGES: usize = 4;

/// An upper triangular matrix, by columns.
#[derive(Default)]
struct UpperTriangle(Vec<Vec<f64>>);

impl UpperTriangle {
    /// `T^-1 x`.
    fn solve(&self, x: &[f64]) -> Vec<f64> {
        let mut solution = x.to_vec();
        for (j, column) in self.0.iter().enumerate().rev() {
            solution[j] /= column[j];
            let last = solution[j];
            add_multiple(-last, &column[..j], &mut solution[..j]);
        }
        solution
    }

    /// `T^-T x`.
    fn solve_transposed(&self, x: &[f64]) -> Vec<f64> {
        let mut solution = Vec::with_capacity(x.len());
        for (j, column) in self.0.iter().enumerate() {
            solution.push((x[j] - dot(&column[..j], &solution)) / column[j]);
        }
        solution
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// `y + a x` in position of `y`.
fn add_multiple(a: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}

/// An active row `n' w >= h`.
struct ActiveRow {
    row: usize,
    /// 1 at the upper bound, -1 at the lower one.
    sign: f64,
    normal: Vec<f64>,
    multiplier: f64,
}

/// The active rows, with an orthonormal basis `Q` of their normals `Q T`.
#[derive(Default)]
struct ActiveRows {
    rows: Vec<ActiveRow>,
    basis: Vec<Vec<f64>>,
    triangle: UpperTriangle,
}

impl ActiveRows {
    /// Components of `x` along the basis, and the rest; orthogonalised twice, which suffices to machine precision.
    fn split(&self, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut rest = x.to_vec();
        let mut along = vec![0.0; self.basis.len()];
        for _ in 0..2 {
            for (sum, q) in along.iter_mut().zip(&self.basis) {
                let part = dot(q, &rest);
                *sum += part;
                add_multiple(-part, q, &mut rest);
            }
        }
        (along, rest)
    }

    /// Adds a row; false, and nothing is changed, if it depends on the others.
    fn push(&mut self, row: ActiveRow) -> bool {
        let (mut along, rest) = self.split(&row.normal);
        let length = norm(&rest);
        if length <= DEPENDENT * norm(&row.normal) {
            return false;
        }
        along.push(length);
        self.basis.push(rest.iter().map(|x| x / length).collect());
        self.triangle.0.push(along);
        self.rows.push(row);
        true
    }

    fn remove(&mut self, position: usize) {
        let later: Vec<ActiveRow> = self.rows.drain(position..).skip(1).collect();
        self.basis.truncate(position);
        self.triangle.0.truncate(position);
        // Fewer rows are less dependent.
        later.into_iter().for_each(|row| {
            self.push(row);
        });
    }
}

/// The program in `w`.
struct LeastDistance<'a> {
    sub: &'a Subproblem,
    reduced: Reduced,
    triangle: UpperTriangle,
    /// VariableRole of each variable among the free ones.
    positions: Vec<Option<usize>>,
}

impl Subproblem {
    /// Minimum in few variables under linear inequalities; `None` for programs of another form, where the minimum without inequalities is
    /// not unique, where no point is feasible, and where the point does not satisfy the limits of a solution.
    pub(super) fn minimum_in_few_variables(&self) -> Option<(PrimalDual, Kkt)> {
        let has_form = self.absolute.is_empty() && self.cones.is_empty();
        has_form.then_some(())?;
        let reduced = Reduced::new(self, self.residuals.right())?;
        let free = reduced.free.len();
        // Without a solution the columns are dependent.
        let unbounded = reduced.triangle.solve(INDEPENDENT)?;
        let columns = (1..=free).map(|size| vec![0.0; size]);
        let mut triangle = UpperTriangle(columns.collect());
        for (i, (entries, _)) in reduced.triangle.rows().enumerate() {
            entries.for_each(|(j, r)| triangle.0[j][i] = r);
        }
        let mut positions = vec![None; self.variables];
        for (position, j) in reduced.free.iter().enumerate() {
            positions[*j] = Some(position);
        }
        let program = LeastDistance {
            sub: self,
            reduced,
            triangle,
            positions,
        };
        program.minimise(&unbounded)
    }
}

impl LeastDistance<'_> {
    fn minimise(&self, unbounded: &[f64]) -> Option<(PrimalDual, Kkt)> {
        let mut active = ActiveRows::default();
        let mut w = vec![0.0; unbounded.len()];
        let mut z = self.variables(unbounded, &w);
        let most = CHANGES * (unbounded.len() + self.sub.inequalities.len());
        let mut changes = 0;
        while let Some((row, sign)) = self.most_violated(&z, &active) {
            let mut entering = ActiveRow {
                row,
                sign,
                normal: self.normal(row, sign),
                multiplier: 0.0,
            };
            loop {
                changes += 1;
                (changes <= most).then_some(())?;
                let (along, rest) = active.split(&entering.normal);
                let fall = active.triangle.solve(&along);
                let length = norm(&rest);
                let full = match length > DEPENDENT * norm(&entering.normal) {
                    true => self.missing(row, sign, &z) / (length * length),
                    false => f64::INFINITY,
                };
                let ratios = active.rows.iter().zip(&fall).enumerate();
                let blocking = ratios
                    .filter(|(_, (_, fall))| **fall > 0.0)
                    .map(|(position, (row, fall))| (position, row.multiplier / fall))
                    .min_by(|(_, a), (_, b)| a.total_cmp(b));
                let step = blocking.map_or(full, |(_, most)| most.min(full));
                // No step reaches the row: no point is feasible.
                step.is_finite().then_some(())?;
                for (row, fall) in active.rows.iter_mut().zip(&fall) {
                    row.multiplier = (row.multiplier - step * fall).max(0.0);
                }
                entering.multiplier += step;
                if full.is_finite() {
                    add_multiple(step, &rest, &mut w);
                    z = self.variables(unbounded, &w);
                }
                match blocking {
                    Some((position, most)) if most < full => active.remove(position),
                    _ => {
                        active.push(entering).then_some(())?;
                        break;
                    }
                }
            }
        }
        self.refined(unbounded, &active)
    }

    /// The minimum on the active rows, anew and without the errors of the steps to them.
    fn refined(&self, unbounded: &[f64], active: &ActiveRows) -> Option<(PrimalDual, Kkt)> {
        let mut w = vec![0.0; unbounded.len()];
        let z = self.variables(unbounded, &w);
        let missing = active.rows.iter();
        let missing: Vec<f64> = missing
            .map(|row| self.missing(row.row, row.sign, &z))
            .collect();
        let along = active.triangle.solve_transposed(&missing);
        for (part, q) in along.iter().zip(&active.basis) {
            add_multiple(*part, q, &mut w);
        }
        let multipliers = active.triangle.solve(&along);
        let mut point = PrimalDual::zero(self.sub);
        point.z = self.variables(unbounded, &w);
        self.sub.clip(&mut point.z);
        // The minimum of the Lagrangian is a lower bound: half the cost exceeds the minimum by no more than this.
        let mut excess = self.distance(&point.z);
        for (row, multiplier) in active.rows.iter().zip(multipliers) {
            let multiplier = multiplier.max(0.0);
            point.inequalities[row.row] = row.sign * multiplier;
            add_multiple(-multiplier, &row.normal, &mut excess);
        }
        let gradient = self.sub.gradient(&point);
        for i in 0..self.sub.equalities.len() {
            let (j, a) = self.sub.equalities.row(i).find(|(_, a)| *a != 0.0)?;
            point.equalities[i] = -gradient[j] / a;
        }
        point.is_finite().then_some(())?;
        let kkt = self
            .sub
            .kkt_with_decrease(&point, 0.5 * dot(&excess, &excess));
        kkt.is_near().then_some((point, kkt))
    }

    /// All variables at `w`; the free ones are `unbounded` at zero.
    fn variables(&self, unbounded: &[f64], w: &[f64]) -> Vec<f64> {
        let mut z = self.reduced.z.clone();
        let moved = unbounded.iter().zip(self.triangle.solve(w));
        for (j, (x, change)) in self.reduced.free.iter().zip(moved) {
            z[*j] = x + change;
        }
        z
    }

    /// `R x - b` of the free variables.
    fn distance(&self, z: &[f64]) -> Vec<f64> {
        let free = &self.reduced.free;
        let rows = self.reduced.triangle.rows();
        rows.map(|(entries, b)| entries.map(|(j, r)| r * z[free[j]]).sum::<f64>() - b)
            .collect()
    }

    /// `R^-T g` of a row, pointing to where it is satisfied.
    fn normal(&self, row: usize, sign: f64) -> Vec<f64> {
        let mut g = vec![0.0; self.reduced.free.len()];
        for (j, a) in self.sub.inequalities.row(row) {
            if let Some(position) = self.positions[j] {
                g[position] -= sign * a;
            }
        }
        self.triangle.solve_transposed(&g)
    }

    /// By how much a row exceeds its bound.
    fn missing(&self, row: usize, sign: f64, z: &[f64]) -> f64 {
        let bound = match sign > 0.0 {
            true => self.sub.upper[row],
            false => self.sub.inequalities.right()[row],
        };
        let entries = self.sub.inequalities.row(row);
        sign * (entries.map(|(j, a)| a * z[j]).sum::<f64>() - bound)
    }

    /// The row, and the sign of its side, that is violated most as a share of its terms, beyond their rounding.
    fn most_violated(&self, z: &[f64], active: &ActiveRows) -> Option<(usize, f64)> {
        let rows = &self.sub.inequalities;
        let mut worst = (ROUNDING, None);
        for (i, upper) in self.sub.upper.iter().enumerate() {
            let (mut value, mut terms) = (0.0, 0.0f64);
            for (j, a) in rows.row(i) {
                value += a * z[j];
                terms += (a * z[j]).abs();
            }
            let lower = rows.right()[i];
            for (sign, bound) in [(1.0, *upper), (-1.0, lower)] {
                let share = sign * (value - bound) / terms.max(bound.abs());
                if share > worst.0 && !active.rows.iter().any(|row| row.row == i) {
                    worst = (share, Some((i, sign)));
                }
            }
        }
        worst.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1e20 (z_1 + z_2 - 1)^2 + (z_1 - 3)^2` with `z_1 <= 2` and `z_2 >= -5`: at (2, -1), with the multiplier 1. The gradient there is the
    /// rounding error of the large row.
    #[test]
    fn rows_of_very_different_size() {
        let mut sub = Subproblem::new(2);
        sub.elimination_order = vec![0, 0];
        sub.residuals.push([(0, 1e10), (1, 1e10)], 1e10);
        sub.residuals.push([(0, 1.0)], 3.0);
        sub.bound([(0, 1.0)], f64::NEG_INFINITY, 2.0);
        sub.bound([(1, 1.0)], -5.0, f64::INFINITY);
        let (point, kkt) = sub.minimum_in_few_variables().expect("a minimum");
        let errors = [
            point.z[0] - 2.0,
            point.z[1] + 1.0,
            point.inequalities[0] - 1.0,
        ];
        assert!(
            errors.iter().all(|error| error.abs() < 1e-14),
            "{point:?} {kkt:?}"
        );
        assert_eq!(point.inequalities[1], 0.0);
    }

    /// `(z_1 - 10)^2 + (z_2 - 2)^2` with `z_2 <= 0.5` and `z_1 + z_2 <= 8.8`: at (8.4, 0.4), with the multiplier 1.6. The first row is violated more at
    /// (10, 2), so it is active first and leaves the set again.
    #[test]
    fn a_row_leaves_the_active_set() {
        let mut sub = Subproblem::new(2);
        sub.elimination_order = vec![0, 0];
        sub.residuals.push([(0, 1.0)], 10.0);
        sub.residuals.push([(1, 1.0)], 2.0);
        sub.bound([(1, 1.0)], f64::NEG_INFINITY, 0.5);
        sub.bound([(0, 1.0), (1, 1.0)], f64::NEG_INFINITY, 8.8);
        let (point, kkt) = sub.minimum_in_few_variables().expect("a minimum");
        assert_eq!(point.inequalities[0], 0.0);
        let errors = [
            point.z[0] - 8.4,
            point.z[1] - 0.4,
            point.inequalities[1] - 1.6,
        ];
        assert!(
            errors.iter().all(|error| error.abs() < 1e-14),
            "{point:?} {kkt:?}"
        );
    }

    /// `z <= 0` and `z >= 1`: no point is feasible.
    #[test]
    fn contradictions_have_no_minimum() {
        let mut sub = Subproblem::new(1);
        sub.elimination_order = vec![0];
        sub.residuals.push([(0, 1.0)], 3.0);
        sub.bound([(0, 1.0)], f64::NEG_INFINITY, 0.0);
        sub.bound([(0, 1.0)], 1.0, f64::INFINITY);
        assert!(sub.minimum_in_few_variables().is_none());
    }
}
