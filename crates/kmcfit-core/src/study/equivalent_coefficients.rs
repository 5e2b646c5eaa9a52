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
//! The pairs that satisfy the equation of motion at a node form a line in the plane of `c` and `k`. The unknown is the place along
//! each line, so nothing is divided by a small `y`; where the response is at rest (`y = v = 0`), `c` is the target. `C` and `K` are the damping and stiffness whose
//! forces have the size of the inertia force. The pair satisfies the continuous equation of motion; a second-order stepper
//! reproduces the response with an error proportional to the square of its step.

use super::refit::positive_rms;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::qp::{ConicStatus, StageLayout, Subproblem};
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
        let force = excitation.and_then(|x| x.force(0)).map(|f| f.at_nodes());
        let force = force.unwrap_or_else(|| vec![0.0; nodes]);
        let acceleration = |i: usize| {
            let terms = problem.system.laws().iter().zip(&nodal.coefficients);
            let (y, v) = (response.displacement(0)[i], response.velocity(0)[i]);
            let resisting: f64 = terms.map(|(term, p)| p[i] * term.phi(y, v)).sum();
            (force[i] - resisting) / nodal.inertias[0][i]
        };
        let grid = problem.system.grid;
        let length = grid.step() * (nodes - 1) as f64;
        Self {
            grid: Grid::new(grid.start(), length, nodes).unwrap_or(grid),
            displacement: response.displacement(0).to_vec(),
            velocity: response.velocity(0).to_vec(),
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

    let lines: Option<Vec<NodeLine>> = (0..n)
        .map(|i| {
            let forces = [
                large_c * response.velocity[i] / inertia,
                large_k * response.displacement[i] / inertia,
            ];
            NodeLine::new(forces, needed[i] / inertia, options.damping[i] / large_c)
        })
        .collect();
    let lines = lines.ok_or(ConicStatus::Infeasible)?;

    // Unknowns: the place along the line of each node, which leaves no equalities.
    let mut sub = Subproblem::new(n);
    sub.elimination_order = (0..n as u32).collect();
    sub.layout = Some(StageLayout {
        nodes: n,
        histories: std::iter::once(0..n).collect(),
        ..StageLayout::default()
    });
    // Residual `sum a x_q - target` of component `q` at some nodes.
    let mut residual = |q: usize, terms: &[(usize, f64)], target: f64| {
        let known: f64 = terms.iter().map(|(i, a)| a * lines[*i].point[q]).sum();
        let entries = terms.iter().map(|(i, a)| (*i, a * lines[*i].direction[q]));
        sub.residuals.push(entries, target - known);
    };
    let weights = trapezoid_weights(n, step);
    for (i, w) in weights.iter().enumerate() {
        let root = (w / duration).sqrt();
        residual(0, &[(i, root)], root * options.damping[i] / large_c);
    }
    let slope = (options.smoothness[0] * duration / step).sqrt();
    for i in 0..n - 1 {
        residual(0, &[(i, -slope), (i + 1, slope)], 0.0);
    }
    let bend = (options.smoothness[1] * (duration / step).powi(3)).sqrt();
    for i in 1..n - 1 {
        residual(1, &[(i - 1, bend), (i, -2.0 * bend), (i + 1, bend)], 0.0);
    }
    let least_damping = options.least_damping.unwrap_or(f64::NEG_INFINITY);
    let least = [least_damping / large_c, options.least_stiffness / large_k];
    for (i, line) in lines.iter().enumerate() {
        let [lower, upper] = line.interval(least).ok_or(ConicStatus::Infeasible)?;
        sub.bound([(i, 1.0)], lower, upper);
    }
    let solution = sub.solve();
    if !solution.status.is_point() {
        return Err(solution.status);
    }
    let component = |q: usize, size: f64| {
        let positions = lines.iter().zip(&solution.z);
        positions.map(|(line, t)| line.at(*t)[q] * size).collect()
    };
    Ok(NodalCoefficients {
        inertias: vec![mass.to_vec()],
        coefficients: vec![component(0, large_c), component(1, large_k)],
    })
}

/// The pairs `x = (c/C, k/K)` that satisfy the equation of motion at a node: `x = point + t direction`, with a unit `direction`.
struct NodeLine {
    point: [f64; 2],
    direction: [f64; 2],
}

impl NodeLine {
    /// Solutions of `forces . x = needed`; where the response is at rest, those with the target damping. `None` if there are none.
    fn new(forces: [f64; 2], needed: f64, target: f64) -> Option<Self> {
        let size = forces[0].hypot(forces[1]);
        if size == 0.0 {
            return (needed == 0.0).then_some(Self {
                point: [target, 0.0],
                direction: [0.0, 1.0],
            });
        }
        let normal = forces.map(|f| f / size);
        Some(Self {
            point: normal.map(|x| x * (needed / size)),
            direction: [-normal[1], normal[0]],
        })
    }

    /// The pair at `t`.
    fn at(&self, t: f64) -> [f64; 2] {
        [0, 1].map(|q| self.point[q] + t * self.direction[q])
    }

    /// Interval of `t` in which each component is at least `least`; `None` if it is empty.
    fn interval(&self, least: [f64; 2]) -> Option<[f64; 2]> {
        let [mut lower, mut upper] = [f64::NEG_INFINITY, f64::INFINITY];
        for (q, least) in least.into_iter().enumerate() {
            let missing = least - self.point[q];
            match self.direction[q] {
                slope if slope > 0.0 => lower = lower.max(missing / slope),
                slope if slope < 0.0 => upper = upper.min(missing / slope),
                _ if missing > 0.0 => return None,
                _ => {}
            }
        }
        (lower <= upper).then_some([lower, upper])
    }
}
