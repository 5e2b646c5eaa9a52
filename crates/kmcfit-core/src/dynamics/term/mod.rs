//! Force terms: each is a coefficient function times a response `phi(y, v)`; one file each.

mod coulomb_friction;
mod cubic_stiffness;
mod damping;
mod lanes;
mod offset;
mod quadratic_damping;
mod stiffness;

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
    #[inline(always)]
    pub fn phi(self, y: f64, v: f64) -> f64 {
        match self {
            Term::Damping => damping::phi(y, v),
            Term::Stiffness => stiffness::phi(y, v),
            Term::CubicStiffness => cubic_stiffness::phi(y, v),
            Term::QuadraticDamping => quadratic_damping::phi(y, v),
            Term::CoulombFriction { width } => coulomb_friction::phi(y, v, width),
            Term::Offset => offset::phi(y, v),
        }
    }

    /// `(d phi/d y, d phi/d v)`.
    #[inline(always)]
    pub fn partials(self, y: f64, v: f64) -> (f64, f64) {
        match self {
            Term::Damping => damping::partials(y, v),
            Term::Stiffness => stiffness::partials(y, v),
            Term::CubicStiffness => cubic_stiffness::partials(y, v),
            Term::QuadraticDamping => quadratic_damping::partials(y, v),
            Term::CoulombFriction { width } => coulomb_friction::partials(y, v, width),
            Term::Offset => offset::partials(y, v),
        }
    }

    /// Whether the response is proportional to the motion.
    pub fn is_linear(self) -> bool {
        matches!(self, Term::Damping | Term::Stiffness)
    }
}

/// Calls with a list of terms that is known when this is compiled where it is one of the usual ones: what is said of each
/// term is then laid out one after the other, without a choice. The constant is how many terms there are at most.
/// Whoever calls it has [`Term`] and [`MOST_TERMS`] in sight.
macro_rules! with_known {
    ($terms:expr, $known:ident, $most:ident => $call:expr) => {
        match $terms {
            [Term::Damping, Term::Stiffness] => {
                const $most: usize = 2;
                let $known: &[Term] = &[Term::Damping, Term::Stiffness];
                $call
            }
            [Term::Damping, Term::Stiffness, Term::CubicStiffness] => {
                const $most: usize = 3;
                let $known: &[Term] = &[Term::Damping, Term::Stiffness, Term::CubicStiffness];
                $call
            }
            $known => {
                const $most: usize = MOST_TERMS;
                $call
            }
        }
    };
}
pub(super) use with_known;
