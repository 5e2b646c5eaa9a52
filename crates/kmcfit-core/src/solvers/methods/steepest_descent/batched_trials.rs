//! Trial steps of a point, eight at once: candidates for the lowest cost, and the response of these alone.

use super::{Best, take, trial};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::Weighting;
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;
use crate::step::{EngineMode, SearchRay, is_linear_midpoint};

/// Best trial, if it lowers the cost.
pub(super) fn lowest(
    work: &mut CountedEvaluator,
    point: &Iterate,
    ray: SearchRay,
    lengths: &[f64],
    spare: &mut Vec<Evaluation>,
) -> Option<Best> {
    let problem = work.problem();
    work.forwards(lengths.len() as u64, || {
        let mut best = None;
        for which in ray.candidates(lengths) {
            let length = lengths[which];
            let parameters = trial(point, length);
            let mut evaluation = take(spare, problem);
            let mode = EngineMode::Reference;
            if problem
                .evaluate_for(mode, &parameters, &mut evaluation)
                .is_err()
            {
                spare.push(evaluation);
                continue;
            }
            let trial = Best {
                length,
                parameters,
                evaluation,
            };
            trial.or_lower(&mut best, point, spare);
        }
        best
    })
}

/// Trial systems as a search ray, for the paper's problem: one free record with a sample at every node, nodal functions,
/// linear terms, the midpoint rule and the integral cost alone; `None` for any other problem.
pub(super) fn ray<'a>(problem: &'a Problem, point: &'a Iterate) -> Option<SearchRay<'a>> {
    let (experiment, channel, _) = problem.one_full_record()?;
    let system = &problem.system;
    let nodes = experiment.nodes;
    let is_integral = matches!(channel.weighting(), Weighting::Integral { .. });
    let fits = is_integral
        && is_linear_midpoint(system)
        && experiment.excitation.is_none()
        && !problem.is_regularised()
        && point.parameters.len() == 3 * nodes;
    let parts = |values: &'a [f64]| {
        let (mass, others) = values.split_at(nodes);
        let (damping, stiffness) = others.split_at(nodes);
        [mass, damping, stiffness]
    };
    fits.then(|| SearchRay {
        functions: parts(&point.parameters),
        direction: parts(&point.gradient.l2),
        initial: experiment.initial,
        samples: channel.observed(),
        step: system.grid.step(),
    })
}

#[cfg(test)]
mod tests;
