//! Elements: forces `p(t) phi(y, v)` of the equation of motion, each with its response and partial derivatives.

/// A force term `p(t) phi(y, v)` of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// `c(t) v`, c in N s/m.
    Damping,
    /// `k(t) y`, k in N/m.
    Stiffness,
    /// `p(t) y^3`, p in N/m^3.
    CubicStiffness,
    /// `p(t) |v| v`, p in N s^2/m^2.
    QuadraticDamping,
    /// `p(t) v / sqrt(v^2 + width^2)`, p in N: a sign of `v` that is smooth over the width.
    CoulombFriction {
        /// Speed below which friction gives way, m/s; positive.
        width: f64,
    },
    /// `p(t)`, in N: a constant push to the left.
    Offset,
}

/// The most terms that an oscillator can have: one of each kind.
pub const MOST_TERMS: usize = 6;

impl Term {
    /// The response `phi(y, v)`.
    ///
    /// Coulomb friction differs from the sign of `v` by `width^2 / (2 v^2)` at speeds well above the width; a
    /// square root, unlike a hyperbolic tangent, has the same bits on every machine.
    #[inline(always)]
    pub fn phi(self, y: f64, v: f64) -> f64 {
        match self {
            Term::Damping => v,
            Term::Stiffness => y,
            Term::CubicStiffness => y * y * y,
            Term::QuadraticDamping => v.abs() * v,
            Term::CoulombFriction { width } => v / (v * v + width * width).sqrt(),
            Term::Offset => 1.0,
        }
    }

    /// `(d phi/d y, d phi/d v)`. The second derivative of quadratic damping jumps at `v = 0`, its first does not.
    #[inline(always)]
    pub fn partials(self, y: f64, v: f64) -> (f64, f64) {
        match self {
            Term::Damping => (0.0, 1.0),
            Term::Stiffness => (1.0, 0.0),
            Term::CubicStiffness => (3.0 * y * y, 0.0),
            Term::QuadraticDamping => (0.0, 2.0 * v.abs()),
            Term::CoulombFriction { width } => {
                let square = v * v + width * width;
                (0.0, width * width / (square * square.sqrt()))
            }
            Term::Offset => (0.0, 0.0),
        }
    }

    /// Whether the response is proportional to the response.
    pub fn is_linear(self) -> bool {
        matches!(self, Term::Damping | Term::Stiffness)
    }
}
