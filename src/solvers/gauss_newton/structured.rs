//! The Gauss–Newton subproblem with the states as unknowns: sparse, and of a size linear in the number
//! of nodes, for functions with many parameters.

use crate::constraints::Rows;
use crate::dynamics::{StepJacobian, Trajectory};
use crate::objective::Evaluation;
use crate::problem::{Experiment, Problem};
use crate::qp::Subproblem;

/// The subproblem in `(delta theta, delta x)` about `theta` and the node states `states`, one
/// trajectory per experiment; the first state of each is given and no unknown.
///
/// Residuals: `sqrt(w) (r + delta y)` for the readings. Equalities: every step, linearised,
/// `delta x_{i+1} - dPhi_i (delta x_i, delta theta) = Phi_i(x_i) - x_{i+1}`; the right-hand sides
/// vanish where the states are a motion.
pub fn subproblem(problem: &Problem, evaluation: &Evaluation) -> Subproblem {
    let parameters = problem.functions.parameters();
    let per_experiment = 2 * (problem.oscillator.grid.nodes() - 1);
    let variables = parameters + per_experiment * problem.experiments.len();
    let mut sub = Subproblem::new(variables);
    let motions = problem.experiments.iter().zip(&evaluation.trajectories);
    for (e, (experiment, states)) in motions.enumerate() {
        let steps = problem.oscillator.step_jacobians(
            &evaluation.device,
            experiment.force.as_deref(),
            states,
        );
        let base = parameters + e * per_experiment;
        add_steps(problem, base, &steps, states, &mut sub.equalities);
        add_readings(experiment, base, states, &mut sub.residuals);
    }
    sub
}

/// Index of the displacement at node `i >= 1`; the velocity is the next one.
fn state_index(base: usize, i: usize) -> usize {
    base + 2 * (i - 1)
}

fn add_steps(
    problem: &Problem,
    base: usize,
    steps: &[StepJacobian],
    states: &Trajectory,
    equalities: &mut Rows,
) {
    let mut entries = Vec::new();
    for (i, step) in steps.iter().enumerate() {
        let ends = [step.end.displacement, step.end.velocity];
        let next = [states.displacement[i + 1], states.velocity[i + 1]];
        for q in 0..2 {
            entries.clear();
            entries.push((state_index(base, i + 1) + q, 1.0));
            if i > 0 {
                for s in 0..2 {
                    entries.push((state_index(base, i) + s, -step.state[s][q]));
                }
            }
            add_functions(problem, i, step, q, &mut entries);
            equalities.push(entries.iter().copied(), ends[q] - next[q]);
        }
    }
}

/// What the functions' values at both ends of step `i` do to component `q` of the next state.
fn add_functions(
    problem: &Problem,
    i: usize,
    step: &StepJacobian,
    q: usize,
    entries: &mut Vec<(usize, f64)>,
) {
    let parts = problem.functions.iter().zip(problem.functions.ranges());
    for (f, (function, range)) in parts.enumerate() {
        for (node, slope) in [(i, step.left[f][q]), (i + 1, step.right[f][q])] {
            if slope != 0.0 {
                let add = |(j, b): (usize, f64)| entries.push((range.start + j, -slope * b));
                function.design.row(node).for_each(add);
            }
        }
    }
}

fn add_readings(experiment: &Experiment, base: usize, states: &Trajectory, residuals: &mut Rows) {
    let Some(readings) = &experiment.readings else {
        return;
    };
    let all = readings.residuals(&states.displacement).enumerate();
    for (i, r) in all.filter(|(i, _)| *i > 0) {
        let root = readings.weight(i).sqrt();
        let y = state_index(base, i * readings.stride());
        residuals.push([(y, root)], -root * r);
    }
}
