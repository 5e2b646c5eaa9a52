//! The continuous adjoint, Eq. 13 of the paper, discretised as the paper does.
//!
//! It is derived for functions of time and only then discretised, so it is consistent with the
//! discrete cost but not its exact derivative: the relative error levels off at a floor that
//! falls with the step (about 2e-5 at 1000 nodes, 4e-6 at 2000). Kept to reproduce the paper and to
//! show the difference; [`super::discrete`] has no floor.

use crate::dynamics::quadrature::{curvature, midpoint, slope};
use crate::dynamics::{Device, DeviceTangent, Excitation, Oscillator, State, Trajectory};

/// Gradient of `J = integral (y - y_obs)^2 dt` with respect to all functions, in the L2 inner
/// product: functions of time at the nodes, not multiplied by quadrature weights.
///
/// Integrates, backward from `z = z' = 0` at the end,
/// `m z'' + (2 m' - C) z' + (m'' - C' + K) z = 2 (y - y_obs)` with `C = sum_j p_j dphi_j/dv` and
/// `K = sum_j p_j dphi_j/dy` along the motion (for the paper's terms `C = c`, `K = k`), and returns
/// `-z (y'' + b'')` for the mass and `-z phi_j` for term `j`. Derivatives are taken by differences,
/// `y''` too. The stepper is the explicit midpoint rule whatever the forward solve uses, in the order
/// of operations of the paper's run.
///
/// The gradient with respect to the initial state are numbers: `dJ/dv(0) = m z` and
/// `dJ/dy(0) = C z - (m z)'` at the beginning.
///
/// # Panics
/// If the motion ends before the grid does.
pub fn gradient(
    oscillator: &Oscillator,
    device: &Device,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    observed: &[f64],
) -> DeviceTangent {
    let nodes = oscillator.grid.nodes();
    assert_eq!(trajectory.nodes(), nodes, "a motion over the whole grid");
    let dt = oscillator.grid.step();
    let (z, first_slope) = adjoint_motion(oscillator, device, trajectory, observed);
    let mut acceleration = curvature(&trajectory.displacement, dt);
    if let Some(base) = excitation.and_then(|e| e.base.as_ref()) {
        let base = base.at_nodes();
        acceleration.iter_mut().zip(base).for_each(|(a, b)| *a += b);
    }
    let against = |response: &dyn Fn(usize) -> f64| -> Vec<f64> {
        z.iter()
            .enumerate()
            .map(|(i, z)| -z * response(i))
            .collect()
    };
    let phi = |i: usize, j: usize| {
        oscillator.terms[j].phi(trajectory.displacement[i], trajectory.velocity[i])
    };
    let (c, _) = linearised_coefficients(oscillator, device, trajectory);
    let momentum_slope = slope(&device.mass, dt)[0] * z[0] + device.mass[0] * first_slope;
    DeviceTangent {
        device: Device {
            mass: against(&|i| acceleration[i]),
            coefficients: (0..oscillator.terms.len())
                .map(|j| against(&|i| phi(i, j)))
                .collect(),
        },
        initial: State {
            displacement: c[0] * z[0] - momentum_slope,
            velocity: device.mass[0] * z[0],
        },
    }
}

/// The adjoint displacement `z` at the nodes, and `z'` at the first.
fn adjoint_motion(
    oscillator: &Oscillator,
    device: &Device,
    trajectory: &Trajectory,
    observed: &[f64],
) -> (Vec<f64>, f64) {
    let dt = oscillator.grid.step();
    let (m, y) = (&device.mass, &trajectory.displacement);
    let (c, k) = linearised_coefficients(oscillator, device, trajectory);
    let (m1, m2, c1) = (slope(m, dt), curvature(m, dt), slope(&c, dt));
    let h = -dt;
    let mut out = vec![0.0; y.len()];
    let (mut z, mut w) = (0.0, 0.0);
    for j in (0..y.len() - 1).rev() {
        let i = j + 1;
        let source = 2.0 * (y[i] - observed[i]);
        let l1w = h
            * (-w / m[i] * (2.0 * m1[i] - c[i]) - z / m[i] * (m2[i] - c1[i] + k[i])
                + source / m[i]);
        let l1z = h * w;
        let (mh, ch, kh) = (midpoint(m, j), midpoint(&c, j), midpoint(&k, j));
        let source = 2.0 * (midpoint(y, j) - midpoint(observed, j));
        let (wh, zh) = (w + l1w * 0.5, z + l1z * 0.5);
        let l2w = h
            * (-wh / mh * (2.0 * midpoint(&m1, j) - ch)
                - zh / mh * (midpoint(&m2, j) - midpoint(&c1, j) + kh)
                + source / mh);
        z += h * wh;
        w += l2w;
        out[j] = z;
    }
    (out, w)
}

/// `(C, K)` at the nodes: what damping and stiffness the motion sees when it is disturbed.
fn linearised_coefficients(
    oscillator: &Oscillator,
    device: &Device,
    trajectory: &Trajectory,
) -> (Vec<f64>, Vec<f64>) {
    let nodes = trajectory.displacement.len();
    let (mut c, mut k) = (vec![0.0; nodes], vec![0.0; nodes]);
    for (term, p) in oscillator.terms.iter().zip(&device.coefficients) {
        for i in 0..nodes {
            let (phi_y, phi_v) = term.partials(trajectory.displacement[i], trajectory.velocity[i]);
            c[i] += p[i] * phi_v;
            k[i] += p[i] * phi_y;
        }
    }
    (c, k)
}
