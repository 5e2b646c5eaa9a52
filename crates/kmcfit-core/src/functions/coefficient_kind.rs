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

/// Of each kind its key, symbol, unit and column header, and the last two where the response is a rotation.
const NAMES: [[&str; 6]; 7] = [
    ["mass", "m", "kg", "mass_kg", "kg m^2", "mass_kg_m2"],
    [
        "damping",
        "c",
        "N s/m",
        "damping_N_s_per_m",
        "N m s/rad",
        "damping_N_m_s_per_rad",
    ],
    [
        "stiffness",
        "k",
        "N/m",
        "stiffness_N_per_m",
        "N m/rad",
        "stiffness_N_m_per_rad",
    ],
    [
        "cubic_stiffness",
        "k3",
        "N/m^3",
        "cubic_stiffness_N_per_m3",
        "N m/rad^3",
        "cubic_stiffness_N_m_per_rad3",
    ],
    [
        "quadratic_damping",
        "c2",
        "N s^2/m^2",
        "quadratic_damping_N_s2_per_m2",
        "N m s^2/rad^2",
        "quadratic_damping_N_m_s2_per_rad2",
    ],
    [
        "coulomb_friction",
        "F_c",
        "N",
        "coulomb_friction_N",
        "N m",
        "coulomb_friction_N_m",
    ],
    [
        "static_force",
        "F_0",
        "N",
        "static_force_N",
        "N m",
        "static_force_N_m",
    ],
];

impl CoefficientKind {
    /// Key in a model file and in `result.json`.
    pub fn name(self) -> &'static str {
        NAMES[self as usize][0]
    }

    /// Symbol in the equation of motion.
    pub fn symbol(self) -> &'static str {
        NAMES[self as usize][1]
    }

    /// SI unit when the displacement is in m.
    pub fn unit(self) -> &'static str {
        NAMES[self as usize][2]
    }

    /// Column header with the unit of response along a line.
    pub fn column(self) -> &'static str {
        NAMES[self as usize][3]
    }

    /// SI unit where the response is a rotation: displacement in rad, force a moment.
    pub fn angular_unit(self) -> &'static str {
        NAMES[self as usize][4]
    }

    /// Column header with the unit of a rotation.
    pub fn angular_column(self) -> &'static str {
        NAMES[self as usize][5]
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
