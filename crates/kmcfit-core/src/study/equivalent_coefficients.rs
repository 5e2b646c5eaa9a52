//! Coefficients with the same response as a given system: for a chosen mass, damping and stiffness by a quadratic program.
//!
//! Given a response `y, v, a` (m, m/s, m/s^2) under the force `f` (N), every mass `m(t)` and damping `c(t)` define a
//! stiffness
//!
//! ```text
//! k = (f - m a - c v) / y
//! ```
//!
//! At a zero crossing of `y`, `k` is finite only if `c = (f - m a)/v`: the crossings fix the damping there. Among all pairs
//! `(c, k)` the program selects
//!
//! ```text
//! min  1/T integral ((c - c_target)^2/C^2 + s_c T^2 c'^2/C^2 + s_k T^4 k''^2/K^2) dt
//! s.t. c v + k y = f - m a at every node,   k >= k_min,   c >= c_min (if stated)
//! ```
//!
//! Both functions are unknowns, so nothing is divided by a small `y`. `C` and `K` are the damping and stiffness whose
//! forces have the size of the inertia force. The pair satisfies the continuous equation of motion; a second-order stepper
//! reproduces the response with an error proportional to the square of its step.

use super::refit::positive_rms;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, Subproblem};
use crate::system::quadrature::trapezoid_weights;
use crate::system::{Grid, NodalCoefficients};

/// Default `s_c` and `s_k`: smoothing over some thousandths of the record, so that the target damping dominates between
/// zero crossings.
const SMOOTHNESS: [f64; 2] = [1e-5, 1e-9];

/// A response at the nodes of a grid, and the force that drives it.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetResponse {
    /// The nodes.
    pub grid: Grid,
    /// `y`, m.
    pub displacement: Vec<f64>,
    /// `y'`, m/s.
    pub velocity: Vec<f64>,
    /// `y''`, with the acceleration of the base added under base excitation, m/s^2.
    pub acceleration: Vec<f64>,
    /// `f`, N.
    pub force: Vec<f64>,
}

impl TargetResponse {
    /// The response of experiment `e` of a fit; accelerations follow from the equation of motion.
    pub fn of(problem: &Problem, evaluation: &Evaluation, e: usize) -> Self {
        let experiment = &problem.experiments[e];
        let nodal = evaluation.nodal_of(experiment.coefficient_set);
        let response = &evaluation.trajectories[e];
        let nodes = experiment.nodes;
        let excitation = experiment.excitation.as_ref();
        let force = excitation
            .and_then(|x| x.force.as_ref())
            .map(|f| f.at_nodes());
        let force = force.unwrap_or_else(|| vec![0.0; nodes]);
        let acceleration = |i: usize| {
            let terms = problem.system.terms.iter().zip(&nodal.coefficients);
            let (y, v) = (response.displacement[i], response.velocity[i]);
            let resisting: f64 = terms.map(|(term, p)| p[i] * term.phi(y, v)).sum();
            (force[i] - resisting) / nodal.mass[i]
        };
        let grid = problem.system.grid;
        let length = grid.step() * (nodes - 1) as f64;
        Self {
            grid: Grid::new(grid.start(), length, nodes).unwrap_or(grid),
            displacement: response.displacement.clone(),
            velocity: response.velocity.clone(),
            acceleration: (0..nodes).map(acceleration).collect(),
            force,
        }
    }
}

/// Selection among the systems with the same response.
#[derive(Debug, Clone, PartialEq)]
pub struct EquivalentOptions {
    /// Target damping, N s/m at the nodes.
    pub damping: Vec<f64>,
    /// Lower bound of the stiffness, N/m.
    pub least_stiffness: f64,
    /// Lower bound of the damping, N s/m, if any.
    pub least_damping: Option<f64>,
    /// Weights `s_c` and `s_k`, dimensionless.
    pub smoothness: [f64; 2],
}

impl EquivalentOptions {
    /// Target `damping` and a stiffness of at least `least_stiffness` (N/m).
    pub fn near(damping: Vec<f64>, least_stiffness: f64) -> Self {
        Self {
            damping,
            least_stiffness,
            least_damping: None,
            smoothness: SMOOTHNESS,
        }
    }
}

/// Coefficients with mass `mass` (kg at the nodes), damping close to the target, and the stiffness that reproduces the
/// response; `Err` holds the status of the program where none exist, for example where a zero crossing requires a damping
/// below its lower bound.
///
/// # Panics
/// If mass, response and options do not have one value per node.
pub fn equivalent_coefficients(
    mass: &[f64],
    response: &TargetResponse,
    options: &EquivalentOptions,
) -> Result<NodalCoefficients, ConicStatus> {
    let n = response.grid.nodes();
    let lengths = [
        mass.len(),
        response.displacement.len(),
        options.damping.len(),
    ];
    assert_eq!(lengths, [n; 3], "one value per node");
    let step = response.grid.step();
    let duration = response.grid.duration();
    let needed: Vec<f64> = (0..n)
        .map(|i| response.force[i] - mass[i] * response.acceleration[i])
        .collect();
    let inertia = positive_rms(&needed);
    let over = |f: &[f64]| inertia / positive_rms(f);
    let [large_c, large_k] = [over(&response.velocity), over(&response.displacement)];

    // Unknowns: c/C at the nodes, then k/K.
    let mut sub = Subproblem::new(2 * n);
    let weights = trapezoid_weights(n, step);
    for (i, w) in weights.iter().enumerate() {
        let root = (w / duration).sqrt();
        sub.residuals
            .push([(i, root)], root * options.damping[i] / large_c);
    }
    let slope = (options.smoothness[0] * duration / step).sqrt();
    for i in 0..n - 1 {
        sub.residuals.push([(i, -slope), (i + 1, slope)], 0.0);
    }
    let bend = (options.smoothness[1] * (duration / step).powi(3)).sqrt();
    for i in n + 1..2 * n - 1 {
        sub.residuals
            .push([(i - 1, bend), (i, -2.0 * bend), (i + 1, bend)], 0.0);
    }
    for (i, needed) in needed.iter().enumerate() {
        let row = [
            (i, large_c * response.velocity[i] / inertia),
            (n + i, large_k * response.displacement[i] / inertia),
        ];
        sub.equalities.push(row, needed / inertia);
        sub.bound(
            [(n + i, 1.0)],
            options.least_stiffness / large_k,
            f64::INFINITY,
        );
        if let Some(least) = options.least_damping {
            sub.bound([(i, 1.0)], least / large_c, f64::INFINITY);
        }
    }
    let solution = sub.solve();
    match solution.status {
        status if status.is_point() => {
            let scaled = |part: &[f64], size: f64| part.iter().map(|x| x * size).collect();
            Ok(NodalCoefficients {
                mass: mass.to_vec(),
                coefficients: vec![
                    scaled(&solution.z[..n], large_c),
                    scaled(&solution.z[n..], large_k),
                ],
            })
        }
        status => Err(status),
    }
}

/// Zero crossings of the displacement: time (s) and the damping (N s/m) that the mass `mass` requires there, by linear
/// interpolation between nodes; second-order accurate in the step.
pub fn anchors(mass: &[f64], response: &TargetResponse) -> Vec<(f64, f64)> {
    let y = &response.displacement;
    let at = |i: usize, share: f64, f: &dyn Fn(usize) -> f64| f(i) + share * (f(i + 1) - f(i));
    let crossing = |i: usize| {
        (y[i] * y[i + 1] <= 0.0 && y[i] != y[i + 1] && y[i + 1] != 0.0).then(|| {
            let share = y[i] / (y[i] - y[i + 1]);
            let force = at(i, share, &|i| {
                response.force[i] - mass[i] * response.acceleration[i]
            });
            let velocity = at(i, share, &|i| response.velocity[i]);
            let time = response.grid.time(i) + share * response.grid.step();
            (time, force / velocity)
        })
    };
    (0..y.len() - 1).filter_map(crossing).collect()
}

/// Residual of the equation of motion along the response, `m a + c v + k y - f`, N at the nodes.
pub fn imbalance(nodal: &NodalCoefficients, response: &TargetResponse) -> Vec<f64> {
    let at = |i: usize| {
        nodal.mass[i] * response.acceleration[i]
            + nodal.coefficients[0][i] * response.velocity[i]
            + nodal.coefficients[1][i] * response.displacement[i]
            - response.force[i]
    };
    (0..response.grid.nodes()).map(at).collect()
}
