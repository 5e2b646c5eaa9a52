//! Terms of the cost besides the samples, as rows of a subproblem.

use crate::problem::Problem;
use crate::qp::Subproblem;

/// Adds priors, `(x + delta - mean) / sigma`, as residual rows.
pub(crate) fn add_priors(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for (index, prior) in problem.functions.priors() {
        let row = [(index, 1.0 / prior.sigma)];
        let residual = (prior.mean - parameters[index]) / prior.sigma;
        sub.residuals.push(row, residual);
    }
}

/// Adds penalties, `sqrt(weight) (L (theta + delta) - target)`, as residual rows.
pub(crate) fn add_penalties(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for penalty in &problem.penalties {
        let range = problem.functions.ranges()[penalty.function].clone();
        let root = penalty.weight.sqrt();
        let residuals = penalty.residuals(&parameters[range.clone()]);
        for (i, r) in residuals.iter().enumerate() {
            let row = penalty
                .rows
                .row(i)
                .map(|(j, a)| (range.start + j, root * a));
            sub.residuals.push(row, -root * r);
        }
    }
}

/// Adds total-variation penalties, `weight |D (theta + delta)|`, as absolute values.
pub(in crate::solvers) fn add_variations(
    problem: &Problem,
    parameters: &[f64],
    sub: &mut Subproblem,
) {
    for variation in &problem.variations {
        let range = problem.functions.ranges()[variation.function].clone();
        let changes = variation.changes(&parameters[range.clone()]);
        for (i, change) in changes.iter().enumerate() {
            let row = variation.rows.row(i).map(|(j, a)| (range.start + j, a));
            sub.absolute.push(row, -change);
            sub.absolute_weights.push(variation.weight);
        }
    }
}

/// Adds the rows of soft constraints violated at `parameters` as residuals.
pub(crate) fn add_soft(problem: &Problem, parameters: &[f64], sub: &mut Subproblem) {
    for group in &problem.soft {
        let root = group.row_weight().sqrt();
        for i in 0..group.rows.len() {
            let excess = group.excess(i, parameters);
            if excess != 0.0 {
                let row = group.rows.row(i).map(|(j, a)| (j, root * a));
                sub.residuals.push(row, -root * excess);
            }
        }
    }
}
