//! Laws of elements: forces `p(t) phi(x, r)` of elongation `x` and its rate `r`, with the derivatives of `phi`.

use crate::simd::Real;

/// Law of the force `p(t) phi(x, r)` of an element with elongation `x` and rate `r`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// `c(t) r`, c in N s/m.
    Damping,
    /// `k(t) x`, k in N/m.
    Stiffness,
    /// `p(t) x^2`, p in N/m^2: the asymmetric part of a spring.
    QuadraticStiffness,
    /// `p(t) x^3`, p in N/m^3.
    CubicStiffness,
    /// `p(t) x^5`, p in N/m^5.
    QuinticStiffness,
    /// `p(t) |r| r`, p in N s^2/m^2.
    QuadraticDamping,
    /// `p(t) r / sqrt(r^2 + width^2)`, p in N: smoothed Coulomb friction.
    CoulombFriction {
        /// Smoothing speed, m/s; positive.
        width: f64,
    },
    /// `p(t)`, in N: a static force, positive in the direction of negative `x`.
    Offset,
    /// Hysteresis of Bouc and Wen: `p(t) z`, p in N/m, of an internal state with `z' = r - |z|^(n-1) (beta(t) |r| z + gamma(t) r |z|)`, `z` in m,
    /// `beta` and `gamma` in 1/m^n (Wen, Journal of the Engineering Mechanics Division 102, 1976). Its steps are assembled.
    BoucWen {
        /// `n`, at least 1.
        exponent: u32,
    },
}

/// Largest number of elements of one coordinate: one of each law.
pub const MOST_ELEMENTS: usize = 8;

impl Law {
    /// Width of Coulomb friction, m/s; `None` for other laws.
    pub fn friction_width(&self) -> Option<f64> {
        match self {
            Law::CoulombFriction { width } => Some(*width),
            _ => None,
        }
    }

    /// True if `phi` is linear in elongation and rate.
    pub fn is_linear(self) -> bool {
        matches!(self, Law::Damping | Law::Stiffness)
    }

    /// `phi(x, r)`.
    ///
    /// Smoothed Coulomb friction differs from the sign of `r` by `width^2 / (2 r^2)` at speeds well above the width. A square root,
    /// unlike a hyperbolic tangent, has the same bits on every machine.
    #[inline(always)]
    pub fn phi<T: Real>(self, x: T, r: T) -> T {
        match self {
            Law::Damping => r,
            Law::Stiffness => x,
            Law::QuadraticStiffness => x * x,
            Law::CubicStiffness => x * x * x,
            Law::QuinticStiffness => x * (x * x) * (x * x),
            Law::QuadraticDamping => r.abs() * r,
            Law::CoulombFriction { width } => r / (r * r + r.like(width * width)).sqrt(),
            Law::Offset => x.like(1.0),
            // See `Law::with_internal_state`.
            Law::BoucWen { .. } => x.like(0.0),
        }
    }

    /// Derivatives of `phi` with respect to elongation and rate; `None` for zero. The first derivative of quadratic damping is
    /// continuous at `r = 0`, the second is not.
    #[inline(always)]
    pub fn slopes<T: Real>(self, x: T, r: T) -> [Option<T>; 2] {
        match self {
            Law::Damping => [None, Some(r.like(1.0))],
            Law::Stiffness => [Some(x.like(1.0)), None],
            Law::QuadraticStiffness => [Some(x.scale(2.0)), None],
            Law::CubicStiffness => [Some((x * x).scale(3.0)), None],
            Law::QuinticStiffness => [Some(((x * x) * (x * x)).scale(5.0)), None],
            Law::QuadraticDamping => [None, Some(r.abs().scale(2.0))],
            Law::CoulombFriction { width } => {
                let square = r * r + r.like(width * width);
                [None, Some(r.like(width * width) / (square * square.sqrt()))]
            }
            Law::Offset | Law::BoucWen { .. } => [None, None],
        }
    }
}
