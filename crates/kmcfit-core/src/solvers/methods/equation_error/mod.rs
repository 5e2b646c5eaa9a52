//! The equation error: smoothed samples put into the equation of motion.
//!
//! With `y`, `y'`, `y''` from the samples, `m y'' + c y' + k y - f` is linear in the parameters, so
//! penalties and constraints make it one convex problem. It needs no start and knows no local minima
//! of a wrong period; noise biases it. It is a start ([`equation_error`]) for a fit that removes the
//! bias, and a method of its own ([`fit`]) for records that no response from known states and forces
//! explains.

mod fit;
mod measured;

pub(in crate::solvers) use fit::fit;
pub use measured::Measurements;

use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::problem::Problem;
use crate::qp::{ConicStatus, Kkt, Subproblem};
use crate::record::Experiment;
use crate::solvers::linearization::{add_penalties, add_variations};
use crate::solvers::state_estimation::Kinematics;
use crate::solvers::timings::{Timings, timed};
use crate::system::quadrature::trapezoid_weights;
use crate::system::{NodalCoefficients, Term, TimePoint};
use measured::Measured;

/// A pull towards the start, relative to the equation's own weight: it decides what the equation
/// leaves open and nothing else.
const PULL: f64 = 1e-9;

/// What a minimum is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Accuracy {
    /// To start a fit.
    Start,
    /// For its own sake.
    Optimum,
}

impl Accuracy {
    /// A plain minimum moved into the constraints is used if it keeps this share of its decrease: a
    /// fit that follows needs no optimum, and an optimum has the accuracy to which programs are solved.
    fn kept(self) -> f64 {
        match self {
            Accuracy::Start => 0.999,
            Accuracy::Optimum => 1.0 - 1e-9,
        }
    }
}

/// Parameters from the equation error, under the problem's penalties and constraints.
///
/// # Errors
/// How the convex problem ended, if not with a solution.
pub fn equation_error(problem: &Problem, start: &[f64]) -> Result<Vec<f64>, ConicStatus> {
    let kinematics: Vec<Option<Kinematics>> = (problem.experiments.iter())
        .map(|experiment| Kinematics::of(problem, experiment, problem.scalars(start)))
        .collect();
    from_kinematics(problem, start, &kinematics)
}

/// [`equation_error`] with the response of each experiment.
pub(in crate::solvers) fn from_kinematics(
    problem: &Problem,
    start: &[f64],
    kinematics: &[Option<Kinematics>],
) -> Result<Vec<f64>, ConicStatus> {
    let start = &with_initial_states(problem, start, kinematics);
    let mut sub = Subproblem::new(problem.parameters());
    sub.stations = problem.functions.first_nodes();
    let mut experiments = Vec::new();
    for (experiment, states) in problem.experiments.iter().zip(kinematics) {
        experiments.push(states.as_ref().map(|states| {
            let measured = Measured::at_nodes(problem, experiment, states);
            let root = root_weight(problem, experiment, states, start);
            add_rows(problem, experiment, &measured, root, start, &mut sub);
            measured
        }));
    }
    add_penalties(problem, start, &mut sub);
    add_variations(problem, start, &mut sub);
    // The size of a function is that of its start, or where that is zero the one that it would need.
    let own = Measurements::own_sizes(problem, start);
    let natural = Measurements { experiments }.sizes(problem, start);
    let either = |(own, natural): (f64, f64)| if own > 0.0 { own } else { natural };
    let sizes: Vec<f64> = own.into_iter().zip(natural).map(either).collect();
    let minimum = minimise(
        problem,
        sub,
        start,
        &sizes,
        Accuracy::Start,
        &|_| Vec::new(),
        &mut Timings::default(),
    )?;
    Ok(minimum.parameters)
}

/// The minimum of a convex problem.
struct ConvexMinimum {
    parameters: Vec<f64>,
    /// How the quadratic program ended, if one was needed.
    program: Option<ConicStatus>,
    /// The residuals of its optimality conditions.
    kkt: Option<Kkt>,
    /// Where the step began, and the weights of the pull towards there.
    from: Vec<f64>,
    pull: Vec<f64>,
}

impl ConvexMinimum {
    /// What the pull adds to the cost at `theta`.
    fn pull(&self, theta: &[f64]) -> f64 {
        let steps = theta.iter().zip(&self.from).zip(&self.pull);
        steps
            .map(|((t, from), d)| d * (t - from) * (t - from))
            .sum()
    }
}

/// Minimises `sub`, which has no constraints yet, in steps from `start`, under those of the problem.
/// `sub` may have variables after the parameters: `rest` tells them for given parameters. For an
/// optimum a quadratic program is solved in units of the `sizes` of the functions, which it needs where
/// these differ by many orders. What was solved adds to `timings`.
///
/// # Errors
/// How the convex problem ended, if not with a solution.
fn minimise(
    problem: &Problem,
    mut sub: Subproblem,
    start: &[f64],
    sizes: &[f64],
    accuracy: Accuracy,
    rest: &dyn Fn(&[f64]) -> Vec<f64>,
    timings: &mut Timings,
) -> Result<ConvexMinimum, ConicStatus> {
    let constraints = with_scale_held(problem, start);
    sub.constrain(&constraints, start);
    let duration = problem.system.grid.duration();
    let metric = problem.functions.relative_metric(sizes, duration);
    let weight = PULL * sub.value(&vec![0.0; sub.variables]).max(f64::MIN_POSITIVE);
    for (proximal, m) in sub.proximal.iter_mut().zip(&metric) {
        *proximal = m * weight;
    }
    let pull: Vec<f64> = metric.iter().map(|m| m * weight).collect();
    let moved = |z: &[f64]| problem.constraints.moved(start, z);
    let plain = timed(&mut timings.linear_algebra, || sub.solve_plain());
    if let Some(z) = plain {
        let parameters = moved(&z);
        let steps = parameters.iter().zip(start).map(|(t, s)| t - s);
        let step: Vec<f64> = steps.chain(rest(&parameters)).collect();
        let (at_start, least) = (sub.value(&vec![0.0; z.len()]), sub.value(&z));
        // Moved into the constraints it is used if they hold there and it is nearly as good as the
        // plain one, which no point in them can beat.
        let enough =
            sub.value(&step) - least <= (1.0 - accuracy.kept()) * (at_start - least).max(0.0);
        if constraints.hold(&parameters, TOLERANCE) && enough {
            return Ok(ConvexMinimum {
                parameters,
                program: None,
                kkt: None,
                from: start.to_vec(),
                pull,
            });
        }
    }
    let mut units = vec![1.0; sub.variables];
    if accuracy == Accuracy::Optimum {
        for (range, size) in problem.functions.ranges().iter().zip(sizes) {
            units[range.clone()].fill(if *size > 0.0 { *size } else { 1.0 });
        }
    }
    let mut solution = timed(&mut timings.qp, || sub.in_units(&units).solve());
    let z = solution.z.iter_mut().zip(&units);
    z.for_each(|(z, unit)| *z *= unit);
    match solution.status {
        status if status.is_point() => Ok(ConvexMinimum {
            parameters: moved(&solution.z),
            program: Some(status),
            kkt: solution.kkt,
            from: start.to_vec(),
            pull,
        }),
        status => Err(status),
    }
}

/// Root of the weight of a squared error of the equation, so that it counts as the samples would.
fn root_weight(
    problem: &Problem,
    experiment: &Experiment,
    kinematics: &Kinematics,
    start: &[f64],
) -> f64 {
    let nodal = nodal(problem, experiment, start);
    let size = |f: &[f64]| f.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let terms = problem.system.terms.iter().zip(&nodal.coefficients);
    let springs = terms.filter(|(term, _)| **term == Term::Stiffness);
    let springs = springs.map(|(_, k)| size(k) * size(&kinematics.y));
    let force_scale = springs.fold(size(&nodal.mass) * size(&kinematics.a), f64::max)
        / kinematics.size.max(f64::MIN_POSITIVE);
    kinematics.weight.sqrt() / force_scale
}

/// The system of an experiment for the parameters `theta`.
fn nodal(problem: &Problem, experiment: &Experiment, theta: &[f64]) -> NodalCoefficients {
    let mut nodal = problem.functions.empty_nodal();
    problem
        .functions
        .nodal_into(theta, experiment.coefficient_set, &mut nodal);
    nodal
}

/// The equation's errors, each times `root`, as residuals in the steps from `start`.
fn add_rows(
    problem: &Problem,
    experiment: &Experiment,
    measured: &Measured,
    root: f64,
    start: &[f64],
    sub: &mut Subproblem,
) {
    let functions = &problem.functions;
    let assembly = functions.coefficient_set(experiment.coefficient_set);
    let errors = measured.errors(problem, &nodal(problem, experiment, start));
    for (i, (&TimePoint { step, fraction }, error)) in
        measured.places.iter().zip(errors).enumerate()
    {
        let mut entries = Vec::new();
        for (which, &f) in assembly.iter().enumerate() {
            let first = functions.ranges()[f].start;
            let response = measured.response(problem, which, i);
            for (side, share) in [1.0 - fraction, fraction].into_iter().enumerate() {
                if share != 0.0 {
                    let row = functions.get(f).design.row(step + side);
                    entries.extend(row.map(|(j, b)| (first + j, root * b * response * share)));
                }
            }
        }
        sub.residuals.push(entries, -root * error);
    }
}

/// The constraints, and where nothing fixes the common scale of all functions, the mean of the mass
/// at its start: without it the equation is solved by no system at all.
fn with_scale_held(problem: &Problem, start: &[f64]) -> Constraints {
    let mut constraints = problem.constraints.clone();
    if !(equation_fixes_scale(problem) || equalities_fix_scale(&constraints, start)) {
        let grid = &problem.system.grid;
        let mut ones = problem.functions.empty_nodal();
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
    // The base pushes with `-m b''`, which grows with the mass.
    let force = |e: &Experiment| e.excitation.as_ref().and_then(|e| e.force.clone());
    fixed || measured.any(|e| force(e).is_some_and(|f| !f.is_zero()))
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

/// `start` with the initial states that are estimated taken from the responses, where these begin.
pub(in crate::solvers) fn with_initial_states(
    problem: &Problem,
    start: &[f64],
    kinematics: &[Option<Kinematics>],
) -> Vec<f64> {
    let mut theta = start.to_vec();
    let first = problem.functions.scalar_range().start;
    for (experiment, measured_states) in problem.experiments.iter().zip(kinematics) {
        let Some(state) = measured_states.as_ref().and_then(|m| m.initial) else {
            continue;
        };
        let values = [state.displacement, state.velocity];
        for (index, value) in experiment.initial_parameters.into_iter().zip(values) {
            if let Some(index) = index {
                theta[first + index] = value;
            }
        }
    }
    theta
}
