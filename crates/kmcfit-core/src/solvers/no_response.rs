//! Result of a fit whose feasible starting points cannot be simulated.
//!
//! The constraint set is convex, and a projection decides if it is empty. The set of parameters that can be simulated is
//! not convex; of its conditions only the positive mass is a constraint.

use super::executor::search_unobserved;
use super::fit::Fit;
use super::reason::Reason;
use super::settings::FitSettings;
use super::termination::{Outcome, Status};
use crate::constraints::TOLERANCE;
use crate::problem::Problem;
use crate::step::SimulationError;

/// Result of a fit whose starting points in the constraint set cannot be simulated, the first because of `breakdown`: status
/// `infeasible`, with the start `given`, before projection onto the constraints, as the only point with a response.
///
/// A feasible point that can be simulated may still exist: only the starting points were simulated, and the reason states
/// this.
///
/// # Errors
/// The `breakdown`, if `given` satisfies the constraints or cannot be simulated either.
pub fn no_response(
    problem: &Problem,
    given: &[f64],
    settings: &FitSettings,
    breakdown: SimulationError,
) -> Result<Fit, SimulationError> {
    if problem.constraints.hold(given, TOLERANCE) {
        return Err(breakdown);
    }
    let mut settings = settings.clone();
    settings.stopping.iterations = 0;
    let fit = search_unobserved(problem, given, &settings).map_err(|_| breakdown)?;
    Ok(Fit {
        outcome: Outcome::new(Status::Infeasible, Reason::NoFeasibleResponse(breakdown)),
        ..fit
    })
}
