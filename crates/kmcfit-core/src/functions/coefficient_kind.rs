//! Kinds of coefficient functions, with names and units.

use crate::structure::Law;

/// Kind of a coefficient function of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CoefficientKind {
    /// Mass `m(t)`.
    Mass,
    /// Damping `c(t)`.
    Damping,
    /// Stiffness `k(t)`.
    Stiffness,
    /// Quadratic stiffness, the factor of `y^2`.
    QuadraticStiffness,
    /// Cubic stiffness, the factor of `y^3`.
    CubicStiffness,
    /// Quintic stiffness, the factor of `y^5`.
    QuinticStiffness,
    /// Quadratic damping, the factor of `|v| v`.
    QuadraticDamping,
    /// Coulomb friction, the factor of a smoothed sign of `v`.
    CoulombFriction,
    /// Static force.
    #[serde(rename = "static_force")]
    Offset,
}

/// Key, symbol, unit and column header of each kind, then unit and column header for a rotation.
const NAMES: [[&str; 6]; 9] = [
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
        "quadratic_stiffness",
        "k2",
        "N/m^2",
        "quadratic_stiffness_N_per_m2",
        "N m/rad^2",
        "quadratic_stiffness_N_m_per_rad2",
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
        "quintic_stiffness",
        "k5",
        "N/m^5",
        "quintic_stiffness_N_per_m5",
        "N m/rad^5",
        "quintic_stiffness_N_m_per_rad5",
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

    /// Column header with the unit for a translation.
    pub fn column(self) -> &'static str {
        NAMES[self as usize][3]
    }

    /// SI unit for a rotation: displacement in rad, moment in place of force.
    pub fn angular_unit(self) -> &'static str {
        NAMES[self as usize][4]
    }

    /// Column header with the unit for a rotation.
    pub fn angular_column(self) -> &'static str {
        NAMES[self as usize][5]
    }

    /// All kinds, in program order.
    pub const ALL: [Self; 9] = [
        Self::Mass,
        Self::Damping,
        Self::Stiffness,
        Self::QuadraticStiffness,
        Self::CubicStiffness,
        Self::QuinticStiffness,
        Self::QuadraticDamping,
        Self::CoulombFriction,
        Self::Offset,
    ];

    /// Force term multiplied by this function; `None` for the mass. `friction_width` is the width of Coulomb friction, m/s.
    pub fn term(self, friction_width: f64) -> Option<Law> {
        match self {
            CoefficientKind::Mass => None,
            CoefficientKind::Damping => Some(Law::Damping),
            CoefficientKind::Stiffness => Some(Law::Stiffness),
            CoefficientKind::QuadraticStiffness => Some(Law::QuadraticStiffness),
            CoefficientKind::CubicStiffness => Some(Law::CubicStiffness),
            CoefficientKind::QuinticStiffness => Some(Law::QuinticStiffness),
            CoefficientKind::QuadraticDamping => Some(Law::QuadraticDamping),
            CoefficientKind::CoulombFriction => Some(Law::CoulombFriction {
                width: friction_width,
            }),
            CoefficientKind::Offset => Some(Law::Offset),
        }
    }
}
