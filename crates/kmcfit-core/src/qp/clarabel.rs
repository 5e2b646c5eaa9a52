//! Solution of subproblems by the interior-point solver Clarabel.

use super::{PrimalDual, Subproblem};
use crate::constraints::Rows;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT, ZeroConeT,
};

/// Origin of a row of Clarabel's `A x + s = b`, for the assignment of its multiplier.
#[derive(Clone, Copy)]
enum Origin {
    /// Definition of a residual, whose multiplier is the residual.
    Residual,
    Equality(usize),
    Inequality(usize),
    Absolute(usize),
    /// A row of a cone.
    Cone(usize, usize),
}

/// Rows, cones and origins in Clarabel's form; every linear row is scaled to size 1.
struct Conic {
    rows: Rows,
    cones: Vec<SupportedConeT<f64>>,
    origins: Vec<(Origin, f64)>,
}

impl Conic {
    fn new() -> Self {
        Self {
            rows: Rows::new(),
            cones: Vec::new(),
            origins: Vec::new(),
        }
    }

    fn push(&mut self, row: &[(usize, f64)], right: f64, sign: f64, origin: Origin) {
        let largest = row.iter().fold(0.0f64, |m, (_, a)| m.max(a.abs()));
        let scale = if largest > 0.0 { sign / largest } else { sign };
        self.rows
            .push(row.iter().map(|(j, a)| (*j, a * scale)), right * scale);
        self.origins.push((origin, scale));
    }
}

/// Result of one run of Clarabel, to be checked.
pub enum Ending {
    /// A point with multipliers, of unknown quality.
    Point(PrimalDual),
    /// Multipliers of a claimed proof of infeasibility.
    Contradiction(PrimalDual),
    /// No result.
    Nothing,
}

/// Settings of one run of Clarabel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Regularisation of the diagonal of Clarabel's systems.
    pub regularisation: f64,
    /// Iteration limit.
    pub iterations: u32,
}

impl Subproblem {
    /// One run of Clarabel.
    ///
    /// Residuals are variables, so that `F^T F` is not formed; rows are scaled to size 1, and infinite bounds are omitted.
    pub fn run_clarabel(&self, chosen: Settings) -> Ending {
        // Scaled to a cost of 1 at zero, so that the tolerances have the same meaning for every problem.
        let at_zero = self.value(&vec![0.0; self.variables]) - self.constant;
        let scale = if at_zero > 0.0 && at_zero.is_finite() {
            1.0 / at_zero
        } else {
            1.0
        };
        let conic = self.conic(scale.sqrt());
        let n = self.variables + self.residuals.len() + self.absolute.len();
        let quadratic = self.quadratic(scale);
        let mut linear = vec![0.0; n - self.absolute.len()];
        linear.extend(self.absolute_weights.iter().map(|w| 0.5 * scale * w));
        let matrix = columns(&conic.rows, n);
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: 1e-11,
            tol_gap_rel: 1e-10,
            tol_feas: 1e-11,
            max_iter: chosen.iterations,
            max_threads: 1,
            static_regularization_constant: chosen.regularisation,
            ..DefaultSettings::default()
        };
        let right = conic.rows.right();
        let solver =
            DefaultSolver::new(&quadratic, &linear, &matrix, right, &conic.cones, settings);
        let Ok(mut solver) = solver else {
            return Ending::Nothing;
        };
        solver.solve();
        let found = &solver.solution;
        let candidate = self.read(&found.x, &found.z, 1.0 / scale, &conic);
        if !candidate.is_finite() {
            return Ending::Nothing;
        }
        match found.status {
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Ending::Contradiction(candidate)
            }
            _ => Ending::Point(candidate),
        }
    }

    /// Diagonal of the Hessian: `d` for the variables, 1 for the residuals, 0 for the bounds of the
    /// absolute values. The cost is halved and scaled: `1/2 |rho|^2 + scale/2 (sum d z^2 +
    /// sum w t)` with `rho = sqrt(scale) (F z - f)`.
    fn quadratic(&self, scale: f64) -> CscMatrix<f64> {
        let ones = std::iter::repeat_n(1.0, self.residuals.len());
        let zeros = std::iter::repeat_n(0.0, self.absolute.len());
        let diagonal: Vec<f64> = self
            .proximal
            .iter()
            .map(|d| d * scale)
            .chain(ones)
            .chain(zeros)
            .collect();
        let positions: Vec<usize> = (0..diagonal.len()).collect();
        CscMatrix::new_from_triplets(
            diagonal.len(),
            diagonal.len(),
            positions.clone(),
            positions,
            diagonal,
        )
    }

    /// All rows; the residuals are multiplied by `root`.
    fn conic(&self, root: f64) -> Conic {
        let mut conic = Conic::new();
        for i in 0..self.residuals.len() {
            let mut row: Vec<(usize, f64)> =
                self.residuals.row(i).map(|(j, a)| (j, root * a)).collect();
            row.push((self.variables + i, -1.0));
            conic.push(
                &row,
                root * self.residuals.right()[i],
                1.0,
                Origin::Residual,
            );
        }
        for i in 0..self.equalities.len() {
            let row: Vec<(usize, f64)> = self.equalities.row(i).collect();
            conic.push(&row, self.equalities.right()[i], 1.0, Origin::Equality(i));
        }
        let zeros = conic.rows.len();
        for i in 0..self.inequalities.len() {
            let row: Vec<(usize, f64)> = self.inequalities.row(i).collect();
            let (lower, upper) = (self.inequalities.right()[i], self.upper[i]);
            if upper.is_finite() {
                conic.push(&row, upper, 1.0, Origin::Inequality(i));
            }
            if lower.is_finite() {
                conic.push(&row, lower, -1.0, Origin::Inequality(i));
            }
        }
        for i in 0..self.absolute.len() {
            // -t <= a z - b <= t.
            let bound = self.variables + self.residuals.len() + i;
            let right = self.absolute.right()[i];
            for sign in [1.0, -1.0] {
                let mut row: Vec<(usize, f64)> =
                    self.absolute.row(i).map(|(j, a)| (j, sign * a)).collect();
                row.push((bound, -1.0));
                conic.push(&row, sign * right, 1.0, Origin::Absolute(i));
                if let Some((_, scale)) = conic.origins.last_mut() {
                    *scale *= sign;
                }
            }
        }
        let bounds = conic.rows.len() - zeros;
        let kinds = [
            (zeros, ZeroConeT(zeros)),
            (bounds, NonnegativeConeT(bounds)),
        ];
        conic.cones = kinds
            .into_iter()
            .filter(|(n, _)| *n > 0)
            .map(|(_, c)| c)
            .collect();
        for (k, cone) in self.cones.iter().enumerate() {
            for i in 0..cone.rows.len() {
                // s = A z - right must lie in the cone: rows enter with a minus sign, unscaled.
                let row = cone.rows.row(i).map(|(j, a)| (j, -a));
                conic.rows.push(row, -cone.rows.right()[i]);
                conic.origins.push((Origin::Cone(k, i), 1.0));
            }
            conic.cones.push(SecondOrderConeT(cone.rows.len()));
        }
        conic
    }

    /// The point `x` with the multipliers `duals` in the unit `unit` of the cost.
    fn read(&self, x: &[f64], duals: &[f64], unit: f64, conic: &Conic) -> PrimalDual {
        let mut candidate = PrimalDual::zero(self);
        candidate.z.copy_from_slice(&x[..self.variables]);
        for ((origin, scale), dual) in conic.origins.iter().zip(duals) {
            let multiplier = unit * scale * dual;
            match *origin {
                Origin::Equality(i) => candidate.equalities[i] = multiplier,
                Origin::Inequality(i) => candidate.inequalities[i] += multiplier,
                Origin::Absolute(i) => candidate.absolute[i] += multiplier,
                Origin::Cone(k, i) => candidate.cones[k][i] = multiplier,
                Origin::Residual => {}
            }
        }
        candidate
    }
}

fn columns(rows: &Rows, n: usize) -> CscMatrix<f64> {
    let (mut i, mut j, mut a) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..rows.len() {
        for (column, value) in rows.row(row) {
            i.push(row);
            j.push(column);
            a.push(value);
        }
    }
    CscMatrix::new_from_triplets(rows.len(), n, i, j, a)
}
