//! The discrete adjoint: the exact transpose of [`Oscillator::tangent`], stage by stage.

use super::in_lanes;
use crate::dynamics::blocks::LinearDevice;
use crate::dynamics::stages::{Rhs, Stages};
use crate::dynamics::tableau::{MIDPOINT, RK4, Tableau};
use crate::dynamics::{
    Device, DeviceTangent, Excitation, Method, Oscillator, Slopes, State, Trajectory,
};

/// Gradient of a scalar cost of the motion with respect to the nodal values of all functions and
/// to the initial state, in the Euclidean inner product of the nodal values.
///
/// `source` holds the derivative of the cost with respect to displacement and velocity at every
/// node; `trajectory` must be the motion of `device` under `excitation`. The result is the transpose of
/// [`Oscillator::tangent`] applied to `source`, to rounding.
///
/// Per stage, backwards, with `k̄` the multiplier of the stage's increment:
/// `ā = dt k̄_v`, `v̄ = dt k̄_y + ā da/dv`, `ȳ = ā da/dy`, and `-ā phi_j/m`, `-ā (a + b'')/m` go to the
/// functions. The stages are computed again from the nodes, so memory is two numbers a node.
///
/// Linear free motion by the midpoint rule goes back in eight blocks of the record at once; the
/// steps of forced or nonlinear motion are linearised eight at a time.
pub fn gradient(
    oscillator: &Oscillator,
    device: &Device,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> DeviceTangent {
    let nodes = trajectory.nodes();
    if let Some(linear) = LinearDevice::of(oscillator, device, excitation, nodes) {
        let mut gradient = Device::zeros(device.mass.len(), oscillator.terms.len());
        let initial = linear.gradient(trajectory, source, &mut gradient);
        if initial.displacement.is_finite() && initial.velocity.is_finite() {
            return DeviceTangent {
                device: gradient,
                initial,
            };
        }
    }
    let rhs = oscillator.rhs(device, excitation, nodes);
    if !oscillator.is_linear_and_free(excitation) {
        let gradient = in_lanes::gradient(rhs, oscillator.method, trajectory, source);
        if gradient.is_finite() {
            return gradient;
        }
    }
    gradient_in_order(oscillator, device, excitation, trajectory, source)
}

/// The sums over the nodes of [`gradient`], all that constants ask for, and its initial state. `None` where
/// [`gradient`] has another way: for linear free motion, and where numbers leave their range.
pub(crate) fn sums(
    oscillator: &Oscillator,
    device: &Device,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> Option<(Vec<f64>, State)> {
    (!oscillator.is_linear_and_free(excitation)).then_some(())?;
    let rhs = oscillator.rhs(device, excitation, trajectory.nodes());
    let mut sums = vec![0.0; 1 + oscillator.terms.len()];
    let gradient = Slopes::Summed(&mut sums);
    let initial = in_lanes::back(rhs, oscillator.method, trajectory, source, gradient);
    let State {
        displacement,
        velocity,
    } = initial;
    let is_finite = displacement.is_finite() && velocity.is_finite();
    (is_finite && sums.iter().all(|x| x.is_finite())).then_some((sums, initial))
}

/// [`gradient`], one step after the other whatever the device.
pub fn gradient_in_order(
    oscillator: &Oscillator,
    device: &Device,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> DeviceTangent {
    let rhs = oscillator.rhs(device, excitation, trajectory.nodes());
    match oscillator.method {
        Method::Midpoint => sweep(&MIDPOINT, rhs, trajectory, source),
        Method::Rk4 => sweep(&RK4, rhs, trajectory, source),
    }
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    rhs: Rhs,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> DeviceTangent {
    let nodes = trajectory.displacement.len();
    let mut gradient = Device::zeros(rhs.device.mass.len(), rhs.terms.len());
    let mut adjoint = State {
        displacement: source.displacement[nodes - 1],
        velocity: source.velocity[nodes - 1],
    };
    for i in (0..nodes - 1).rev() {
        let (y, v) = (trajectory.displacement[i], trajectory.velocity[i]);
        let stages = rhs.stages(tableau, i, y, v);
        adjoint = step_back(tableau, rhs, i, &stages, adjoint, &mut gradient);
        adjoint.displacement += source.displacement[i];
        adjoint.velocity += source.velocity[i];
    }
    DeviceTangent {
        device: gradient,
        initial: adjoint,
    }
}

/// Carries the adjoint from node `i + 1` to node `i` and adds the step's share to the gradient.
#[inline(always)]
fn step_back<const S: usize>(
    tableau: &Tableau<S>,
    rhs: Rhs,
    i: usize,
    stages: &Stages<S>,
    adjoint: State,
    gradient: &mut Device,
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
        let slopes = rhs.slopes(i, position, y, v);
        let a_bar = rhs.dt * k_v;
        y_bar[s] = a_bar * slopes.da_dy;
        v_bar[s] = rhs.dt * k_y + a_bar * slopes.da_dv;
        before.displacement += y_bar[s];
        before.velocity += v_bar[s];

        let push = -a_bar / slopes.mass;
        let inertia = rhs.absolute(i, position, stages.a[s]);
        position.spread(&mut gradient.mass, i, push * inertia);
        for (term, g) in rhs.terms.iter().zip(&mut gradient.coefficients) {
            position.spread(g, i, push * term.phi(y, v));
        }
    }
    before
}
