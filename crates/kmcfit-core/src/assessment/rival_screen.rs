//! Rivals of coefficients that vary with time, compared with the fit by one linearisation at its optimum, before they are fitted.
//!
//! With the weighted residuals `r` and their derivatives `J_f` in the parameters `theta_f` of the functions `f` that vary, `J` in the other
//! parameters, and `K` in the coefficients of further terms, a rival has about the chi-square
//!
//! ```text
//! min over d, kappa, p of |r - sum_f J_f theta_f + J d + sum_f (J_f e_f) kappa_f + K p|^2
//! ```
//!
//! where `e_f` are the parameters of the constant 1 in the basis of `f`, and `kappa_f` is the constant in its place.

use super::extension::extended;
use super::minimum::Minimum;
use crate::functions::{CoefficientFunction, CoefficientKind};
use crate::problem::Problem;
use crate::solvers::reduced_jacobian;
use crate::structure::Law;
use nalgebra::{DMatrix, DVector};

/// Linearised model with constants for the functions that vary, and with the terms of all rivals.
pub(super) struct RivalScreen {
    /// Derivatives, reduced: those of the model, then those of the terms.
    columns: DMatrix<f64>,
    right: DVector<f64>,
    /// Sum of squares of the fit.
    here: f64,
    kinds: Vec<CoefficientKind>,
    /// Parameters of the functions and the scalars from which they change; zero for constants in place of functions that vary.
    from: Vec<f64>,
    /// Number of parameters of the functions.
    functions: usize,
}

impl RivalScreen {
    /// `None` where the linearisation does not exist.
    pub(super) fn at(
        problem: &Problem,
        theta: &[f64],
        indices: &[usize],
        terms: &[(CoefficientKind, Law)],
    ) -> Option<Self> {
        let nodes = problem.functions.nodes();
        let further = terms
            .iter()
            .map(|(kind, term)| (CoefficientFunction::constant(*kind, 0.0, nodes), *term));
        let (extended, at) = extended(problem, theta, further.collect())?;
        let evaluation = extended.evaluate(&at).ok()?;
        let (jacobian, mut right) = reduced_jacobian(&extended, &evaluation);
        let here = right.norm_squared();
        let functions = &problem.functions;
        let own = functions.scalar_range().start;
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut from = Vec::new();
        for (f, range) in functions.ranges().iter().enumerate() {
            let derivatives = jacobian.columns(range.start, range.len());
            if !indices.contains(&f) {
                columns.extend(derivatives.column_iter().map(|c| c.into_owned()));
                from.extend(&theta[range.clone()]);
                continue;
            }
            let function = functions.get(f);
            let is_whole = function.offset.iter().all(|known| *known == 0.0);
            let constant = function.basis.as_ref().filter(|_| is_whole)?;
            let constant = constant.constant(&problem.system.grid, 1.0);
            let values = DVector::from_column_slice(&theta[range.clone()]);
            right -= derivatives * values;
            columns.push(derivatives * DVector::from_vec(constant));
            from.push(0.0);
        }
        let count = from.len();
        from.extend(problem.scalars(theta));
        // Those of the scalars stand after those of the new terms.
        let scalars = own + terms.len()..jacobian.ncols();
        for j in scalars.chain(own..own + terms.len()) {
            columns.push(jacobian.column(j).into_owned());
        }
        Some(Self {
            columns: DMatrix::from_columns(&columns),
            right,
            here,
            kinds: terms.iter().map(|(kind, _)| *kind).collect(),
            from,
            functions: count,
        })
    }

    /// Sum of squares of the fit.
    pub(super) fn here(&self) -> f64 {
        self.here
    }

    /// Number of parameters of the rival with the terms `kinds`.
    pub(super) fn parameters(&self, kinds: &[CoefficientKind]) -> usize {
        self.columns.ncols() - self.kinds.len() + kinds.len()
    }

    /// Linearised chi-square of the rival with the terms `kinds`, minus that of the fit.
    pub(super) fn difference(&self, kinds: &[CoefficientKind]) -> f64 {
        self.solve(kinds).squares - self.here
    }

    /// Parameters of the rival with the terms `kinds` at its minimum: of the functions, the terms, and the scalars.
    pub(super) fn minimum(&self, kinds: &[CoefficientKind]) -> Vec<f64> {
        let minimum = self.solve(kinds);
        let change = minimum.change.as_slice();
        let own = self.columns.ncols() - self.kinds.len();
        let mut all: Vec<f64> = self.from.iter().zip(change).map(|(a, d)| a + d).collect();
        let scalars = all.split_off(self.functions);
        // The terms are in the order of all terms.
        let new = &change[own..];
        let position = |kind: &CoefficientKind| self.kinds.iter().position(|known| known == kind);
        let mut sorted: Vec<&CoefficientKind> = kinds.iter().collect();
        sorted.sort_by_key(|kind| position(kind));
        let of_kind = |kind| sorted.iter().position(|sorted| *sorted == kind);
        all.extend(kinds.iter().filter_map(|kind| new.get(of_kind(kind)?)));
        all.extend(scalars);
        all
    }

    fn solve(&self, kinds: &[CoefficientKind]) -> Minimum {
        let own = self.columns.ncols() - self.kinds.len();
        let is_in = |j: &usize| *j < own || kinds.contains(&self.kinds[*j - own]);
        let chosen: Vec<usize> = (0..self.columns.ncols()).filter(is_in).collect();
        Minimum::of(&self.columns.select_columns(&chosen), &self.right)
    }
}
