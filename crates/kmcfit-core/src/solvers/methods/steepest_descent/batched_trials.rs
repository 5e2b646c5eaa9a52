//! Trial steps of a point in batches: costs of eight trials per SIMD row, and the response of the best trial only.

use super::{Best, take, trial};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::Weighting;
use crate::simd::{LANES, Row};
use crate::simulate::fast::step_batch::{LaneLayout, SearchRay, StepBatch, reconstruct};
use crate::simulate::{is_linear_midpoint, reference};
use crate::solvers::evaluator::CountedEvaluator;
use crate::solvers::iterate::Iterate;

/// Storage of the trials of a point, in two batches of at most four rows.
#[derive(Default)]
pub(super) struct BatchedTrials([StepBatch; 2]);

impl BatchedTrials {
    /// Best trial, if it lowers the cost.
    pub fn lowest(
        &mut self,
        work: &mut CountedEvaluator,
        point: &Iterate,
        ray: SearchRay,
        lengths: &[f64],
        spare: &mut Vec<Evaluation>,
    ) -> Option<Best> {
        let problem = work.problem();
        work.forwards(lengths.len() as u64, || {
            let (_, channel, _) = problem.one_full_record()?;
            let layout = LaneLayout::new(ray, lengths);
            let costs = self.costs(ray, &layout);
            let mut best = None;
            for which in layout.lowest(&costs) {
                let length = lengths[which];
                let parameters = trial(point, length);
                let mut evaluation = take(spare, problem);
                let states = self.states(layout.place(which));
                let has_response = move_to(problem, &parameters, states, &mut evaluation);
                evaluation.misfit = match has_response {
                    true => channel.cost(&evaluation.predictions[0][0]),
                    false => f64::INFINITY,
                };
                evaluation.regularisation = 0.0;
                evaluation.cost = evaluation.misfit;
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

    /// Sums of squares of all rows.
    fn costs(&mut self, ray: SearchRay, layout: &LaneLayout) -> Vec<Row> {
        let rows = layout.rows();
        let middle = rows.div_ceil(2);
        let [first, second] = &mut self.0;
        first.run(ray, layout, 0..middle);
        second.run(ray, layout, middle..rows);
        [first.costs(), second.costs()].concat()
    }

    /// States of a trial along its response; NaN where not stored, from which no response is reconstructed.
    fn states(&self, place: (usize, usize)) -> [Row; 2] {
        let states = self.0.iter().find_map(|batch| batch.states(place));
        states.unwrap_or([[f64::NAN; LANES]; 2])
    }
}

/// Computes coefficients, response and predictions at `parameters`, from states of the response; returns false if the
/// simulation fails.
fn move_to(
    problem: &Problem,
    parameters: &[f64],
    states: [Row; 2],
    evaluation: &mut Evaluation,
) -> bool {
    (problem.functions).nodal_into(parameters, 0, &mut evaluation.nodal);
    let (system, nodal) = (&problem.system, &evaluation.nodal);
    let response = &mut evaluation.trajectories[0];
    let initial = problem.experiments[0].initial;
    let is_whole = reconstruct(nodal, initial, states, system.grid.step(), response);
    if !is_whole && reference::forward_into(system, nodal, initial, None, response).is_err() {
        return false;
    }
    evaluation.predictions[0][0].clone_from(&response.displacement);
    true
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
