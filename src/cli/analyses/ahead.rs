//! What comes next: other experiments, and other motions.

use crate::config::{Candidate, Model};
use crate::report::study::*;
use kmcfit_core::internals::identifiability::{self, CandidateChannel, rank_experiments};
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::study::prediction;
use kmcfit_core::internals::study::pull_apart::Extreme;

/// The candidates, best first.
pub fn candidates(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    list: &[Candidate],
) -> Vec<CandidateRecord> {
    let spread = residual_spread(problem, evaluation);
    let channel = |c: &Candidate| {
        let channel = c.experiment.channels.first();
        channel.map(|channel| CandidateChannel {
            kind: channel.kind(),
            sigma: channel.weighting().sigma(0).unwrap_or(spread),
        })
    };
    let described: Vec<identifiability::Candidate> = (list.iter())
        .map(|c| identifiability::Candidate {
            name: c.name.clone(),
            initial: c.experiment.initial,
            excitation: c.experiment.excitation.clone(),
            channels: channel(c).into_iter().collect(),
        })
        .collect();
    let ranked = rank_experiments(problem, theta, evaluation, &described, false);
    let gain = |r: &identifiability::Ranked, of: fn(&identifiability::Gain) -> f64| {
        let of = r.gain.as_ref().ok().map(of);
        of.filter(|ratio| ratio.is_finite())
    };
    let record = |r: identifiability::Ranked| CandidateRecord {
        sentence: r.sentence(),
        new_directions: r.gain.as_ref().ok().map(|g| g.new_directions),
        volume: gain(&r, |g| g.volume),
        average: gain(&r, |g| g.average),
        worst: gain(&r, |g| g.worst),
        name: r.name,
    };
    ranked.into_iter().map(record).collect()
}

/// Root-mean-square residual of the first channel: the noise, where nobody gave any.
fn residual_spread(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let pairs = problem
        .channels()
        .zip(evaluation.predictions.iter().flatten());
    let mut spreads = pairs.map(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        kmcfit_core::internals::diagnostics::rms(&residuals)
    });
    spreads.next().unwrap_or(1.0).max(f64::MIN_POSITIVE.sqrt())
}

/// The motions from the initial states that the model asks for, and in the experiments that might be
/// made.
pub fn predictions(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    model: &Model,
    extremes: &[Extreme],
) -> Vec<PredictionRecord> {
    let covariance = problem.covariance(evaluation);
    let free = model.predictions.iter().map(|state| {
        let (y, v) = (state.displacement, state.velocity);
        prediction::Run::free(format!("from y = {y} m, v = {v} m/s"), *state)
    });
    let candidates = model.study.candidates.iter().map(|c| prediction::Run {
        excitation: c.experiment.excitation.clone(),
        ..prediction::Run::free(format!("`{}`", c.name), c.experiment.initial)
    });
    let each = free.chain(candidates).filter_map(|run| {
        let found =
            prediction::predict(problem, theta, &run, covariance.as_ref(), extremes).ok()?;
        Some(PredictionRecord {
            name: found.name,
            times: found.times,
            displacement: found.motion.displacement,
            band: found.band,
            worst: found.worst,
            furthest: found.furthest,
        })
    });
    each.collect()
}
