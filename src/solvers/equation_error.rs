//! The equation-error start: smoothed readings put into the equation of motion.
//!
//! With `y`, `y'`, `y''` from the readings, `m y'' + c y' + k y - f` is linear in the parameters, so
//! penalties and constraints make it one convex problem. It needs no start and knows no local minima
//! of a wrong period; noise biases it, which the fit that follows removes.

use super::gauss_newton::{add_penalties, add_variations};
use crate::constraints::{Constraints, RowGroup, TOLERANCE};
use crate::dynamics::quadrature::trapezoid_weights;
use crate::objective::{Readings, Weighting};
use crate::problem::{Experiment, Problem};
use crate::qp::{ConicStatus, Subproblem};

/// Rounds of the search for the smoothing weight: each halves its decimal exponent's interval.
const ROUNDS: u32 = 14;
/// Decimal exponents of the smoothing weight between no smoothing and a parabola.
const EXPONENTS: [f64; 2] = [-12.0, 16.0];
/// A pull towards the start, relative to the equation's own weight: it decides what the equation
/// leaves open and nothing else.
const PULL: f64 = 1e-9;

/// A clipped solution is used if it keeps this share of the plain one's decrease: the fit that
/// follows needs a start, not an optimum.
const KEPT: f64 = 0.999;
/// Readings whose noise is below this share of their size are taken as they are.
const NOISELESS: f64 = 1e-6;

/// Displacement, velocity and acceleration at the readings but the two at each end.
struct Kinematics {
    first: usize,
    y: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
}

/// Parameters from the equation error, under the problem's penalties and constraints.
///
/// # Errors
/// How the convex problem ended, if not with a solution.
pub fn equation_error(problem: &Problem, start: &[f64]) -> Result<Vec<f64>, ConicStatus> {
    let mut sub = Subproblem::new(problem.functions.parameters());
    for experiment in &problem.experiments {
        add_experiment(problem, experiment, start, &mut sub);
    }
    add_penalties(problem, start, &mut sub);
    add_variations(problem, start, &mut sub);
    let held = with_scale_held(problem, start);
    sub.constrain(&held, start);
    let sizes: Vec<f64> = (problem.functions.device(start).functions())
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
    let measured = problem.experiments.iter().filter(|e| e.readings.is_some());
    let mut forces = measured.filter_map(|e| e.force.as_deref());
    fixed || forces.any(nonzero)
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

fn add_experiment(problem: &Problem, experiment: &Experiment, start: &[f64], sub: &mut Subproblem) {
    let Some(readings) = &experiment.readings else {
        return;
    };
    let spacing = problem.oscillator.grid.step() * readings.stride() as f64;
    let Some(motion) = kinematics(readings, spacing) else {
        return;
    };
    let device = problem.functions.device(start);
    let size = |f: &[f64]| f.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let force_scale = (size(&device.mass) * size(&motion.a))
        .max(size(&device.coefficients[1]) * size(&motion.y))
        / size(&motion.y).max(f64::MIN_POSITIVE);
    for i in 0..motion.y.len() {
        let node = (motion.first + i) * readings.stride();
        let weight = readings.weight(motion.first + i).sqrt() / force_scale;
        let force = experiment.force.as_ref().map_or(0.0, |f| f[node]);
        let terms = problem.oscillator.terms.iter();
        let responses = std::iter::once(motion.a[i])
            .chain(terms.map(|term| term.phi(motion.y[i], motion.v[i])));
        let mut entries = Vec::new();
        let mut error = -force;
        let parts = problem.functions.iter().zip(problem.functions.ranges());
        for (((function, range), values), response) in parts.zip(device.functions()).zip(responses)
        {
            error += values[node] * response;
            let row = function.design.row(node);
            entries.extend(row.map(|(j, b)| (range.start + j, weight * b * response)));
        }
        sub.residuals.push(entries, -weight * error);
    }
}

/// Smoothed readings and their derivatives by differences of order 4; `None` for too few readings.
fn kinematics(readings: &Readings, spacing: f64) -> Option<Kinematics> {
    let y = smoothed(readings)?;
    let h = spacing;
    let each = |f: &dyn Fn(&[f64]) -> f64| y.windows(5).map(f).collect::<Vec<f64>>();
    Some(Kinematics {
        first: 2,
        v: each(&|w| (w[0] - 8.0 * w[1] + 8.0 * w[3] - w[4]) / (12.0 * h)),
        a: each(&|w| (-w[0] + 16.0 * w[1] - 30.0 * w[2] + 16.0 * w[3] - w[4]) / (12.0 * h * h)),
        y: each(&|w| w[2]),
    })
}

/// The smoothest curve (third differences) whose distance from the readings is their noise.
fn smoothed(readings: &Readings) -> Option<Vec<f64>> {
    let observed = readings.values();
    if observed.len() < 8 {
        return None;
    }
    let noise = match readings.weighting() {
        Weighting::Sigma(sigma) => sigma,
        Weighting::Integral { .. } => noise_level(observed),
    };
    let size = observed.iter().map(|y| y * y).sum::<f64>() / observed.len() as f64;
    if noise <= NOISELESS * size.sqrt() {
        return Some(observed.to_vec());
    }
    let [mut low, mut high] = EXPONENTS;
    let mut best = observed.to_vec();
    for _ in 0..ROUNDS {
        let middle = 0.5 * (low + high);
        let candidate = smooth(observed, 10f64.powf(middle))?;
        let pairs = candidate.iter().zip(observed);
        let mean_square =
            pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / observed.len() as f64;
        if mean_square.sqrt() <= noise {
            (low, best) = (middle, candidate);
        } else {
            high = middle;
        }
    }
    Some(best)
}

/// Standard deviation of the noise from fourth differences, which a smooth motion hardly has: their
/// variance is 70 times that of white noise.
fn noise_level(observed: &[f64]) -> f64 {
    let fourth = observed
        .windows(5)
        .map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]);
    let squares: f64 = fourth.map(|d| d * d).sum();
    (squares / (70.0 * (observed.len() - 4) as f64)).sqrt()
}

/// Minimises `|y - observed|^2 + weight |third differences of y|^2`.
fn smooth(observed: &[f64], weight: f64) -> Option<Vec<f64>> {
    let mut sub = Subproblem::new(observed.len());
    for (i, y) in observed.iter().enumerate() {
        sub.residuals.push([(i, 1.0)], *y);
    }
    let root = weight.sqrt();
    for i in 0..observed.len() - 3 {
        let row = [
            (i, -root),
            (i + 1, 3.0 * root),
            (i + 2, -3.0 * root),
            (i + 3, root),
        ];
        sub.residuals.push(row, 0.0);
    }
    sub.solve_plain()
}
