//! Rounds of fits in alternation with the estimation of their noise.

use super::fit::Fit;
use super::termination::Status;
use crate::host::Instant;

/// True if the fit was ended from outside.
pub(super) fn is_ended(found: &Fit) -> bool {
    let status = found.outcome.status;
    matches!(status, Status::Interrupted | Status::TimeLimit)
}

/// The fit `found` continued by another round, `next`: the last point, with the work of both. Rounds that were `ended` from
/// outside have not converged, whatever the status of the last fit.
pub(super) fn with_round(found: Fit, next: Fit, ended: bool) -> Fit {
    let next = next.with_work_of(found.counts, found.timings, found.elapsed);
    Fit {
        attempts: found.attempts,
        history: match next.history.is_empty() {
            true => found.history,
            false => next.history,
        },
        snapshots: found.snapshots,
        outcome: match ended {
            true => found.outcome,
            false => next.outcome,
        },
        ..next
    }
}

/// Result of work whose time is added to that of the fit.
pub(super) fn counted<T>(found: &mut Fit, work: impl FnOnce(&Fit) -> T) -> T {
    let clock = Instant::now();
    let result = work(found);
    let took = clock.elapsed();
    found.timings.linear_algebra += took;
    found.elapsed += took;
    result
}
