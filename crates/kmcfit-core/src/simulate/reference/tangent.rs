//! Tangent: directional derivative of the forward solve.

use super::equation::{EquationOfMotion, Stages, advance};
use crate::simulate::Trajectory;
use crate::system::{
    Excitation, MIDPOINT, Method, NodalCoefficients, RK4, System, SystemTangent, Tableau,
};

/// Directional derivative of [`forward`](super::forward()) at `trajectory` (the response of `system` under `excitation`)
/// along `direction`: change of displacement and velocity, exact for the discrete response.
pub fn tangent(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    direction: &SystemTangent,
) -> Trajectory {
    let equation = EquationOfMotion::new(system, nodal, excitation, trajectory.nodes());
    match system.method {
        Method::Midpoint => sweep(&MIDPOINT, equation, trajectory, direction),
        Method::Rk4 => sweep(&RK4, equation, trajectory, direction),
    }
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    trajectory: &Trajectory,
    direction: &SystemTangent,
) -> Trajectory {
    let nodes = trajectory.displacement.len();
    let mut out = Trajectory::zeros(nodes);
    let (mut dy, mut dv) = (direction.initial.displacement, direction.initial.velocity);
    (out.displacement[0], out.velocity[0]) = (dy, dv);
    for i in 0..nodes - 1 {
        let (y, v) = (trajectory.displacement[i], trajectory.velocity[i]);
        let base = equation.stages(tableau, i, y, v);
        let change = stage_changes(tableau, equation, &direction.nodal, i, &base, dy, dv);
        (dy, dv) = advance(tableau, equation.dt, &change, dy, dv);
        (out.displacement[i + 1], out.velocity[i + 1]) = (dy, dv);
    }
    out
}

#[inline(always)]
fn stage_changes<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    direction: &NodalCoefficients,
    i: usize,
    base: &Stages<S>,
    dy: f64,
    dv: f64,
) -> Stages<S> {
    let mut change = Stages {
        y: [dy; S],
        v: [dv; S],
        a: [0.0; S],
    };
    for s in 0..S {
        let position = tableau.position[s];
        for r in 0..s {
            let a = tableau.a[s][r];
            change.y[s] += equation.dt * change.v[r] * a;
            change.v[s] += equation.dt * change.a[r] * a;
        }
        let partials = equation.partials(i, position, base.y[s], base.v[s]);
        let inertia = equation.absolute(i, position, base.a[s]);
        let mut force = -position.of(&direction.mass, i) * inertia;
        for (term, dp) in equation.terms.iter().zip(&direction.coefficients) {
            force -= position.of(dp, i) * term.phi(base.y[s], base.v[s]);
        }
        change.a[s] =
            force / partials.mass + partials.da_dy * change.y[s] + partials.da_dv * change.v[s];
    }
    change
}
