//! Names and units of the functions.

use crate::system::Term;

/// Which coefficient function of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoefficientKind {
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

impl CoefficientKind {
    /// Key in a model file and in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "mass",
            CoefficientKind::Damping => "damping",
            CoefficientKind::Stiffness => "stiffness",
            CoefficientKind::CubicStiffness => "cubic_stiffness",
            CoefficientKind::QuadraticDamping => "quadratic_damping",
            CoefficientKind::CoulombFriction => "coulomb_friction",
            CoefficientKind::Offset => "offset",
        }
    }

    /// Symbol in the equation of motion.
    pub fn symbol(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "m",
            CoefficientKind::Damping => "c",
            CoefficientKind::Stiffness => "k",
            CoefficientKind::CubicStiffness => "k3",
            CoefficientKind::QuadraticDamping => "c2",
            CoefficientKind::CoulombFriction => "F_c",
            CoefficientKind::Offset => "F_0",
        }
    }

    /// SI unit when the displacement is in m.
    pub fn unit(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "kg",
            CoefficientKind::Damping => "N s/m",
            CoefficientKind::Stiffness => "N/m",
            CoefficientKind::CubicStiffness => "N/m^3",
            CoefficientKind::QuadraticDamping => "N s^2/m^2",
            CoefficientKind::CoulombFriction => "N",
            CoefficientKind::Offset => "N",
        }
    }

    /// SI unit where the motion is a rotation: displacement in rad, force a moment.
    pub fn angular_unit(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "kg m^2",
            CoefficientKind::Damping => "N m s/rad",
            CoefficientKind::Stiffness => "N m/rad",
            CoefficientKind::CubicStiffness => "N m/rad^3",
            CoefficientKind::QuadraticDamping => "N m s^2/rad^2",
            CoefficientKind::CoulombFriction | CoefficientKind::Offset => "N m",
        }
    }

    /// Column header with the unit of motion along a line.
    pub fn column(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "mass_kg",
            CoefficientKind::Damping => "damping_N_s_per_m",
            CoefficientKind::Stiffness => "stiffness_N_per_m",
            CoefficientKind::CubicStiffness => "cubic_stiffness_N_per_m3",
            CoefficientKind::QuadraticDamping => "quadratic_damping_N_s2_per_m2",
            CoefficientKind::CoulombFriction => "coulomb_friction_N",
            CoefficientKind::Offset => "offset_N",
        }
    }

    /// Column header with the unit of a rotation.
    pub fn angular_column(self) -> &'static str {
        match self {
            CoefficientKind::Mass => "mass_kg_m2",
            CoefficientKind::Damping => "damping_N_m_s_per_rad",
            CoefficientKind::Stiffness => "stiffness_N_m_per_rad",
            CoefficientKind::CubicStiffness => "cubic_stiffness_N_m_per_rad3",
            CoefficientKind::QuadraticDamping => "quadratic_damping_N_m_s2_per_rad2",
            CoefficientKind::CoulombFriction => "coulomb_friction_N_m",
            CoefficientKind::Offset => "offset_N_m",
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
            CoefficientKind::Mass => None,
            CoefficientKind::Damping => Some(Term::Damping),
            CoefficientKind::Stiffness => Some(Term::Stiffness),
            CoefficientKind::CubicStiffness => Some(Term::CubicStiffness),
            CoefficientKind::QuadraticDamping => Some(Term::QuadraticDamping),
            CoefficientKind::CoulombFriction => Some(Term::CoulombFriction {
                width: friction_width,
            }),
            CoefficientKind::Offset => Some(Term::Offset),
        }
    }
}
