//! Refits on other clocks.

use super::record_parameters::{Clock, RecordColumns, RecordParameter, with_clock};
use super::refit::Refit;
use super::span::Span;
use crate::problem::Problem;

/// Rounds of refits with a corrected clock.
const ROUNDS: usize = 8;
/// Change of a delay or rate in standard errors at which the rounds end.
const AT_REST: f64 = 0.1;

/// Refits on the clock that a score test of its parameter leaves at rest.
pub(crate) fn on_best_clock(
    problem: &Problem,
    theta: &[f64],
    parameter: RecordParameter,
    mut clock: Clock,
) -> Option<(Clock, Refit)> {
    let (RecordParameter::Delay(e) | RecordParameter::Rate(e)) = parameter else {
        return None;
    };
    let mut start = theta.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let refit = Refit::of(with_clock(problem, e, clock)?, &start)?;
        start.clone_from(&refit.fit.best.parameters);
        let evaluation = refit.evaluation();
        let change = RecordColumns::of(&refit.problem, evaluation, &[parameter])
            .column(&refit.problem, evaluation, parameter)
            .and_then(|column| Span::score(&refit.problem, evaluation, column))
            .filter(|(_, t)| t.abs() > AT_REST);
        found = Some((clock, refit));
        let Some((value, _)) = change else {
            break;
        };
        match parameter {
            RecordParameter::Delay(_) => clock.delay += value,
            _ => clock.rate += value,
        }
    }
    found
}
