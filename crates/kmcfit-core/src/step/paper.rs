//! The paper's response, Eq. 2, and its continuous adjoint: Eq. 13, with the gradients of Eqs. 15-17, in the paper's order of operations.
//!
//! The adjoint is derived for functions of time and then discretised, so it is consistent with the discrete cost but not its exact
//! derivative: the relative error has a floor that decreases with the step (about 2e-5 at 1000 nodes, 4e-6 at 2000). It
//! reproduces the paper; the discrete adjoint is exact.

use super::Trajectory;
use crate::structure::Law;
use crate::system::quadrature::{curvature, midpoint, slope};
use crate::system::{Excitation, NodalCoefficients, StageSamples, State, System, SystemTangent};
use std::borrow::Cow;

/// Response of one coordinate with damping and stiffness, Eq. 2, by the explicit midpoint rule: `m (y'' + b'') = f - k y - c y'`, where the
/// paper has no force `f` and a base `b` at rest.
pub(super) fn respond(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    initial: &State,
    trajectory: &mut Trajectory,
) {
    let dt = system.grid.step();
    let functions = [
        &nodal.inertias[0],
        &nodal.coefficients[0],
        &nodal.coefficients[1],
    ];
    let [force, base] = [Excitation::force, Excitation::frame].map(|input| {
        let samples = excitation.and_then(|e| input(e, 0));
        samples.map(StageSamples::stages)
    });
    let acceleration = |[m, c, k]: [f64; 3], stage: usize, i: usize, y: f64, v: f64| {
        let push = force.map_or(0.0, |f| f[stage][i] / m);
        push - k * y / m - c * v / m - base.map_or(0.0, |b| b[stage][i])
    };
    let [[ys], [vs]] = trajectory.columns_mut();
    let (mut y, mut v) = (initial.displacement(0), initial.velocity(0));
    (ys[0], vs[0]) = (y, v);
    for i in 0..ys.len() - 1 {
        let left = functions.map(|f| f[i]);
        let middle = functions.map(|f| midpoint(f, i));
        let a = acceleration(left, 0, i, y, v);
        let (half_y, half_v) = (y + 0.5 * dt * v, v + 0.5 * dt * a);
        let a = acceleration(middle, 1, i, half_y, half_v);
        y += dt * half_v;
        v += dt * a;
        (ys[i + 1], vs[i + 1]) = (y, v);
    }
}

/// Gradient of `J = integral (y - y_obs)^2 dt` with respect to all functions, in the L2 inner
/// product: functions of time at the nodes, not multiplied by quadrature weights.
///
/// The adjoint displacement `z` satisfies Eq. 13 and `z = z' = 0` at the end:
/// `m z'' + (2 m' - C) z' + (m'' - C' + K) z = 2 (y - y_obs)` with `C = sum_j p_j dphi_j/dv` and
/// `K = sum_j p_j dphi_j/dy` along the response (for the paper's terms `C = c`, `K = k`). The gradients are
/// `-z (y'' + b'')` for the mass (Eq. 16) and `-z phi_j` for term `j` (Eqs. 15 and 17). Time derivatives, that of `y`
/// included, are finite differences. Eq. 13 is integrated by the explicit midpoint rule for every stepper of the forward
/// solve, in the paper's order of operations.
///
/// The gradients with respect to the initial state are `dJ/dv(0) = m z` and `dJ/dy(0) = C z - (m z)'` at the first node.
///
/// # Panics
/// If the response, the measurements or a function of the system is shorter than the grid.
pub fn continuous_adjoint(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    observed: &[f64],
) -> SystemTangent {
    let equation = AdjointEquation::new(system, nodal, trajectory, observed);
    let adjoint = equation.solve();
    equation.gradients(system, excitation, trajectory, &adjoint)
}

/// Functions of time in Eq. 13, at the nodes.
struct AdjointEquation<'a> {
    /// Step, s.
    pub dt: f64,
    /// Nodal values of `m`, `m'`, `m''`, `C`, `C'`, `K`, `y` and `y_obs`.
    pub functions: [Cow<'a, [f64]>; 8],
}

/// Adjoint displacement `z` at the nodes, and its slope `z'` at the first one.
struct Adjoint {
    pub displacement: Vec<f64>,
    pub first_slope: f64,
}

impl<'a> AdjointEquation<'a> {
    pub fn new(
        system: &System,
        nodal: &'a NodalCoefficients,
        trajectory: &'a Trajectory,
        observed: &'a [f64],
    ) -> Self {
        let dt = system.grid.step();
        let [c, k] = linearised_coefficients(system, nodal, trajectory);
        let m = nodal.inertias[0].as_slice();
        let (m1, m2, c1) = (slope(m, dt), curvature(m, dt), slope(&c, dt));
        let y = trajectory.displacement(0);
        let functions = [
            m.into(),
            m1.into(),
            m2.into(),
            c,
            c1.into(),
            k,
            y.into(),
            observed.into(),
        ];
        assert!(
            functions.iter().all(|f| f.len() == system.grid.nodes()),
            "functions over the whole grid"
        );
        Self { dt, functions }
    }

    /// Integrates Eq. 13 backwards in time from `z = z' = 0` at the end.
    pub fn solve(&self) -> Adjoint {
        let last = self.functions[0].len() - 1;
        let h = -self.dt;
        let mut displacement = vec![0.0; last + 1];
        let (mut z, mut w) = (0.0, 0.0);
        for i in (0..last).rev() {
            let right = self.functions.each_ref().map(|f| f[i + 1]);
            let middle = self.functions.each_ref().map(|f| midpoint(f, i));
            let l1w = h * acceleration(right, z, w);
            let l1z = h * w;
            let l2w = h * acceleration(middle, z + l1z * 0.5, w + l1w * 0.5);
            let l2z = h * (w + l1w * 0.5);
            z += l2z;
            w += l2w;
            displacement[i] = z;
        }
        Adjoint {
            displacement,
            first_slope: w,
        }
    }

    /// Gradients of Eqs. 15-17, and the gradient with respect to the initial state.
    pub fn gradients(
        &self,
        system: &System,
        excitation: Option<&Excitation>,
        trajectory: &Trajectory,
        adjoint: &Adjoint,
    ) -> SystemTangent {
        let (y, v) = (trajectory.displacement(0), trajectory.velocity(0));
        let z = &adjoint.displacement;
        let mut acceleration = curvature(y, self.dt);
        if let Some(base) = excitation.and_then(|e| e.frame(0)) {
            let base = base.at_nodes();
            acceleration.iter_mut().zip(base).for_each(|(a, b)| *a += b);
        }
        // The subtraction from zero avoids negative zeros.
        let gradient = |response: &[f64]| -> Vec<f64> {
            let pairs = z.iter().zip(response);
            pairs.map(|(z, x)| 0.0 - z * x).collect()
        };
        let by_term = |term: &Law| match term {
            Law::Damping => gradient(v),
            Law::Stiffness => gradient(y),
            other => {
                let states = y.iter().zip(v);
                gradient(&states.map(|(y, v)| other.phi(*y, *v)).collect::<Vec<_>>())
            }
        };
        let [m, m1, _, c, ..] = self.functions.each_ref().map(|f| f[0]);
        let momentum_slope = m1 * z[0] + m * adjoint.first_slope;
        SystemTangent {
            nodal: NodalCoefficients {
                inertias: vec![gradient(&acceleration)],
                coefficients: system.laws().iter().map(by_term).collect(),
            },
            initial: State::one(c * z[0] - momentum_slope, m * z[0]),
        }
    }
}

/// Second derivative `z''` by Eq. 13, from the functions of [`AdjointEquation`] at one time and `(z, w) = (z, z')`.
fn acceleration(functions: [f64; 8], z: f64, w: f64) -> f64 {
    let [m, m1, m2, c, c1, k, y, observed] = functions;
    -w / m * (2.0 * m1 - c) - z / m * (m2 - c1 + k) + 2.0 * (y - observed) / m
}

/// `(C, K)` at the nodes: tangent damping and stiffness along the response.
fn linearised_coefficients<'a>(
    system: &System,
    nodal: &'a NodalCoefficients,
    trajectory: &Trajectory,
) -> [Cow<'a, [f64]>; 2] {
    if system.laws() == [Law::Damping, Law::Stiffness] {
        return [0, 1].map(|j| Cow::Borrowed(nodal.coefficients[j].as_slice()));
    }
    let nodes = trajectory.nodes();
    let (mut c, mut k) = (vec![0.0; nodes], vec![0.0; nodes]);
    for (term, p) in system.laws().iter().zip(&nodal.coefficients) {
        for i in 0..nodes {
            let [by_y, by_v] =
                term.slopes(trajectory.displacement(0)[i], trajectory.velocity(0)[i]);
            c[i] += p[i] * by_v.unwrap_or(0.0);
            k[i] += p[i] * by_y.unwrap_or(0.0);
        }
    }
    [c, k].map(Cow::Owned)
}
