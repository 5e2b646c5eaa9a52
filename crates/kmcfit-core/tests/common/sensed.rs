//! An independent evaluation of records with all terms, inputs, sensors and losses by textbook formulas, generic over the type of
//! number.

use kmcfit_core::record::{ChannelKind, Loss};
use kmcfit_core::system::Method;
use num_dual::DualNum;

/// A number type with derivatives.
pub trait Real: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Real for D {}

/// Factor of a coefficient function in the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Response {
    Damping,
    Stiffness,
    QuadraticSpring,
    Cubic,
    Quintic,
    Quadratic,
    Coulomb(f64),
    Offset,
}

impl Response {
    fn of<D: Real>(self, y: D, v: D) -> D {
        match self {
            Self::Damping => v,
            Self::Stiffness => y,
            Self::QuadraticSpring => y.powi(2),
            Self::Cubic => y.powi(3),
            Self::Quintic => y.powi(5),
            // |v| v without the absolute value, which is not differentiable at 0.
            Self::Quadratic if v.re() < 0.0 => -v.powi(2),
            Self::Quadratic => v.powi(2),
            Self::Coulomb(width) => v / (v.powi(2) + width * width).sqrt(),
            Self::Offset => D::from(1.0),
        }
    }
}

/// A system, its input and its initial state.
pub struct Record<D> {
    pub method: Method,
    pub dt: f64,
    pub mass: Vec<D>,
    pub terms: Vec<(Response, Vec<D>)>,
    /// Force and acceleration of the base at the left end, middle and right end of each step.
    pub force: Vec<[f64; 3]>,
    pub base: Vec<[f64; 3]>,
    pub initial: (D, D),
}

impl<D: Real> Record<D> {
    /// `y''` a share `x` of step `i` on, under a force and an acceleration of the base.
    fn acceleration(&self, i: usize, x: f64, (force, base): (f64, f64), y: D, v: D) -> D {
        let at = |f: &[D]| match x {
            0.0 => f[i],
            1.0 => f[i + 1],
            x => f[i] * (1.0 - x) + f[i + 1] * x,
        };
        let resisted = self
            .terms
            .iter()
            .fold(D::from(0.0), |sum, (phi, p)| sum + at(p) * phi.of(y, v));
        (-resisted + force) / at(&self.mass) - base
    }

    fn stage(&self, i: usize, s: usize, y: D, v: D) -> D {
        let driven = (self.force[i][s], self.base[i][s]);
        self.acceleration(i, s as f64 / 2.0, driven, y, v)
    }

    /// Displacement and velocity at all nodes.
    pub fn response(&self) -> Vec<(D, D)> {
        let dt = self.dt;
        let mut states = vec![self.initial];
        for i in 0..self.mass.len() - 1 {
            let (y, v) = states[i];
            let a1 = self.stage(i, 0, y, v);
            let v2 = v + a1 * (dt / 2.0);
            let a2 = self.stage(i, 1, y + v * (dt / 2.0), v2);
            states.push(match self.method {
                Method::ImplicitMidpoint => unreachable!("an explicit method"),
                Method::Midpoint => (y + v2 * dt, v + a2 * dt),
                Method::Rk4 => {
                    let v3 = v + a2 * (dt / 2.0);
                    let a3 = self.stage(i, 1, y + v2 * (dt / 2.0), v3);
                    let v4 = v + a3 * dt;
                    let a4 = self.stage(i, 2, y + v3 * dt, v4);
                    (
                        y + (v + (v2 + v3) * 2.0 + v4) * (dt / 6.0),
                        v + (a1 + (a2 + a3) * 2.0 + a4) * (dt / 6.0),
                    )
                }
            });
        }
        states
    }

    /// Ideal sample at the fraction `x` of step `i`; `around` is force and base there.
    pub fn seen(
        &self,
        kind: ChannelKind,
        states: &[(D, D)],
        (i, x): (usize, f64),
        around: (f64, f64),
    ) -> D {
        let dt = self.dt;
        let ((y0, v0), (y1, v1)) = (states[i], states[i + 1]);
        // The cubic with values p, q and slopes r, s (per step) at the ends, in Bernstein form.
        let cubic = |p: D, r: D, q: D, s: D| {
            let (a, b) = (p + r / 3.0, q - s / 3.0);
            let u = 1.0 - x;
            p * (u * u * u) + a * (3.0 * u * u * x) + b * (3.0 * u * x * x) + q * (x * x * x)
        };
        let y = cubic(y0, v0 * dt, y1, v1 * dt);
        let a0 = self.stage(i, 0, y0, v0);
        let a1 = self.stage(i, 2, y1, v1);
        let v = match x {
            0.0 => v0,
            1.0 => v1,
            _ => cubic(v0, a0 * dt, v1, a1 * dt),
        };
        match kind {
            ChannelKind::Displacement => y,
            ChannelKind::Velocity => v,
            ChannelKind::Acceleration => self.acceleration(i, x, around, y, v),
        }
    }
}

/// Loss of a residual in standard deviations.
pub fn cost<D: Real>(loss: Loss, u: D) -> D {
    match loss {
        Loss::Squares => u.powi(2),
        Loss::Huber { threshold } if u.re() > threshold => {
            u * (2.0 * threshold) - threshold * threshold
        }
        Loss::Huber { threshold } if u.re() < -threshold => {
            u * (-2.0 * threshold) - threshold * threshold
        }
        Loss::Huber { .. } => u.powi(2),
        Loss::StudentT { degrees } => (u.powi(2) / degrees + 1.0).ln() * (degrees + 1.0),
    }
}
