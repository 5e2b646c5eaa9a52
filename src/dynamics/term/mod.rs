//! Force terms: each is a coefficient function times a response `phi(y, v)`; one file each.

mod damping;
mod stiffness;

/// A force term `p(t) phi(y, v)` of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// `c(t) v`, c in N s/m.
    Damping,
    /// `k(t) y`, k in N/m.
    Stiffness,
}

impl Term {
    /// The response `phi(y, v)`.
    #[inline(always)]
    pub fn phi(self, y: f64, v: f64) -> f64 {
        match self {
            Term::Damping => damping::phi(y, v),
            Term::Stiffness => stiffness::phi(y, v),
        }
    }

    /// `(d phi/d y, d phi/d v)`.
    #[inline(always)]
    pub fn partials(self, y: f64, v: f64) -> (f64, f64) {
        match self {
            Term::Damping => damping::partials(y, v),
            Term::Stiffness => stiffness::partials(y, v),
        }
    }
}
