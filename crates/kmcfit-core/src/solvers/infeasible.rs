//! What is said of a problem without a device that satisfies both the constraints and the motion.
//!
//! The constraint set is convex, and whether it is empty is decided by a projection. Which of its
//! points have a motion is not: only that the mass must be positive is a constraint of its own.

use super::executor::search;
use super::{Fit, FitSettings, Outcome, Point, Status, Step, Watch};
use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::dynamics::Breakdown;
use crate::problem::Problem;
use crate::qp::ConicStatus;

/// Smallest mass that counts as positive, as a share of the start's largest: a lighter device swings
/// a thousand times in the time of one swing of the start, which no grid that suits the start resolves.
const POSITIVE: f64 = 1e-6;

/// The step from `point` when the quadratic programs that would make one ended with `status`.
pub(super) fn no_step(problem: &Problem, point: &Point, status: ConicStatus) -> Step {
    let reason = status.sentence().to_string();
    // From a point that satisfies them there is always the step of length zero.
    let inside = problem.constraints.hold(&point.parameters, TOLERANCE);
    match status == ConicStatus::Infeasible && !inside {
        true => Step::Infeasible(reason),
        false => Step::Stuck(reason),
    }
}

impl Problem {
    /// The constraints and a mass that is positive at every node; `start` tells what is small.
    pub(super) fn constraints_with_mass(&self, start: &[f64]) -> Constraints {
        let device = self.functions.device(start);
        let largest = device.mass.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let least = POSITIVE * largest;
        let mut group = RowGroup::new("mass > 0");
        let parts = self.functions.iter().zip(self.functions.ranges());
        if let Some((mass, range)) = parts.into_iter().next() {
            for i in 0..self.oscillator.grid.nodes() {
                let row = mass.design.row(i).map(|(j, b)| (range.start + j, b));
                let time = self.oscillator.grid.time(i);
                let bounds = [least - mass.offset[i], f64::INFINITY];
                group.push(row, bounds, [time, time]);
            }
        }
        let mut constraints = self.constraints.clone();
        constraints.groups.push(group);
        constraints
    }
}

/// The end of a fit none of whose starts in the constraint set has a motion, the first for the reason
/// `breakdown`: `infeasible`, with the start `given` before it was moved into the constraints as the
/// only point with a motion that is known.
///
/// This is no proof that every device in the set is without motion; the reason says what was seen.
///
/// # Errors
/// The `breakdown`, if `given` satisfies the constraints or has no motion either: then the start is
/// to blame, and there is nothing to keep.
pub fn without_motion(
    problem: &Problem,
    given: &[f64],
    settings: &FitSettings,
    breakdown: Breakdown,
) -> Result<Fit, Breakdown> {
    if problem.constraints.hold(given, TOLERANCE) {
        return Err(breakdown);
    }
    let mut settings = settings.clone();
    settings.stopping.iterations = 0;
    let fit = search(
        problem,
        given,
        &settings,
        None,
        &mut Watch::new(&mut |_| {}),
    )
    .map_err(|_| breakdown)?;
    let reason = format!(
        "no start within the constraints has a motion ({breakdown}); what is kept is the start as \
         given, which breaks them"
    );
    Ok(Fit {
        outcome: Outcome::new(Status::Infeasible, reason),
        ..fit
    })
}
