//! The end of a fit without a feasible response.
//!
//! The constraint set is convex, and whether it is empty is decided by a projection. Which of its
//! points have a response is not: only that the mass must be positive is a constraint of its own.

use super::executor::search_unobserved;
use super::fit::Fit;
use super::reason::Reason;
use super::settings::FitSettings;
use super::termination::{Outcome, Status};
use crate::constraints::TOLERANCE;
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// The end of a fit none of whose starts in the constraint set has a response, the first for the reason
/// `breakdown`: `infeasible`, with the start `given` before it was moved into the constraints as the
/// only point with a response that is known.
///
/// This is no proof that every system in the set is without response; the reason says what was seen.
///
/// # Errors
/// The `breakdown`, if `given` satisfies the constraints or has no response either: then the start is
/// to blame, and there is nothing to keep.
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
