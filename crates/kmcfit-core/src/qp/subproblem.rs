//! Definition of convex subproblems, and their solution without inequalities.

use super::ldl::Symmetric;
use super::{StageLayout, chain, few_variables};
use crate::constraints::{Cone, Rows};

/// Minimise `constant + |F z - f|^2 + sum_j d_j z_j^2 + sum_i w_i |(T z - t)_i|` subject to `E z = e`, `l <= G z <= u` and second-order cones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Subproblem {
    /// Number of variables.
    pub variables: usize,
    /// Constant part of the cost.
    pub constant: f64,
    /// `F` and `f`.
    pub residuals: Rows,
    /// `d`, one per variable, not negative.
    pub proximal: Vec<f64>,
    /// `T` and `t`.
    pub absolute: Rows,
    /// `w`, one per row of `T`, not negative.
    pub absolute_weights: Vec<f64>,
    /// `E` and `e`.
    pub equalities: Rows,
    /// `G` and `l`; minus infinity for no lower bound.
    pub inequalities: Rows,
    /// `u`; infinity for no upper bound.
    pub upper: Vec<f64>,
    /// Second-order cones.
    pub cones: Vec<Cone>,
    /// Elimination order: place of each variable along a chain, mostly time, in which rows couple neighbours only; empty if unknown for some
    /// variable.
    pub elimination_order: Vec<u32>,
    /// Assignment of the variables to the nodes of a time grid, if known for all.
    pub layout: Option<StageLayout>,
}

impl Subproblem {
    /// An empty problem with `variables` variables.
    pub fn new(variables: usize) -> Self {
        Self {
            variables,
            constant: 0.0,
            residuals: Rows::new(),
            proximal: vec![0.0; variables],
            absolute: Rows::new(),
            absolute_weights: Vec::new(),
            equalities: Rows::new(),
            inequalities: Rows::new(),
            upper: Vec::new(),
            cones: Vec::new(),
            elimination_order: Vec::new(),
            layout: None,
        }
    }

    /// Adds `lower <= entries z <= upper`.
    pub fn bound(
        &mut self,
        entries: impl IntoIterator<Item = (usize, f64)>,
        lower: f64,
        upper: f64,
    ) {
        self.inequalities.push(entries, lower);
        self.upper.push(upper);
    }

    /// Adds variables without a proximal term and returns their indices.
    pub fn add_variables(&mut self, count: usize) -> Vec<usize> {
        let indices = self.variables..self.variables + count;
        self.variables += count;
        self.proximal.resize(self.variables, 0.0);
        indices.collect()
    }

    /// Cost `constant + |F z - f|^2 + sum d z^2 + sum w |T z - t|`.
    pub fn value(&self, z: &[f64]) -> f64 {
        let tz = self.absolute.multiply(z);
        let jumps = tz
            .iter()
            .zip(self.absolute.right())
            .zip(&self.absolute_weights);
        let jumps: f64 = jumps.map(|((a, b), w)| w * (a - b).abs()).sum();
        let fz = self.residuals.multiply(z);
        let fit = fz.iter().zip(self.residuals.right());
        let near = self.proximal.iter().zip(z);
        let squares: f64 = fit.map(|(a, b)| (a - b) * (a - b)).sum();
        self.constant + jumps + squares + near.map(|(d, z)| d * z * z).sum::<f64>()
    }

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

    /// The problem in the variables `z_j / units_j`.
    #[must_use]
    pub fn in_units(&self, units: &[f64]) -> Self {
        let mut scaled = self.clone();
        let cones = scaled.cones.iter_mut().map(|cone| &mut cone.rows);
        let rows = [
            &mut scaled.residuals,
            &mut scaled.absolute,
            &mut scaled.equalities,
            &mut scaled.inequalities,
        ];
        let rows = rows.into_iter().chain(cones);
        rows.for_each(|rows| rows.scale_columns(units));
        let proximal = scaled.proximal.iter_mut().zip(units);
        proximal.for_each(|(d, unit)| *d *= unit * unit);
        scaled
    }

    /// Sets the right-hand sides of the equalities to zero.
    pub fn homogeneous(&mut self) {
        self.equalities.clear_right();
    }

    /// True if all inequalities and cones hold at `z`, to `tolerance` relative to each row's size.
    pub fn holds(&self, z: &[f64], tolerance: f64) -> bool {
        let values = self.inequalities.multiply(z);
        let rows = values.iter().enumerate().all(|(i, value)| {
            let slack = tolerance * self.inequalities.scale(i).max(f64::MIN_POSITIVE);
            *value >= self.inequalities.right()[i] - slack && *value <= self.upper[i] + slack
        });
        rows && self.cones.iter().all(|cone| cone.violation(z) <= tolerance)
    }

    /// True if an inequality is active at zero: its bound is nearer than `share` of the largest distance of a bound, each
    /// in units of the row's largest coefficient.
    pub fn is_active_at_zero(&self, share: f64) -> bool {
        let bounds = self.inequalities.right().iter().zip(&self.upper);
        let distances = bounds
            .enumerate()
            .map(|(i, (lower, upper))| lower.abs().min(upper.abs()) / self.inequalities.scale(i));
        let (least, most) = distances
            .filter(|distance| distance.is_finite())
            .fold((f64::INFINITY, 0.0f64), |(least, most), d| {
                (least.min(d), most.max(d))
            });
        least <= share * most
    }

    /// Largest residual of the optimality conditions, relative to their right-hand side, of a usable plain solution: the iterations converge like
    /// those with exact steps until the last digits.
    pub const PLAIN_RESIDUAL: f64 = 1e-6;
}
