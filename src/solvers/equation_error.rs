//! The equation-error start: smoothed readings put into the equation of motion.
//!
//! With `y`, `y'`, `y''` from the readings, `m y'' + c y' + k y - f` is linear in the parameters, so
//! penalties and constraints make it one convex problem. It needs no start and knows no local minima
//! of a wrong period; noise biases it, which the fit that follows removes.

use super::gauss_newton::{add_penalties, add_variations};
use super::kinematics::Kinematics;
use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::dynamics::quadrature::trapezoid_weights;
use crate::dynamics::{Stepwise, Term};
use crate::problem::{Experiment, Problem};
use crate::qp::{ConicStatus, Subproblem};

/// A pull towards the start, relative to the equation's own weight: it decides what the equation
/// leaves open and nothing else.
const PULL: f64 = 1e-9;

/// A clipped solution is used if it keeps this share of the plain one's decrease: the fit that
/// follows needs a start, not an optimum.
const KEPT: f64 = 0.999;
/// Parameters from the equation error, under the problem's penalties and constraints.
///
/// # Errors
/// How the convex problem ended, if not with a solution.
pub fn equation_error(problem: &Problem, start: &[f64]) -> Result<Vec<f64>, ConicStatus> {
    let motions: Vec<Option<Kinematics>> = (problem.experiments.iter())
        .map(|experiment| Kinematics::of(problem, experiment, problem.scalars(start)))
        .collect();
    from_motions(problem, start, &motions)
}

/// [`equation_error`] with the motion of each experiment.
pub(super) fn from_motions(
    problem: &Problem,
    start: &[f64],
    motions: &[Option<Kinematics>],
) -> Result<Vec<f64>, ConicStatus> {
    let start = &with_initial_states(problem, start, motions);
    let mut sub = Subproblem::new(problem.parameters());
    for (experiment, motion) in problem.experiments.iter().zip(motions) {
        if let Some(motion) = motion {
            add_experiment(problem, experiment, motion, start, &mut sub);
        }
    }
    add_penalties(problem, start, &mut sub);
    add_variations(problem, start, &mut sub);
    let held = with_scale_held(problem, start);
    sub.constrain(&held, start);
    let sizes: Vec<f64> = (problem.functions.values(start).iter())
        .map(|f| {
            f.iter()
                .fold(0.0f64, |m, p| m.max(p.abs()))
                .max(f64::MIN_POSITIVE.sqrt())
        })
        .collect();
    let metric = problem
        .functions
        .relative_metric(&sizes, problem.oscillator.grid.duration());
    let weight = PULL * sub.value(&vec![0.0; start.len()]).max(f64::MIN_POSITIVE);
    sub.proximal = metric.iter().map(|m| m * weight).collect();
    let constraints = &problem.constraints;
    let moved = |z: &[f64]| -> Vec<f64> {
        let mut theta: Vec<f64> = start.iter().zip(z).map(|(s, d)| s + d).collect();
        constraints.clip(&mut theta);
        theta
    };
    if let Some(theta) = sub
        .solve_plain()
        .and_then(|z| clipped(&sub, &held, &z, start, &moved))
    {
        return Ok(theta);
    }
    let solution = sub.solve();
    match solution.status {
        ConicStatus::Solved | ConicStatus::Almost => Ok(moved(&solution.z)),
        status => Err(status),
    }
}

/// The plain solution moved into the constraints, if they hold there and it is nearly as good as
/// the plain one, which no point in them can beat.
fn clipped(
    sub: &Subproblem,
    constraints: &Constraints,
    z: &[f64],
    start: &[f64],
    moved: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Option<Vec<f64>> {
    let theta = moved(z);
    let step: Vec<f64> = theta.iter().zip(start).map(|(t, s)| t - s).collect();
    let at_start = sub.value(&vec![0.0; z.len()]);
    let kept = (at_start - sub.value(&step)) / (at_start - sub.value(z));
    (constraints.hold(&theta, TOLERANCE) && kept >= KEPT).then_some(theta)
}

/// The constraints, and where nothing fixes the common scale of all functions, the mean of the mass
/// at its start: without it the equation is solved by no device at all.
fn with_scale_held(problem: &Problem, start: &[f64]) -> Constraints {
    let mut constraints = problem.constraints.clone();
    if !(equation_fixes_scale(problem) || equalities_fix_scale(&constraints, start)) {
        let grid = &problem.oscillator.grid;
        let mut ones = problem.functions.empty_device();
        ones.mass
            .copy_from_slice(&trapezoid_weights(grid.nodes(), grid.step()));
        let row = problem.functions.transpose(&ones);
        let mean: f64 = row.iter().zip(start).map(|(a, s)| a * s).sum();
        let entries = row.into_iter().enumerate().filter(|(_, a)| *a != 0.0);
        let mut group = RowGroup::new("mean of the mass as at the start");
        group.push(
            entries,
            [mean, mean],
            [grid.start(), grid.start() + grid.duration()],
        );
        constraints.groups.push(group);
    }
    constraints
}

/// Whether the equation of motion tells `theta` from `s theta`. Its error is linear in `theta`, and
/// homogeneous unless a force that acts on a record or a fixed function gives it a right-hand side;
/// a force or a function that is zero does not.
fn equation_fixes_scale(problem: &Problem) -> bool {
    let nonzero = |values: &[f64]| values.iter().any(|v| *v != 0.0);
    let fixed = problem.functions.iter().any(|f| nonzero(&f.offset));
    let mut measured = problem
        .experiments
        .iter()
        .filter(|e| !e.channels.is_empty());
    fixed || measured.any(|e| !e.is_free())
}

/// Whether some equality tells `theta` from `s theta`: `a theta = b` does unless `b` is zero. An
/// inequality does not fix the scale, it only bounds it. A `b` that is rounding beside the terms of
/// the row at `start` counts as zero.
fn equalities_fix_scale(constraints: &Constraints, start: &[f64]) -> bool {
    constraints.groups.iter().any(|group| {
        (0..group.rows.len()).any(|i| {
            let [lower, upper] = group.bounds(i);
            let terms = group.rows.row(i).map(|(j, a)| (a * start[j]).abs());
            lower == upper && lower.abs() > TOLERANCE * terms.sum::<f64>()
        })
    })
}

fn add_experiment(
    problem: &Problem,
    experiment: &Experiment,
    motion: &Kinematics,
    start: &[f64],
    sub: &mut Subproblem,
) {
    let assembly = problem.functions.assembly(experiment.device);
    let mut device = problem.functions.empty_device();
    problem
        .functions
        .device_into(start, experiment.device, &mut device);
    let size = |f: &[f64]| f.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let terms = problem.oscillator.terms.iter().zip(&device.coefficients);
    let springs = terms.filter(|(term, _)| **term == Term::Stiffness);
    let springs = springs.map(|(_, k)| size(k) * size(&motion.y));
    let force_scale = springs.fold(size(&device.mass) * size(&motion.a), f64::max)
        / motion.size.max(f64::MIN_POSITIVE);
    let force = experiment
        .excitation
        .as_ref()
        .and_then(|e| e.force.as_ref());
    let base = experiment.excitation.as_ref().and_then(|e| e.base.as_ref());
    let [force, base] = [force, base].map(|part| part.map(Stepwise::at_nodes));
    for (i, &node) in motion.nodes.iter().enumerate() {
        let weight = motion.weight.sqrt() / force_scale;
        let force = force.as_ref().map_or(0.0, |f| f[node]);
        let base = base.as_ref().map_or(0.0, |b| b[node]);
        let terms = problem.oscillator.terms.iter();
        let responses = std::iter::once(motion.a[i] + base)
            .chain(terms.map(|term| term.phi(motion.y[i], motion.v[i])));
        let mut entries = Vec::new();
        let mut error = -force;
        for ((&f, values), response) in assembly.iter().zip(device.functions()).zip(responses) {
            error += values[node] * response;
            let (function, range) = (problem.functions.get(f), &problem.functions.ranges()[f]);
            let row = function.design.row(node);
            entries.extend(row.map(|(j, b)| (range.start + j, weight * b * response)));
        }
        sub.residuals.push(entries, -weight * error);
    }
}

/// `start` with the initial states that are sought taken from the motions, where these begin.
pub(super) fn with_initial_states(
    problem: &Problem,
    start: &[f64],
    motions: &[Option<Kinematics>],
) -> Vec<f64> {
    let mut theta = start.to_vec();
    let first = problem.functions.scalar_range().start;
    for (experiment, motion) in problem.experiments.iter().zip(motions) {
        let Some(state) = motion.as_ref().and_then(|m| m.initial) else {
            continue;
        };
        let values = [state.displacement, state.velocity];
        for (index, value) in experiment.sought.into_iter().zip(values) {
            if let Some(index) = index {
                theta[first + index] = value;
            }
        }
    }
    theta
}
