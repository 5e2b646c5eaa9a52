//! Finer bases, and where candidates beside a fit can be judged.

use crate::diagnostics::{rms, standard_deviation};
use crate::functions::Basis;
use crate::identifiability::has_active_rows;
use crate::objective::Evaluation;
use crate::problem::Problem;

/// Residuals below this share of the variation of the samples are rounding and step-size errors.
const EXACT: f64 = 1e-4;

/// True for a likelihood without active constraints, and residuals that may be noise.
pub(crate) fn applies(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> bool {
    let is_noise = problem.predicted(evaluation).all(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        rms(&residuals) > EXACT * standard_deviation(channel.observed())
    });
    let is_likelihood = problem.channels().all(|c| c.weighting().is_sigma());
    problem.parameters() > 0 && is_likelihood && is_noise && !has_active_rows(problem, theta)
}

/// A basis that contains the given one and has about twice as many parameters; `None` for a basis that is as fine as the grid.
pub(crate) fn finer_basis(problem: &Problem, basis: &Basis) -> Option<Basis> {
    let grid = &problem.system.grid;
    let halved = |knots: &[f64]| -> Vec<f64> {
        let pairs = knots
            .windows(2)
            .flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
        pairs.chain(knots.last().copied()).collect()
    };
    let finer = match basis {
        Basis::Nodal => return None,
        Basis::Constant => Basis::PiecewiseConstant {
            knots: halved(&basis.knot_times(grid)),
        },
        Basis::PiecewiseConstant { knots } => Basis::PiecewiseConstant {
            knots: halved(knots),
        },
        Basis::PiecewiseLinear { knots } => Basis::PiecewiseLinear {
            knots: halved(knots),
        },
        Basis::BSpline { knots } => Basis::BSpline {
            knots: halved(knots),
        },
        Basis::Polynomial { degree } => Basis::Polynomial {
            degree: 2 * degree + 1,
        },
    };
    let most = match finer {
        Basis::Polynomial { .. } => Basis::highest_degree(grid),
        _ => grid.nodes() / 2,
    };
    (finer.parameters(grid) <= most).then_some(finer)
}
