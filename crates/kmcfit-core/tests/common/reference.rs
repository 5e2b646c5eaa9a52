//! An independent simulation by textbook formulas, generic over the type of number.

use kmcfit_core::system::Method;
use num_dual::DualNum;

/// Functions and force at the nodes.
pub struct Inputs<D> {
    pub mass: Vec<D>,
    pub damping: Vec<D>,
    pub stiffness: Vec<D>,
    pub force: Vec<D>,
}

/// Displacement and velocity at all nodes.
pub fn response<D: DualNum<Primitive = f64> + Copy>(
    method: Method,
    inputs: &Inputs<D>,
    (y0, v0): (D, D),
    dt: f64,
) -> Vec<(D, D)> {
    let mut states = vec![(y0, v0)];
    let accelerate = |left: f64, i: usize, y: D, v: D| {
        let at = |f: &[D]| match left {
            1.0 => f[i],
            0.0 => f[i + 1],
            w => f[i] * w + f[i + 1] * (1.0 - w),
        };
        let push = at(&inputs.force) - at(&inputs.stiffness) * y - at(&inputs.damping) * v;
        push / at(&inputs.mass)
    };
    for i in 0..inputs.mass.len() - 1 {
        let (y, v) = states[i];
        let a1 = accelerate(1.0, i, y, v);
        let v2 = v + a1 * (dt / 2.0);
        let a2 = accelerate(0.5, i, y + v * (dt / 2.0), v2);
        let next = match method {
            Method::ImplicitMidpoint => unreachable!("an explicit method"),
            Method::Midpoint => (y + v2 * dt, v + a2 * dt),
            Method::Rk4 => {
                let v3 = v + a2 * (dt / 2.0);
                let a3 = accelerate(0.5, i, y + v2 * (dt / 2.0), v3);
                let v4 = v + a3 * dt;
                let a4 = accelerate(0.0, i, y + v3 * dt, v4);
                (
                    y + (v + (v2 + v3) * 2.0 + v4) * (dt / 6.0),
                    v + (a1 + (a2 + a3) * 2.0 + a4) * (dt / 6.0),
                )
            }
        };
        states.push(next);
    }
    states
}
