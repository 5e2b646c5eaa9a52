//! The discrete adjoint: the exact transpose of [`tangent`](super::tangent()), stage by stage.

use super::equation::{EquationOfMotion, Stages};
use crate::simulate::Trajectory;
use crate::system::{
    Excitation, MIDPOINT, Method, NodalCoefficients, RK4, State, System, SystemTangent, Tableau,
};

/// Gradient of a scalar cost of the response with respect to the nodal values of all functions and
/// to the initial state, in the Euclidean inner product of the nodal values.
///
/// `source` holds the derivative of the cost with respect to displacement and velocity at every
/// node; `trajectory` must be the response of `system` under `excitation`. The result is the transpose of
/// [`tangent`](super::tangent()) applied to `source`, to machine precision.
///
/// Per stage, backwards, with `k̄` the multiplier of the stage's increment:
/// `ā = dt k̄_v`, `v̄ = dt k̄_y + ā da/dv`, `ȳ = ā da/dy`; the contributions to the functions are `-ā phi_j/m` and, for the
/// mass, `-ā (a + b'')/m`. Stages are recomputed from the nodes, so memory is two numbers per node.
pub fn discrete_adjoint(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> SystemTangent {
    let equation = EquationOfMotion::new(system, nodal, excitation, trajectory.nodes());
    match system.method {
        Method::Midpoint => sweep(&MIDPOINT, equation, trajectory, source),
        Method::Rk4 => sweep(&RK4, equation, trajectory, source),
    }
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> SystemTangent {
    let nodes = trajectory.displacement.len();
    let mut gradient = NodalCoefficients::zeros(equation.nodal.mass.len(), equation.terms.len());
    let mut adjoint = State {
        displacement: source.displacement[nodes - 1],
        velocity: source.velocity[nodes - 1],
    };
    for i in (0..nodes - 1).rev() {
        let (y, v) = (trajectory.displacement[i], trajectory.velocity[i]);
        let stages = equation.stages(tableau, i, y, v);
        adjoint = step_back(tableau, equation, i, &stages, adjoint, &mut gradient);
        adjoint.displacement += source.displacement[i];
        adjoint.velocity += source.velocity[i];
    }
    SystemTangent {
        nodal: gradient,
        initial: adjoint,
    }
}

/// Advances the adjoint from node `i + 1` to node `i` and adds the step's contribution to the gradient.
#[inline(always)]
fn step_back<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    i: usize,
    stages: &Stages<S>,
    adjoint: State,
    gradient: &mut NodalCoefficients,
) -> State {
    let mut before = adjoint;
    let (mut y_bar, mut v_bar) = ([0.0; S], [0.0; S]);
    for s in (0..S).rev() {
        let mut k_y = tableau.b[s] * adjoint.displacement;
        let mut k_v = tableau.b[s] * adjoint.velocity;
        for r in s + 1..S {
            k_y += tableau.a[r][s] * y_bar[r];
            k_v += tableau.a[r][s] * v_bar[r];
        }
        let position = tableau.position[s];
        let (y, v) = (stages.y[s], stages.v[s]);
        let partials = equation.partials(i, position, y, v);
        let a_bar = equation.dt * k_v;
        y_bar[s] = a_bar * partials.da_dy;
        v_bar[s] = equation.dt * k_y + a_bar * partials.da_dv;
        before.displacement += y_bar[s];
        before.velocity += v_bar[s];

        let factor = -a_bar / partials.mass;
        let inertia = equation.absolute(i, position, stages.a[s]);
        position.spread(&mut gradient.mass, i, factor * inertia);
        for (term, g) in equation.terms.iter().zip(&mut gradient.coefficients) {
            position.spread(g, i, factor * term.phi(y, v));
        }
    }
    before
}
