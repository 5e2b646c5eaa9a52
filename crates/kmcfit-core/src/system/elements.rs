//! Elements: force terms `p(t) phi(y, v)` of the equation of motion, with `phi` and its partial derivatives.

/// A force term `p(t) phi(y, v)` of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// `c(t) v`, c in N s/m.
    Damping,
    /// `k(t) y`, k in N/m.
    Stiffness,
    /// `p(t) y^2`, p in N/m^2: the asymmetric part of a spring.
    QuadraticStiffness,
    /// `p(t) y^3`, p in N/m^3.
    CubicStiffness,
    /// `p(t) y^5`, p in N/m^5.
    QuinticStiffness,
    /// `p(t) |v| v`, p in N s^2/m^2.
    QuadraticDamping,
    /// `p(t) v / sqrt(v^2 + width^2)`, p in N: smoothed Coulomb friction.
    CoulombFriction {
        /// Smoothing speed, m/s; positive.
        width: f64,
    },
    /// `p(t)`, in N: a static force, positive in the direction of negative `y`.
    Offset,
}

/// Largest number of terms of a system: one of each kind.
pub const MOST_TERMS: usize = 8;

impl Term {
    /// Width of Coulomb friction, m/s; `None` for other terms.
    pub fn friction_width(&self) -> Option<f64> {
        match self {
            Term::CoulombFriction { width } => Some(*width),
            _ => None,
        }
    }

    /// Element response `phi(y, v)`.
    ///
    /// Smoothed Coulomb friction differs from the sign of `v` by `width^2 / (2 v^2)` at speeds well above the width. A square root,
    /// unlike a hyperbolic tangent, has the same bits on every machine.
    #[inline(always)]
    pub fn phi(self, y: f64, v: f64) -> f64 {
        match self {
            Term::Damping => v,
            Term::Stiffness => y,
            Term::QuadraticStiffness => y * y,
            Term::CubicStiffness => y * y * y,
            Term::QuinticStiffness => y * (y * y) * (y * y),
            Term::QuadraticDamping => v.abs() * v,
            Term::CoulombFriction { width } => v / (v * v + width * width).sqrt(),
            Term::Offset => 1.0,
        }
    }

    /// Partial derivatives `(d phi/d y, d phi/d v)`. The first derivative of quadratic damping is continuous at `v = 0`, the second is not.
    #[inline(always)]
    pub fn partials(self, y: f64, v: f64) -> (f64, f64) {
        match self {
            Term::Damping => (0.0, 1.0),
            Term::Stiffness => (1.0, 0.0),
            Term::QuadraticStiffness => (2.0 * y, 0.0),
            Term::CubicStiffness => (3.0 * y * y, 0.0),
            Term::QuinticStiffness => (5.0 * (y * y) * (y * y), 0.0),
            Term::QuadraticDamping => (0.0, 2.0 * v.abs()),
            Term::CoulombFriction { width } => {
                let square = v * v + width * width;
                (0.0, width * width / (square * square.sqrt()))
            }
            Term::Offset => (0.0, 0.0),
        }
    }

    /// True if `phi` is linear in the state.
    pub fn is_linear(self) -> bool {
        matches!(self, Term::Damping | Term::Stiffness)
    }
}
