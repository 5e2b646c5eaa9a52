//! Penalty weights by restricted maximum likelihood (REML) for more than 64 parameters, with traces estimated by random vectors.
//!
//! The step is that of [`PenaltyMoments`](crate::noise::PenaltyMoments): `w_j |L_j b|^2 = rank(L_j) - w_j tr(H^-1 L_j^T L_j)`, repeated
//! in one linearisation, with estimated sigmas changed by the factor `(misfit / (n - effective parameters))^(1/2)`.

use super::fit::Fit;
use super::reml::is_estimated;
use super::timings::Timings;
use super::traces::Traces;
use crate::problem::Problem;
use crate::record::Weighting;

/// Largest number of steps in one linearisation.
const STEPS: usize = 10;
/// Change of the logarithm of a weight below which the steps end.
const SETTLED: f64 = 0.02;
/// Largest change of the logarithm of a weight by one step.
const LONGEST: f64 = 5.0;
/// Effective number of parameters beyond the null space of a penalty below which its weight is not raised.
const NO_FREEDOM: f64 = 0.1;

/// Returns a copy of the problem with the weights and sigmas that maximise the restricted likelihood linearised at the optimum
/// `found`; `None` if the Hessian is singular.
pub(super) fn with_reml_weights(
    problem: &Problem,
    found: &Fit,
    timings: &mut Timings,
) -> Option<Problem> {
    let mut next = problem.clone();
    for _ in 0..STEPS {
        if step(&mut next, found, timings)? < SETTLED {
            break;
        }
    }
    Some(next)
}

/// One step in all weights; the largest change of the logarithm of one.
fn step(problem: &mut Problem, found: &Fit, timings: &mut Timings) -> Option<f64> {
    let traces = Traces::at(problem, found, timings);
    let (misfit, squares) = traces.squares(problem, timings)?;
    let left = problem.sample_count() as f64 - traces.of_samples(timings)?;
    let variance = match problem.channels().all(is_estimated_channel) && left > 0.0 {
        true => misfit / left,
        false => 1.0,
    };
    let mut changes = Vec::with_capacity(squares.len());
    for (index, squares) in squares.iter().enumerate() {
        let penalty = &problem.penalties[index];
        if !is_estimated(penalty) {
            changes.push(0.0);
            continue;
        }
        let freedom = traces.freedom(problem, index, timings)?;
        // In units of the next sigmas. Without freedom a weight can only fall.
        let ratio = variance * freedom.max(NO_FREEDOM) / squares.max(f64::MIN_POSITIVE);
        let change = match freedom > NO_FREEDOM {
            true => ratio.ln(),
            false => ratio.ln().min(0.0),
        };
        changes.push(change.clamp(-LONGEST, LONGEST));
    }
    let parts = problem.parts_mut();
    for (penalty, change) in parts.penalties.iter_mut().zip(&changes) {
        penalty.weight *= change.exp();
    }
    let channels = parts.experiments.iter_mut().flat_map(|e| &mut e.channels);
    for channel in channels {
        if let Weighting::Estimated { sigma } = *channel.weighting() {
            let sigma = sigma * variance.sqrt();
            *channel = channel
                .clone()
                .with_weighting(Weighting::Estimated { sigma });
        }
    }
    Some(changes.iter().fold(0.0, |most, c| c.abs().max(most)))
}

fn is_estimated_channel(channel: &crate::record::Channel) -> bool {
    matches!(channel.weighting(), Weighting::Estimated { .. })
}
