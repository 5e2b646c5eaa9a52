//! Names and units of the functions.

use crate::system::Term;

/// Which coefficient function of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Mass `m(t)`.
    Mass,
    /// Damping `c(t)`.
    Damping,
    /// Stiffness `k(t)`.
    Stiffness,
    /// Cubic stiffness, of `y^3`.
    CubicStiffness,
    /// Quadratic damping, of `|v| v`.
    QuadraticDamping,
    /// Coulomb friction, of a smoothed sign of `v`.
    CoulombFriction,
    /// Constant offset of the force.
    Offset,
}

impl Quantity {
    /// Key in a model file and in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Mass => "mass",
            Quantity::Damping => "damping",
            Quantity::Stiffness => "stiffness",
            Quantity::CubicStiffness => "cubic_stiffness",
            Quantity::QuadraticDamping => "quadratic_damping",
            Quantity::CoulombFriction => "coulomb_friction",
            Quantity::Offset => "offset",
        }
    }

    /// Symbol in the equation of motion.
    pub fn symbol(self) -> &'static str {
        match self {
            Quantity::Mass => "m",
            Quantity::Damping => "c",
            Quantity::Stiffness => "k",
            Quantity::CubicStiffness => "k3",
            Quantity::QuadraticDamping => "c2",
            Quantity::CoulombFriction => "F_c",
            Quantity::Offset => "F_0",
        }
    }

    /// SI unit when the displacement is in m.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Mass => "kg",
            Quantity::Damping => "N s/m",
            Quantity::Stiffness => "N/m",
            Quantity::CubicStiffness => "N/m^3",
            Quantity::QuadraticDamping => "N s^2/m^2",
            Quantity::CoulombFriction => "N",
            Quantity::Offset => "N",
        }
    }

    /// SI unit where the motion is a rotation: displacement in rad, force a moment.
    pub fn angular_unit(self) -> &'static str {
        match self {
            Quantity::Mass => "kg m^2",
            Quantity::Damping => "N m s/rad",
            Quantity::Stiffness => "N m/rad",
            Quantity::CubicStiffness => "N m/rad^3",
            Quantity::QuadraticDamping => "N m s^2/rad^2",
            Quantity::CoulombFriction | Quantity::Offset => "N m",
        }
    }

    /// Column header with the unit of motion along a line.
    pub fn column(self) -> &'static str {
        match self {
            Quantity::Mass => "mass_kg",
            Quantity::Damping => "damping_N_s_per_m",
            Quantity::Stiffness => "stiffness_N_per_m",
            Quantity::CubicStiffness => "cubic_stiffness_N_per_m3",
            Quantity::QuadraticDamping => "quadratic_damping_N_s2_per_m2",
            Quantity::CoulombFriction => "coulomb_friction_N",
            Quantity::Offset => "offset_N",
        }
    }

    /// Column header with the unit of a rotation.
    pub fn angular_column(self) -> &'static str {
        match self {
            Quantity::Mass => "mass_kg_m2",
            Quantity::Damping => "damping_N_m_s_per_rad",
            Quantity::Stiffness => "stiffness_N_m_per_rad",
            Quantity::CubicStiffness => "cubic_stiffness_N_m_per_rad3",
            Quantity::QuadraticDamping => "quadratic_damping_N_m_s2_per_rad2",
            Quantity::CoulombFriction => "coulomb_friction_N_m",
            Quantity::Offset => "offset_N_m",
        }
    }

    /// All quantities, in the order in which the program holds them.
    pub const ALL: [Self; 7] = [
        Self::Mass,
        Self::Damping,
        Self::Stiffness,
        Self::CubicStiffness,
        Self::QuadraticDamping,
        Self::CoulombFriction,
        Self::Offset,
    ];

    /// The force term that this function multiplies; `None` for the mass. `friction_width` is the
    /// width of Coulomb friction, m/s.
    pub fn term(self, friction_width: f64) -> Option<Term> {
        match self {
            Quantity::Mass => None,
            Quantity::Damping => Some(Term::Damping),
            Quantity::Stiffness => Some(Term::Stiffness),
            Quantity::CubicStiffness => Some(Term::CubicStiffness),
            Quantity::QuadraticDamping => Some(Term::QuadraticDamping),
            Quantity::CoulombFriction => Some(Term::CoulombFriction {
                width: friction_width,
            }),
            Quantity::Offset => Some(Term::Offset),
        }
    }
}
