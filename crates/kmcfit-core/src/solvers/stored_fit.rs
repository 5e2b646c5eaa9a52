//! A fit at stored parameters, computed again without a search.

use super::fit::Fit;
use super::iterate::Iterate;
use super::methods::equation_error::equation_error_at;
use super::optimality::Optimality;
use super::reason::Reason;
use super::settings::{FitSettings, Solver};
use super::solve_counts::SolveCounts;
use super::termination::{Outcome, Status};
use super::timings::Timings;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use std::time::Duration;

/// The fit that ended with `status` at the parameters `theta`: cost and gradient there and at the start values of the problem, and with
/// `is_measured` the first-order condition. It has no history, attempts, gaps or work, and its reason is a placeholder.
///
/// `None` for an equation error whose nonlinear terms or robust losses depend on the search.
///
/// # Errors
/// A [`SimulationError`] if the simulation at `theta` fails.
pub fn stored_fit(
    problem: &Problem,
    theta: &[f64],
    settings: &FitSettings,
    status: Status,
    is_measured: bool,
) -> Result<Option<Fit>, SimulationError> {
    if settings.solver == Solver::EquationError {
        let fit = equation_error_at(problem, &problem.functions.start(), theta);
        return Ok(fit.map(|fit| Fit {
            outcome: outcome(status),
            optimality: fit.optimality.filter(|_| is_measured),
            ..fit
        }));
    }
    let kind = settings.gradient;
    let at = |theta: &[f64]| {
        let evaluation = problem.evaluate(theta)?;
        let gradient = problem.gradient(theta, &evaluation, kind);
        Ok(Iterate::new(theta.to_vec(), evaluation, gradient))
    };
    let best = at(theta)?;
    let first = at(&problem.functions.start());
    let tolerance = settings.stopping.tolerance.unwrap_or(0.0);
    let of_start = |value: fn(&Iterate) -> f64| first.as_ref().map_or(f64::NAN, value);
    Ok(Some(Fit {
        initial_cost: of_start(|first| first.evaluation.cost),
        started_from: of_start(|first| first.evaluation.cost),
        initial_norm_squared: of_start(|first| first.gradient.norm_squared),
        optimality: is_measured
            .then(|| Optimality::at(problem, &best, tolerance.max(Optimality::LEAST)))
            .flatten(),
        best,
        history: Vec::new(),
        snapshots: Vec::new(),
        outcome: outcome(status),
        counts: SolveCounts::default(),
        timings: Timings::default(),
        elapsed: Duration::ZERO,
        attempts: Vec::new(),
        gaps: Vec::new(),
    }))
}

fn outcome(status: Status) -> Outcome {
    Outcome::new(status, Reason::AllIterations(0))
}
