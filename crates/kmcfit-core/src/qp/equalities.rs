//! Solution of convex subproblems without inequalities.

use super::ldl::Symmetric;
use super::{Subproblem, chain, few_variables};
use crate::constraints::Rows;

impl Subproblem {
    /// Largest residual of the optimality conditions, relative to their right-hand side, of a usable plain solution: the iterations converge like
    /// those with exact steps until the last digits.
    pub const PLAIN_RESIDUAL: f64 = 1e-6;

    /// Minimiser without inequalities and cones; `None` if it is not found to [`Subproblem::PLAIN_RESIDUAL`] or the cost has absolute values.
    ///
    /// Variables with an elimination order ([`Subproblem::elimination_order`]) are eliminated along it, or together if it has one place. Otherwise, or if
    /// that fails, solves the optimality conditions with the residuals `rho = F z - f` as unknowns,
    /// `[D F' E'; F -I 0; E 0 0] (z, rho, lambda) = (0, f, e)`, which avoids `F^T F`.
    pub fn solve_equality_constrained(&self) -> Option<Vec<f64>> {
        if !self.absolute.is_empty() {
            return None;
        }
        self.solve_equality_constrained_for(&[self.residuals.right().to_vec()])?
            .pop()
    }

    /// [`Subproblem::solve_equality_constrained`] for several right-hand sides `f` of the residuals, by one factorisation; absolute values are ignored.
    pub fn solve_equality_constrained_for(&self, targets: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        if let [target] = targets
            && let Some(z) = few_variables::minimise(self, target)
        {
            return Some(vec![z]);
        }
        chain::minimise(self, targets).or_else(|| self.solve_by_factor(targets))
    }

    /// [`Subproblem::solve_equality_constrained_for`] by one symmetric factorisation.
    fn solve_by_factor(&self, targets: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let solutions = self.solve_conditions(targets)?.into_iter();
        let variables = solutions.map(|mut solution| {
            solution.truncate(self.variables);
            solution
        });
        Some(variables.collect())
    }

    /// Solutions `(z, rho, lambda)` of the optimality conditions for each `f`.
    fn solve_conditions(&self, targets: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let matrix = self.kkt_matrix(&self.equalities);
        let zeros = vec![0.0; self.variables];
        let side = |f: &Vec<f64>| [&zeros, f.as_slice(), self.equalities.right()].concat();
        let sides: Vec<Vec<f64>> = targets.iter().map(side).collect();
        let solutions = matrix.solve(&sides)?.into_iter();
        let exact = |(solution, residual)| (residual <= Self::PLAIN_RESIDUAL).then_some(solution);
        solutions.map(exact).collect()
    }

    /// KKT matrix `[D F' A'; F -I 0; A 0 0]` with the rows `A`.
    pub(super) fn kkt_matrix(&self, rows: &Rows) -> Symmetric {
        let (n, r) = (self.variables, self.residuals.len());
        let mut matrix = Symmetric::new([vec![1i8; n], vec![-1; r + rows.len()]].concat());
        for (j, d) in self.proximal.iter().enumerate() {
            matrix.add(j, j, *d);
        }
        for i in 0..r {
            (self.residuals.row(i)).for_each(|(j, a)| matrix.add(j, n + i, a));
            matrix.add(n + i, n + i, -1.0);
        }
        for i in 0..rows.len() {
            (rows.row(i)).for_each(|(j, a)| matrix.add(j, n + r + i, a));
        }
        matrix
    }

    /// Feasible point from an active-set iteration that only adds rows: inequalities that `z`, the minimum without them, violates beyond
    /// `tolerance` become equalities, and the minimum is computed again. Rows are not removed, so the point need not be the constrained
    /// minimum. `None` if a few rounds do not suffice, or with cones.
    pub fn solve_active_set(&self, mut z: Vec<f64>, tolerance: f64) -> Option<Vec<f64>> {
        if !self.cones.is_empty() {
            return None;
        }
        let mut held = self.clone();
        let mut taken = vec![false; self.inequalities.len()];
        for _ in 0..Self::HOLDING_ROUNDS {
            let mut inside = true;
            for (i, value) in self.inequalities.multiply(&z).into_iter().enumerate() {
                let slack = tolerance * self.inequalities.scale(i).max(f64::MIN_POSITIVE);
                let (lower, upper) = (self.inequalities.right()[i], self.upper[i]);
                if !taken[i] && (value < lower - slack || value > upper + slack) {
                    let bound = if value < lower { lower } else { upper };
                    held.equalities.push(self.inequalities.row(i), bound);
                    taken[i] = true;
                    inside = false;
                }
            }
            if inside {
                return Some(z);
            }
            z = held.solve_equality_constrained()?;
        }
        None
    }

    /// Largest number of rounds of [`Subproblem::solve_active_set`]; after them a quadratic program is solved.
    const HOLDING_ROUNDS: usize = 10;
}
