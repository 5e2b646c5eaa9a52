//! Subproblems by Clarabel.

use super::Subproblem;
use crate::constraints::Rows;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT, ZeroConeT,
};

/// How Clarabel ended, after our own look at the point it left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConicStatus {
    /// To full accuracy.
    Solved,
    /// To reduced accuracy; the point is used with care.
    Almost,
    /// No point satisfies the constraints.
    Infeasible,
    /// The cost has no minimum.
    Unbounded,
    /// The method stalled or ran out of iterations; the point is not to be trusted.
    Stalled,
}

impl ConicStatus {
    /// One sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            ConicStatus::Solved => "the quadratic program was solved",
            ConicStatus::Almost => "the quadratic program was solved to reduced accuracy",
            ConicStatus::Infeasible => {
                "no point satisfies all constraints of the quadratic program"
            }
            ConicStatus::Unbounded => "the quadratic program has no minimum",
            ConicStatus::Stalled => "the quadratic program could not be solved: its solver stalled",
        }
    }

    fn of(status: SolverStatus) -> Self {
        match status {
            SolverStatus::Solved => ConicStatus::Solved,
            SolverStatus::AlmostSolved => ConicStatus::Almost,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                ConicStatus::Infeasible
            }
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => {
                ConicStatus::Unbounded
            }
            SolverStatus::Unsolved
            | SolverStatus::MaxIterations
            | SolverStatus::MaxTime
            | SolverStatus::NumericalError
            | SolverStatus::InsufficientProgress
            | SolverStatus::CallbackTerminated => ConicStatus::Stalled,
        }
    }
}

/// What Clarabel found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// How it ended.
    pub status: ConicStatus,
    /// The variables.
    pub z: Vec<f64>,
    /// Multipliers of the inequality rows, positive where the upper bound pushes, negative where the
    /// lower one does: `gradient of (cost/2) + G^T multipliers + ... = 0`.
    pub multipliers: Vec<f64>,
    /// Multipliers of the equality rows, same convention.
    pub equality_multipliers: Vec<f64>,
    /// For each cone the multiplier of its bound, the first part: not negative, and what half the
    /// cost would lose per unit by which the bound gave way.
    pub cone_multipliers: Vec<f64>,
}

/// One row of Clarabel's `A x + s = b`, and where its multiplier goes.
#[derive(Clone, Copy)]
enum Origin {
    /// A definition of an auxiliary variable or a later row of a cone, whose multiplier nobody asks
    /// for.
    Auxiliary,
    Equality(usize),
    Upper(usize),
    Lower(usize),
    /// The first row of a cone.
    Cone(usize),
}

/// Rows, cones and multiplier targets in Clarabel's form; every linear row scaled to size 1.
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

impl Subproblem {
    /// Most iterations of Clarabel, unless told otherwise: it takes ten to thirty, and what is not
    /// solved after a hundred does not get solved.
    pub const ITERATIONS: u32 = 100;

    /// The minimiser under all constraints.
    pub fn solve(&self) -> Solution {
        self.solve_within(Self::ITERATIONS)
    }

    /// [`Subproblem::solve`] in at most so many iterations.
    ///
    /// The residuals are variables of their own, so `F^T F` is never formed; rows are scaled to size
    /// 1 and infinite bounds are left out.
    pub fn solve_within(&self, iterations: u32) -> Solution {
        // The cost at zero becomes 1: the tolerances mean the same for every problem.
        let at_zero = self.value(&vec![0.0; self.variables]);
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
            max_iter: iterations,
            max_threads: 1,
            ..DefaultSettings::default()
        };
        let right = conic.rows.right();
        let solver =
            DefaultSolver::new(&quadratic, &linear, &matrix, right, &conic.cones, settings);
        let Ok(mut solver) = solver else {
            return self.nothing();
        };
        solver.solve();
        let found = &solver.solution;
        let mut solution = self.read(&found.x, &found.z, found.status, &conic);
        let duals = solution
            .multipliers
            .iter_mut()
            .chain(&mut solution.equality_multipliers)
            .chain(&mut solution.cone_multipliers);
        duals.for_each(|m| *m /= scale);
        solution
    }

    fn nothing(&self) -> Solution {
        Solution {
            status: ConicStatus::Stalled,
            z: vec![0.0; self.variables],
            multipliers: vec![0.0; self.inequalities.len()],
            equality_multipliers: vec![0.0; self.equalities.len()],
            cone_multipliers: vec![0.0; self.cones.len()],
        }
    }

    /// The Hessian's diagonal: `d` for the variables, 1 for the residuals, 0 for the bounds of the
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
        let places: Vec<usize> = (0..diagonal.len()).collect();
        CscMatrix::new_from_triplets(
            diagonal.len(),
            diagonal.len(),
            places.clone(),
            places,
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
                Origin::Auxiliary,
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
                conic.push(&row, upper, 1.0, Origin::Upper(i));
            }
            if lower.is_finite() {
                conic.push(&row, lower, -1.0, Origin::Lower(i));
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
                conic.push(&row, sign * right, 1.0, Origin::Auxiliary);
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
                let origin = match i {
                    0 => Origin::Cone(k),
                    _ => Origin::Auxiliary,
                };
                conic.origins.push((origin, 1.0));
            }
            conic.cones.push(SecondOrderConeT(cone.rows.len()));
        }
        conic
    }

    fn read(&self, x: &[f64], duals: &[f64], status: SolverStatus, conic: &Conic) -> Solution {
        let mut solution = self.nothing();
        solution.status = ConicStatus::of(status);
        if x.iter().all(|x| x.is_finite()) {
            solution.z.copy_from_slice(&x[..self.variables]);
        } else {
            solution.status = ConicStatus::Stalled;
        }
        for ((origin, scale), dual) in conic.origins.iter().zip(duals) {
            let multiplier = scale * dual;
            match *origin {
                Origin::Equality(i) => solution.equality_multipliers[i] = multiplier,
                Origin::Upper(i) | Origin::Lower(i) => solution.multipliers[i] += multiplier,
                Origin::Cone(k) => solution.cone_multipliers[k] = multiplier,
                Origin::Auxiliary => {}
            }
        }
        solution
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
