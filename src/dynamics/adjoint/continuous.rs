//! The continuous adjoint, Eq. 13 of the paper, discretised as the paper does.
//!
//! It is derived for functions of time and only then discretised, so it is consistent with the
//! discrete cost but not its exact derivative: the relative error levels off at a floor that
//! falls with the step (about 2e-5 at 1000 nodes, 4e-6 at 2000). Kept to reproduce the paper and to
//! show the difference; [`super::discrete`] has no floor.

use crate::dynamics::quadrature::{curvature, slope};
use crate::dynamics::{Device, DeviceTangent, Excitation, Oscillator, State, Term, Trajectory};
use crate::lanes::{self, Arithmetic, Kernel};
use std::borrow::Cow;

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
    let [c, k] = linearised_coefficients(oscillator, device, trajectory);
    let steps = Steps::new(
        dt,
        [&device.mass, &c, &k],
        &trajectory.displacement,
        observed,
    );
    let (z, first_slope) = steps.adjoint_motion(dt);
    let mut acceleration = curvature(&trajectory.displacement, dt);
    if let Some(base) = excitation.and_then(|e| e.base.as_ref()) {
        let base = base.at_nodes();
        acceleration.iter_mut().zip(base).for_each(|(a, b)| *a += b);
    }
    let against =
        |response: &[f64]| -> Vec<f64> { z.iter().zip(response).map(|(z, x)| -z * x).collect() };
    let motion = trajectory.displacement.iter().zip(&trajectory.velocity);
    let by_term = |term: &Term| match term {
        Term::Damping => against(&trajectory.velocity),
        Term::Stiffness => against(&trajectory.displacement),
        other => {
            let response: Vec<f64> = motion.clone().map(|(y, v)| other.phi(*y, *v)).collect();
            against(&response)
        }
    };
    let momentum_slope = slope(&device.mass, dt)[0] * z[0] + device.mass[0] * first_slope;
    DeviceTangent {
        device: Device {
            mass: against(&acceleration),
            coefficients: oscillator.terms.iter().map(by_term).collect(),
        },
        initial: State {
            displacement: c[0] * z[0] - momentum_slope,
            velocity: device.mass[0] * z[0],
        },
    }
}

/// What a step back needs and does not wait for: in the order of the steps, at their right node and
/// at mid-step.
struct Steps {
    /// `m`.
    mass: [Vec<f64>; 2],
    /// `C - 2 m'`.
    damping: [Vec<f64>; 2],
    /// `m'' - C' + K`.
    stiffness: [Vec<f64>; 2],
    /// `2 (y - y_obs) / m`.
    source: [Vec<f64>; 2],
}

impl Steps {
    fn new(dt: f64, [m, c, k]: [&[f64]; 3], y: &[f64], observed: &[f64]) -> Self {
        let (m1, m2, c1) = (slope(m, dt), curvature(m, dt), slope(c, dt));
        Self {
            mass: right_and_middle([m], |[m]| m),
            damping: right_and_middle([c, &m1], |[c, m1]| c - 2.0 * m1),
            stiffness: right_and_middle([&m2, &c1, k], |[m2, c1, k]| m2 - c1 + k),
            source: right_and_middle([y, observed, m], |[y, o, m]| 2.0 * (y - o) / m),
        }
    }

    /// The adjoint displacement `z` at the nodes, and `z'` at the first.
    fn adjoint_motion(&self, dt: f64) -> (Vec<f64>, f64) {
        let half_dt = 0.5 * dt;
        let steps = self.mass[0].len();
        let mut out = vec![0.0; steps + 1];
        let (mut z, mut w) = (0.0, 0.0);
        for j in (0..steps).rev() {
            let slope = |at: usize, w: f64, z: f64| {
                let m = self.mass[at][j];
                w / m * self.damping[at][j] - z / m * self.stiffness[at][j] + self.source[at][j]
            };
            let (wh, zh) = (w - half_dt * slope(0, w, z), z - half_dt * w);
            w -= dt * slope(1, wh, zh);
            z -= dt * wh;
            out[j] = z;
        }
        (out, w)
    }
}

/// `f` of the values of some lists, at the right node of every step and of their means at mid-step.
fn right_and_middle<const N: usize>(
    lists: [&[f64]; N],
    f: impl Fn([f64; N]) -> f64,
) -> [Vec<f64>; 2] {
    let steps = lists[0].len() - 1;
    let [mut at_right, mut at_middle] = [vec![0.0; steps], vec![0.0; steps]];
    let out = [at_right.as_mut_slice(), at_middle.as_mut_slice()];
    lanes::run(RightAndMiddle { lists, f, out });
    [at_right, at_middle]
}

/// What [`right_and_middle`] does.
struct RightAndMiddle<'a, F, const N: usize> {
    lists: [&'a [f64]; N],
    f: F,
    out: [&'a mut [f64]; 2],
}

impl<F: Fn([f64; N]) -> f64, const N: usize> Kernel for RightAndMiddle<'_, F, N> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) {
        let [at_right, at_middle] = self.out;
        let steps = at_right.len();
        let at_middle = &mut at_middle[..steps];
        // Lengths that the compiler sees: no check is left in the loop.
        let left = self.lists.map(|x| &x[..steps]);
        let right = self.lists.map(|x| &x[1..=steps]);
        for j in 0..steps {
            at_right[j] = (self.f)(right.map(|x| x[j]));
            at_middle[j] = (self.f)(std::array::from_fn(|l| (right[l][j] + left[l][j]) * 0.5));
        }
    }
}

/// `(C, K)` at the nodes: what damping and stiffness the motion sees when it is disturbed.
fn linearised_coefficients<'a>(
    oscillator: &Oscillator,
    device: &'a Device,
    trajectory: &Trajectory,
) -> [Cow<'a, [f64]>; 2] {
    let nodes = trajectory.displacement.len();
    if oscillator.terms == [Term::Damping, Term::Stiffness] {
        return [0, 1].map(|j| Cow::Borrowed(device.coefficients[j].as_slice()));
    }
    let (mut c, mut k) = (vec![0.0; nodes], vec![0.0; nodes]);
    for (term, p) in oscillator.terms.iter().zip(&device.coefficients) {
        for i in 0..nodes {
            let (phi_y, phi_v) = term.partials(trajectory.displacement[i], trajectory.velocity[i]);
            c[i] += p[i] * phi_v;
            k[i] += p[i] * phi_y;
        }
    }
    [c, k].map(Cow::Owned)
}
