//! Other systems with the very same response.
//!
//! Along a known response `y, v, a` under the force `f` every mass `m(t)` has dampings `c(t)` for which
//!
//! ```text
//! k = (f - m a - c v) / y
//! ```
//!
//! is a stiffness. Where `y` crosses zero, `k` stays finite only if `c = (f - m a)/v` there, so the
//! crossings anchor the damping and leave it free in between. Of all pairs this takes
//!
//! ```text
//! min  1/T integral ((c - c_wish)^2/C^2 + s_c T^2 c'^2/C^2 + s_k T^4 k''^2/K^2) dt
//! s.t. c v + k y = f - m a at every node,   k >= k_min,   c >= c_min (if stated)
//! ```
//!
//! as one quadratic program with both functions as unknowns: at the crossings the equation itself
//! holds the anchor, and nothing is divided by a small `y`. `C` and `K` are the sizes at which damping
//! and stiffness force are as large as the mass's. The pair is that of the continuous equation, so
//! a stepper of order two reproduces the response to the square of its step.

use super::refit::positive_rms;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, Subproblem};
use crate::system::quadrature::trapezoid_weights;
use crate::system::{Grid, NodalCoefficients};

/// Default weights of the slope of c and of the curvature of k: smooth within some thousandths of the
/// record, so that the options comes first between the anchors.
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
    /// `y''`, with that of the base where it moves, m/s^2.
    pub acceleration: Vec<f64>,
    /// `f`, N.
    pub force: Vec<f64>,
}

impl TargetResponse {
    /// The response of experiment `e` of a fit, its acceleration from the equation itself.
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

/// Which of the systems with the response is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct EquivalentOptions {
    /// The damping to be near to, N s/m at the nodes.
    pub damping: Vec<f64>,
    /// Least stiffness, N/m.
    pub least_stiffness: f64,
    /// Least damping, N s/m, if any.
    pub least_damping: Option<f64>,
    /// `s_c` and `s_k`, without unit.
    pub smoothness: [f64; 2],
}

impl EquivalentOptions {
    /// Near to `damping`, with a stiffness of at least `least_stiffness` (N/m).
    pub fn near(damping: Vec<f64>, least_stiffness: f64) -> Self {
        Self {
            damping,
            least_stiffness,
            least_damping: None,
            smoothness: SMOOTHNESS,
        }
    }
}

/// The system with mass `mass` (kg at the nodes), damping near the options, and the stiffness that gives
/// it the response; `Err` says how the program ended where there is none, as where a crossing asks for
/// less damping than the options allows.
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

/// What the crossings of zero anchor: time (s) and damping (N s/m) for the mass `mass`, between
/// nodes by linear interpolation; as far from `c` as the square of the step.
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

/// How far the equation is from holding along the response for `system`, N at the nodes.
pub fn imbalance(nodal: &NodalCoefficients, response: &TargetResponse) -> Vec<f64> {
    let at = |i: usize| {
        nodal.mass[i] * response.acceleration[i]
            + nodal.coefficients[0][i] * response.velocity[i]
            + nodal.coefficients[1][i] * response.displacement[i]
            - response.force[i]
    };
    (0..response.grid.nodes()).map(at).collect()
}
