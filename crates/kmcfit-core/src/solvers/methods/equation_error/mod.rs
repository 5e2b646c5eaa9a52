//! Equation error: residual of the equation of motion with states estimated from the samples.
//!
//! With `y`, `y'`, `y''` from the samples, `m y'' + c y' + k y - f` is linear in the parameters, so with penalties and
//! constraints its least-squares minimum is a convex problem. It needs no starting point and has no local minima of a wrong
//! period, but noise biases it. It serves as a starting point ([`equation_error`]) for a fit that removes the bias, and as a
//! method of its own ([`fit`]) for records that no response from known states and forces reproduces. The method integrates the equation
//! with bump functions where the parameters are few ([`EquationForm`]); the starting point has the equation at every node.

mod balance;
mod bump_lengths;
mod bumps;
mod dense_rows;
mod equation;
mod fit;
mod measured;
mod measurements;
mod missing_terms;
mod outliers;
mod response;
mod restored;
mod robust;
mod rows;
mod widths;

pub use balance::{EquationBalance, EquationShare, equation_balance};
pub use equation::EquationForm;
pub(in crate::solvers) use fit::fit;
pub use missing_terms::{MissingTerm, missing_terms};
pub use rows::{NoEquationRows, equation_rows};

use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::problem::Problem;
use crate::qp::{ConicStatus, Kkt, StageLayout, Subproblem};
use crate::record::{Experiment, Measured, Measurements};
use crate::solvers::linearization::{add_penalties, add_variations};
use crate::solvers::state_estimation::Kinematics;
use crate::solvers::timings::{Timings, timed};
use crate::structure::Law;
use crate::system::Excitation;
use crate::system::NodalCoefficients;
use crate::system::quadrature::trapezoid_weights;
use equation::Equation;

/// Weight of the proximal term towards the start, relative to the equation error; it determines the directions that the
/// equation leaves undetermined.
const PULL: f64 = 1e-9;

/// Tolerances of the minimisation, by the use of its result.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Accuracy {
    /// Starting point of a fit.
    Start,
    /// Result.
    Optimum,
}

impl Accuracy {
    /// Share of its decrease that a plain minimum must keep when moved into the constraints. A starting point need not be
    /// optimal; a result has the accuracy of a quadratic program.
    fn kept(self) -> f64 {
        match self {
            Accuracy::Start => 0.999,
            Accuracy::Optimum => 1.0 - 1e-9,
        }
    }
}

/// Parameters that minimise the equation error, under the penalties and constraints of the problem.
///
/// # Errors
/// Status of the convex program, if it failed.
pub fn equation_error(problem: &Problem, start: &[f64]) -> Result<Vec<f64>, ConicStatus> {
    let kinematics: Vec<Option<Kinematics>> = (problem.experiments.iter())
        .map(|experiment| Kinematics::of(problem, experiment, problem.scalars(start)))
        .collect();
    let start = &with_initial_states(problem, start, &kinematics);
    let mut sub = Subproblem::new(problem.parameters());
    sub.elimination_order = problem.functions.first_nodes();
    sub.layout = StageLayout::of(&problem.functions);
    let mut experiments = Vec::new();
    for (experiment, states) in problem.experiments.iter().zip(&kinematics) {
        experiments.push(states.as_ref().map(|states| {
            let measured = Measured::at_nodes(problem, experiment, states);
            let root = root_weight(problem, experiment, states, start);
            let equation = Equation::pointwise(problem, experiment, &measured);
            let residuals = equation.residuals_at(problem, start);
            equation.add_rows(problem, &residuals, |_| root, &mut sub);
            measured
        }));
    }
    add_penalties(problem, start, &mut sub);
    add_variations(problem, start, &mut sub);
    // The size of a function is that of its start or, where that is zero, the value that balances the equation.
    let own = Measurements::own_sizes(problem, start);
    let natural = Measurements {
        experiments,
        ..Measurements::default()
    };
    let natural = natural.sizes(problem, start);
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

/// Minimum of a convex problem.
struct ConvexMinimum {
    parameters: Vec<f64>,
    /// Status of the quadratic program, if one was needed.
    program: Option<ConicStatus>,
    /// Residuals of the optimality conditions.
    kkt: Option<Kkt>,
    /// Start of the step, and the weights of the proximal term.
    from: Vec<f64>,
    pull: Vec<f64>,
}

impl ConvexMinimum {
    /// Proximal term at `theta`.
    fn pull(&self, theta: &[f64]) -> f64 {
        let steps = theta.iter().zip(&self.from).zip(&self.pull);
        steps
            .map(|((t, from), d)| d * (t - from) * (t - from))
            .sum()
    }
}

/// Minimises `sub`, without constraints of its own, in steps from `start`, under the constraints of the problem. `sub` may
/// have variables after the parameters, computed by `rest`. For a result the quadratic program is scaled by the `sizes` of
/// the functions, which may differ by many orders of magnitude. Work is added to `timings`.
///
/// # Errors
/// Status of the convex program, if it failed.
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
    let plain = timed(&mut timings.linear_algebra, || {
        sub.solve_equality_constrained()
    });
    if let Some(z) = plain {
        let parameters = moved(&z);
        let steps = parameters.iter().zip(start).map(|(t, s)| t - s);
        let step: Vec<f64> = steps.chain(rest(&parameters)).collect();
        let (at_start, least) = (sub.value(&vec![0.0; z.len()]), sub.value(&z));
        // A plain minimum moved into the constraints is used if feasible and nearly as good as the plain one, which is a lower
        // bound of all feasible points.
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

/// Root of the weight of a squared equation error, chosen so that it is comparable with the samples' misfit.
fn root_weight(
    problem: &Problem,
    experiment: &Experiment,
    kinematics: &Kinematics,
    start: &[f64],
) -> f64 {
    let nodal = nodal(problem, experiment, start);
    let size = |f: &[f64]| f.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let terms = problem.system.laws().iter().zip(&nodal.coefficients);
    let springs = terms.filter(|(term, _)| **term == Law::Stiffness);
    let springs = springs.map(|(_, k)| size(k) * size(&kinematics.y));
    let force_scale = springs.fold(size(&nodal.inertias[0]) * size(&kinematics.a), f64::max)
        / kinematics.size.max(f64::MIN_POSITIVE);
    kinematics.weight.sqrt() / force_scale
}

/// Nodal values of an experiment's coefficients at the parameters `theta`.
fn nodal(problem: &Problem, experiment: &Experiment, theta: &[f64]) -> NodalCoefficients {
    let mut nodal = problem.functions.empty_nodal();
    problem
        .functions
        .nodal_into(theta, experiment.coefficient_set, &mut nodal);
    nodal
}

/// Constraints of the problem, plus a fixed mean of the mass where the common scale of all functions is undetermined:
/// otherwise zero coefficients satisfy the equation.
fn with_scale_held(problem: &Problem, start: &[f64]) -> Constraints {
    let mut constraints = problem.constraints.clone();
    if let Some(row) = scale_row(problem, &constraints, start) {
        let grid = &problem.system.grid;
        let mean: f64 = row.iter().map(|(j, a)| a * start[*j]).sum();
        let mut group = RowGroup::new("mean of the mass as at the start");
        group.push(
            row,
            [mean, mean],
            [grid.start(), grid.start() + grid.duration()],
        );
        constraints.groups.push(group);
    }
    constraints
}

/// Row of the integral of the mass over the record, where equation and constraints leave the common scale of all functions
/// undetermined.
fn scale_row(
    problem: &Problem,
    constraints: &Constraints,
    start: &[f64],
) -> Option<Vec<(usize, f64)>> {
    if equation_fixes_scale(problem) || equalities_fix_scale(constraints, start) {
        return None;
    }
    let grid = &problem.system.grid;
    let mut ones = problem.functions.empty_nodal();
    ones.inertias[0].copy_from_slice(&trapezoid_weights(grid.nodes(), grid.step()));
    let row = problem.functions.transpose(&ones).into_iter().enumerate();
    Some(row.filter(|(_, a)| *a != 0.0).collect())
}

/// True if the equation of motion determines the scale of `theta`. Its error is linear in `theta`, and homogeneous unless a
/// nonzero force or a nonzero fixed function contributes a right-hand side.
fn equation_fixes_scale(problem: &Problem) -> bool {
    let nonzero = |values: &[f64]| values.iter().any(|v| *v != 0.0);
    let fixed = (problem.functions.iter()).any(|f| nonzero(&f.offset) || f.prior.is_some());
    let mut measured = problem
        .experiments
        .iter()
        .filter(|e| !e.channels.is_empty());
    // The inertia force `-m b''` of the base scales with the mass.
    let is_forced = |e: &Excitation| e.forces.iter().any(|(_, force)| !force.is_zero());
    fixed || measured.any(|e| e.excitation.as_ref().is_some_and(is_forced))
}

/// True if some equality determines the scale of `theta`: `a theta = b` with nonzero `b`. Inequalities only bound the scale.
/// A `b` below the rounding error of the row's terms at `start` counts as zero.
fn equalities_fix_scale(constraints: &Constraints, start: &[f64]) -> bool {
    constraints.groups.iter().any(|group| {
        (0..group.rows.len()).any(|i| {
            let [lower, upper] = group.bounds(i);
            let terms = group.rows.row(i).map(|(j, a)| (a * start[j]).abs());
            lower == upper && lower.abs() > TOLERANCE * terms.sum::<f64>()
        })
    })
}

/// `start` with estimated initial states set from the kinematics, where these include the first node.
fn with_initial_states(
    problem: &Problem,
    start: &[f64],
    kinematics: &[Option<Kinematics>],
) -> Vec<f64> {
    let mut theta = start.to_vec();
    let first = problem.functions.scalar_range().start;
    for (experiment, measured_states) in problem.experiments.iter().zip(kinematics) {
        let Some(state) = measured_states.as_ref().and_then(|m| m.initial.clone()) else {
            continue;
        };
        let values = [state.displacement(0), state.velocity(0)];
        for (index, value) in experiment.initial_parameters.iter().zip(values) {
            if let Some(index) = index {
                theta[first + index] = value;
            }
        }
    }
    theta
}
