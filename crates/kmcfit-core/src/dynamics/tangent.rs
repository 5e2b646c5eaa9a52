//! The tangent: how the motion answers to a small change of device, force and initial state.

use super::stages::{Rhs, Stages, advance};
use super::tableau::{MIDPOINT, RK4, Tableau};
use super::{Device, Excitation, Method, Oscillator, State, Trajectory};

/// A direction in which device and initial state change.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceTangent {
    /// Change of every function at the nodes.
    pub device: Device,
    /// Change of the initial state.
    pub initial: State,
}

impl DeviceTangent {
    pub(super) fn is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().fold(true, |all, x| all & x.is_finite());
        let State {
            displacement,
            velocity,
        } = self.initial;
        self.device.functions().all(finite) && displacement.is_finite() && velocity.is_finite()
    }
}

impl Oscillator {
    /// Directional derivative of [`Oscillator::forward`] at `trajectory` (which must be the motion of
    /// `device` under `excitation`) along `direction`: the change of displacement and velocity per unit
    /// step, exact for the discrete motion.
    pub fn tangent(
        &self,
        device: &Device,
        excitation: Option<&Excitation>,
        trajectory: &Trajectory,
        direction: &DeviceTangent,
    ) -> Trajectory {
        let rhs = self.rhs(device, excitation, trajectory.nodes());
        match self.method {
            Method::Midpoint => sweep(&MIDPOINT, rhs, trajectory, direction),
            Method::Rk4 => sweep(&RK4, rhs, trajectory, direction),
        }
    }
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    rhs: Rhs,
    trajectory: &Trajectory,
    direction: &DeviceTangent,
) -> Trajectory {
    let nodes = trajectory.displacement.len();
    let mut out = Trajectory::zeros(nodes);
    let (mut dy, mut dv) = (direction.initial.displacement, direction.initial.velocity);
    (out.displacement[0], out.velocity[0]) = (dy, dv);
    for i in 0..nodes - 1 {
        let (y, v) = (trajectory.displacement[i], trajectory.velocity[i]);
        let base = rhs.stages(tableau, i, y, v);
        let change = stage_changes(tableau, rhs, &direction.device, i, &base, dy, dv);
        (dy, dv) = advance(tableau, rhs.dt, &change, dy, dv);
        (out.displacement[i + 1], out.velocity[i + 1]) = (dy, dv);
    }
    out
}

#[inline(always)]
fn stage_changes<const S: usize>(
    tableau: &Tableau<S>,
    rhs: Rhs,
    direction: &Device,
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
            change.y[s] += rhs.dt * change.v[r] * a;
            change.v[s] += rhs.dt * change.a[r] * a;
        }
        let slopes = rhs.slopes(i, position, base.y[s], base.v[s]);
        let inertia = rhs.absolute(i, position, base.a[s]);
        let mut push = -position.of(&direction.mass, i) * inertia;
        for (term, dp) in rhs.terms.iter().zip(&direction.coefficients) {
            push -= position.of(dp, i) * term.phi(base.y[s], base.v[s]);
        }
        change.a[s] = push / slopes.mass + slopes.da_dy * change.y[s] + slopes.da_dv * change.v[s];
    }
    change
}
