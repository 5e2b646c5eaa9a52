//! Collocation start: states near the samples and parameters are corrected together, so that the equation of motion holds
//! only at the end.
//!
//! States near the samples cannot be off by a period, so this starting point has no local minima of a wrong period, however
//! long the record. The steps are linear in the functions: with correct states one step finds the functions from anywhere.

use crate::constraints::TOLERANCE;
use crate::objective::{Evaluation, SimulatedRecord};
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::record::Channel;
use crate::simulate::Trajectory;
use crate::solvers::linearization::linearise_about;
use crate::solvers::methods::equation_error::{from_kinematics, with_initial_states};
use crate::solvers::state_estimation::{Kinematics, by_spline};
use crate::system::State;

/// Largest number of corrections.
const ROUNDS: usize = 16;
/// Number of corrections, at most, that reset the states to those of the samples with the current sensor parameters, until no
/// function changes by more than [`NEAR`] of its size: states that follow wrong functions would drift away.
const ANCHORED: usize = 8;
const NEAR: f64 = 1e-3;
/// Largest change of a function, relative to its size, at which corrections end; a starting point need not be optimal.
const SETTLED: f64 = 1e-6;
/// Weight of the proximal term towards the last parameters, relative to the zero-response misfit; it determines the
/// directions that the samples leave undetermined.
const PULL: f64 = 1e-9;

/// Corrected parameters of lowest cost; `None` if none can be simulated. Ends early if `interrupted` returns true.
pub(in crate::solvers) fn collocation_start(
    problem: &Problem,
    start: &[f64],
    interrupted: &dyn Fn() -> bool,
) -> Option<Vec<f64>> {
    let scalars = problem.scalars(start);
    let kinematics: Vec<Option<Kinematics>> = (problem.experiments.iter())
        .map(|e| by_spline(problem, e, scalars).map(|(near, _)| near))
        .collect();
    let mut theta = from_kinematics(problem, start, &kinematics)
        .unwrap_or_else(|_| with_initial_states(problem, start, &kinematics));
    let first = first_states(problem, &theta)?;
    let mut states = first.clone();
    let mut evaluation = problem.workspace();
    let mut best: Option<(f64, Vec<f64>)> = None;
    let mut anchored = true;
    for round in 1..=ROUNDS {
        look(problem, &theta, &states, &mut evaluation);
        if interrupted() || !has_mass(&evaluation) {
            break;
        }
        let mut sub = linearise_about(problem, &theta, &evaluation);
        add_pull(problem, &evaluation, &mut sub);
        let Some(z) = solve(&sub) else { break };
        let moved = problem.constraints.moved(&theta, &z);
        let change = problem.relative_change(&evaluation, &theta, &moved);
        if !change.is_finite() {
            break;
        }
        theta = moved;
        anchored = anchored && round < ANCHORED && change > NEAR;
        match anchored {
            true => states = response_of_samples(problem, &theta, &first)?,
            false => correct(problem, &theta, &z, &mut states),
        }
        if let Ok(free) = problem.evaluate(&theta)
            && best.as_ref().is_none_or(|(cost, _)| free.cost < *cost)
        {
            best = Some((free.cost, theta.clone()));
        }
        if change <= SETTLED && !anchored {
            break;
        }
    }
    best.map(|(_, theta)| theta)
}

/// States of each experiment near its samples; those of a simulation where too few samples.
fn first_states(problem: &Problem, theta: &[f64]) -> Option<Vec<Trajectory>> {
    let scalars = problem.scalars(theta);
    let mut own = None;
    let each = problem
        .experiments
        .iter()
        .enumerate()
        .map(|(e, experiment)| {
            let mut response = match by_spline(problem, experiment, scalars) {
                Some((_, response)) => response,
                None => {
                    if own.is_none() {
                        own = problem.evaluate(theta).ok();
                    }
                    own.as_ref()?.trajectories[e].clone()
                }
            };
            begin(experiment.initial_state(scalars), &mut response);
            Some(response)
        });
    each.collect()
}

/// [`first_states`] for the current sensor parameters and initial states; `first` are those of the first round.
fn response_of_samples(
    problem: &Problem,
    theta: &[f64],
    first: &[Trajectory],
) -> Option<Vec<Trajectory>> {
    let perfect = |c: &Channel| !c.sensor().is_estimated();
    if !problem.channels().all(perfect) {
        return first_states(problem, theta);
    }
    let mut states = first.to_vec();
    for (experiment, response) in problem.experiments.iter().zip(&mut states) {
        begin(experiment.initial_state(problem.scalars(theta)), response);
    }
    Some(states)
}

fn begin(initial: State, response: &mut Trajectory) {
    response.displacement[0] = initial.displacement;
    response.velocity[0] = initial.velocity;
}

/// Sets `evaluation` to the coefficients at `theta`, the states `states` and the resulting predictions.
fn look(problem: &Problem, theta: &[f64], states: &[Trajectory], evaluation: &mut Evaluation) {
    problem.set_parameters(theta, evaluation);
    evaluation.trajectories.clone_from_slice(states);
    let each = problem
        .experiments
        .iter()
        .enumerate()
        .map(|(e, experiment)| {
            let view: SimulatedRecord = problem.view(evaluation, e);
            experiment
                .channels
                .iter()
                .map(|c| c.predict(view))
                .collect()
        });
    evaluation.predictions = each.collect();
}

/// True if the mass of every coefficient set is positive.
fn has_mass(evaluation: &Evaluation) -> bool {
    let mut nodal_sets = std::iter::once(&evaluation.nodal).chain(&evaluation.own_nodal);
    nodal_sets.all(|nodal| nodal.mass.iter().all(|m| *m > 0.0))
}

fn add_pull(problem: &Problem, evaluation: &Evaluation, sub: &mut Subproblem) {
    let sizes = problem.natural_scales(evaluation);
    let duration = problem.system.grid.duration();
    let weight = PULL * problem.zero_response_misfit().max(f64::MIN_POSITIVE);
    let metric = problem.functions.relative_metric(&sizes, duration);
    for (d, m) in sub.proximal.iter_mut().zip(metric) {
        *d = weight * m;
    }
}

fn solve(sub: &Subproblem) -> Option<Vec<f64>> {
    if let Some(z) = sub
        .solve_equality_constrained()
        .filter(|z| sub.holds(z, TOLERANCE))
    {
        return Some(z);
    }
    let solution = sub.solve_for_step();
    solution.status.is_point().then_some(solution.z)
}

/// Adds the changes of the states, which follow the parameters in `z`.
fn correct(problem: &Problem, theta: &[f64], z: &[f64], states: &mut [Trajectory]) {
    let mut changes = z[theta.len()..].chunks_exact(2);
    for (experiment, response) in problem.experiments.iter().zip(states) {
        for i in 1..experiment.nodes {
            let Some(change) = changes.next() else { return };
            response.displacement[i] += change[0];
            response.velocity[i] += change[1];
        }
        begin(experiment.initial_state(problem.scalars(theta)), response);
    }
}
