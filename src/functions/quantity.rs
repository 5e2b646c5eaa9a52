//! Names and units of the functions.

use crate::dynamics::Term;

/// Which coefficient function of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Mass `m(t)`.
    Mass,
    /// Damping `c(t)`.
    Damping,
    /// Stiffness `k(t)`.
    Stiffness,
}

impl Quantity {
    /// Key in a model file and in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Mass => "mass",
            Quantity::Damping => "damping",
            Quantity::Stiffness => "stiffness",
        }
    }

    /// Symbol in the equation of motion.
    pub fn symbol(self) -> &'static str {
        match self {
            Quantity::Mass => "m",
            Quantity::Damping => "c",
            Quantity::Stiffness => "k",
        }
    }

    /// SI unit when the displacement is in m.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Mass => "kg",
            Quantity::Damping => "N s/m",
            Quantity::Stiffness => "N/m",
        }
    }

    /// Column header with unit.
    pub fn column(self) -> &'static str {
        match self {
            Quantity::Mass => "mass_kg",
            Quantity::Damping => "damping_N_s_per_m",
            Quantity::Stiffness => "stiffness_N_per_m",
        }
    }

    /// The force term that this function multiplies; `None` for the mass.
    pub fn term(self) -> Option<Term> {
        match self {
            Quantity::Mass => None,
            Quantity::Damping => Some(Term::Damping),
            Quantity::Stiffness => Some(Term::Stiffness),
        }
    }
}
