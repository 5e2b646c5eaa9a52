//! Coefficients and their elements: the table of names, units and laws, and the laws with the derivatives of their forces.
//!
//! To add an element: a variant of [`Law`] with `phi` and `slopes`, a row of the table, and a test; a kind that the program names gets a constant of
//! [`CoefficientKind`].

use crate::simd::Real;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

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
    /// `p(t) (x - (s(x + width) - s(x - width)) / 2)` with `s(u) = sqrt(u^2 + (width / 1000)^2)`, p in N/m: a spring that acts beyond a
    /// clearance on both sides. The force differs from that with sharp corners by at most `p width / 2000`.
    Gap {
        /// Clearance on each side, m; positive.
        width: f64,
    },
    /// Hysteresis of Bouc and Wen: `p(t) z`, p in N/m, of an internal state with `z' = r - |z|^(n-1) (beta(t) |r| z + gamma(t) r |z|)`, `z` in m,
    /// `beta` and `gamma` in 1/m^n (Wen, Journal of the Engineering Mechanics Division 102, 1976). Its steps are assembled.
    BoucWen {
        /// `n`, at least 1.
        exponent: u32,
    },
}

impl Law {
    /// Width of a law that has one.
    pub fn width(&self) -> Option<f64> {
        match self {
            Law::CoulombFriction { width } | Law::Gap { width } => Some(*width),
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
            Law::Gap { width } => {
                let [above, below] = [width, -width].map(|end| corner(x + x.like(end), width));
                x - (above - below).scale(0.5)
            }
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
            Law::Gap { width } => {
                let ends = [width, -width].map(|end| x + x.like(end));
                let [above, below] = ends.map(|u| u / corner(u, width));
                [Some(x.like(1.0) - (above - below).scale(0.5)), None]
            }
            Law::Offset | Law::BoucWen { .. } => [None, None],
        }
    }
}

/// `|u|` with a corner that is rounded over a thousandth of `width`.
#[inline(always)]
fn corner<T: Real>(u: T, width: f64) -> T {
    let rounding = 1e-3 * width;
    (u * u + u.like(rounding * rounding)).sqrt()
}

/// A row of the table.
#[derive(Clone, Copy)]
pub struct CoefficientRow {
    /// Key in a model file and in `result.json`.
    pub name: &'static str,
    /// Key of an element with its law in a structure; `None` for the mass.
    pub element: Option<&'static str>,
    /// Symbol in the equation of motion.
    pub symbol: &'static str,
    /// In a sentence, with its article.
    pub words: &'static str,
    /// Meaning, with its force.
    pub text: &'static str,
    /// Example of its value in a model file.
    pub example: &'static str,
    /// SI unit for a translation (displacement in m), and for a rotation (displacement in rad, moment in place of force).
    pub units: [&'static str; 2],
    /// The same for its ratio to the mass.
    pub units_over_mass: [&'static str; 2],
    /// Width of its law, in words with its unit; `None` for laws without one.
    pub width: Option<&'static str>,
    /// Law of its force `p(t) phi`, for a width; `None` for the mass.
    pub law: Option<fn(f64) -> Law>,
}

/// The rows in program order: a new element is a row here, a variant of [`Law`] with force and slopes, and its test.
const TABLE: [CoefficientRow; 10] = [
    CoefficientRow {
        name: "mass",
        element: None,
        symbol: "m",
        words: "the mass",
        text: "Mass m(t).",
        example: "{basis: nodal, start: 2.0}",
        units: ["kg", "kg m^2"],
        units_over_mass: ["", ""],
        width: None,
        law: None,
    },
    CoefficientRow {
        name: "damping",
        element: Some("damper"),
        symbol: "c",
        words: "damping",
        text: "Damping c(t), with the force c y'.",
        example: "{basis: constant, start: 1.0}",
        units: ["N s/m", "N m s/rad"],
        units_over_mass: ["1/s", "1/s"],
        width: None,
        law: Some(|_| Law::Damping),
    },
    CoefficientRow {
        name: "stiffness",
        element: Some("spring"),
        symbol: "k",
        words: "a stiffness",
        text: "Stiffness k(t), with the force k y.",
        example: "{fixed: 1.0}",
        units: ["N/m", "N m/rad"],
        units_over_mass: ["1/s^2", "1/s^2"],
        width: None,
        law: Some(|_| Law::Stiffness),
    },
    CoefficientRow {
        name: "quadratic_stiffness",
        element: Some("quadratic_spring"),
        symbol: "k2",
        words: "a quadratic stiffness",
        text: "Quadratic stiffness k2(t), with the force k2 y^2: the asymmetric part of a spring.",
        example: "{basis: constant, start: 0.0}",
        units: ["N/m^2", "N m/rad^2"],
        units_over_mass: ["1/(m s^2)", "1/(rad s^2)"],
        width: None,
        law: Some(|_| Law::QuadraticStiffness),
    },
    CoefficientRow {
        name: "cubic_stiffness",
        element: Some("cubic_spring"),
        symbol: "k3",
        words: "a cubic stiffness",
        text: "Cubic stiffness k3(t), with the force k3 y^3.",
        example: "{basis: constant, start: 0.0}",
        units: ["N/m^3", "N m/rad^3"],
        units_over_mass: ["1/(m^2 s^2)", "1/(rad^2 s^2)"],
        width: None,
        law: Some(|_| Law::CubicStiffness),
    },
    CoefficientRow {
        name: "quintic_stiffness",
        element: Some("quintic_spring"),
        symbol: "k5",
        words: "a quintic stiffness",
        text: "Quintic stiffness k5(t), with the force k5 y^5.",
        example: "{basis: constant, start: 0.0}",
        units: ["N/m^5", "N m/rad^5"],
        units_over_mass: ["1/(m^4 s^2)", "1/(rad^4 s^2)"],
        width: None,
        law: Some(|_| Law::QuinticStiffness),
    },
    CoefficientRow {
        name: "quadratic_damping",
        element: Some("quadratic_damper"),
        symbol: "c2",
        words: "quadratic damping",
        text: "Quadratic damping c2(t), with the force c2 |y'| y'.",
        example: "{basis: constant, start: 0.0}",
        units: ["N s^2/m^2", "N m s^2/rad^2"],
        units_over_mass: ["1/m", "1/rad"],
        width: None,
        law: Some(|_| Law::QuadraticDamping),
    },
    CoefficientRow {
        name: "coulomb_friction",
        element: Some("friction"),
        symbol: "F_c",
        words: "Coulomb friction",
        text: "Coulomb friction, with the force f y'/sqrt(y'^2 + width^2), width in m/s.",
        example: "{basis: constant, start: 0.5, width: 0.01}",
        units: ["N", "N m"],
        units_over_mass: ["m/s^2", "rad/s^2"],
        width: Some(
            "the speed in m/s over which the sign of v is smoothed, well below those of the response",
        ),
        law: Some(|width| Law::CoulombFriction { width }),
    },
    CoefficientRow {
        name: "static_force",
        element: Some("static_force"),
        symbol: "F_0",
        words: "a static force",
        text: "Static force, which acts against positive y.",
        example: "{fixed: 0.0}",
        units: ["N", "N m"],
        units_over_mass: ["m/s^2", "rad/s^2"],
        width: None,
        law: Some(|_| Law::Offset),
    },
    CoefficientRow {
        name: "gap_stiffness",
        element: Some("gap_spring"),
        symbol: "k_g",
        words: "a spring beyond a gap",
        text: "Stiffness of a spring that acts beyond a clearance of `width` (m) on both sides.",
        example: "{basis: constant, start: 100.0, width: 0.001}",
        units: ["N/m", "N m/rad"],
        units_over_mass: ["1/s^2", "1/s^2"],
        width: Some("the clearance on each side in m, which some of the motion exceeds"),
        law: Some(|width| Law::Gap { width }),
    },
];

/// Largest number of elements of one coordinate whose steps are compiled: one of each row; others are assembled.
pub const MOST_ELEMENTS: usize = TABLE.len() - 1;

/// Kind of a coefficient function of the equation of motion: a row of the table.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CoefficientKind(u8);

#[allow(missing_docs, reason = "see the rows")]
impl CoefficientKind {
    pub const MASS: Self = Self(0);
    pub const DAMPING: Self = Self(1);
    pub const STIFFNESS: Self = Self(2);
    pub const QUADRATIC_STIFFNESS: Self = Self(3);
    pub const CUBIC_STIFFNESS: Self = Self(4);
    pub const QUINTIC_STIFFNESS: Self = Self(5);
    pub const QUADRATIC_DAMPING: Self = Self(6);
    pub const COULOMB_FRICTION: Self = Self(7);
    pub const STATIC_FORCE: Self = Self(8);
}

impl CoefficientKind {
    /// Number of kinds.
    pub const COUNT: usize = TABLE.len();

    /// All kinds, in program order.
    pub const ALL: [Self; Self::COUNT] = {
        let mut all = [Self(0); Self::COUNT];
        let mut i = 1;
        while i < all.len() {
            all[i] = Self(i as u8);
            i += 1;
        }
        all
    };

    /// Its row.
    pub const fn row(self) -> &'static CoefficientRow {
        const ROWS: &[CoefficientRow; CoefficientKind::COUNT] = &TABLE;
        &ROWS[self.0 as usize]
    }

    /// The kind with the name `name`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Key in a model file and in `result.json`.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Symbol in the equation of motion.
    pub fn symbol(self) -> &'static str {
        self.row().symbol
    }

    /// SI unit when the displacement is in m.
    pub fn unit(self) -> &'static str {
        self.row().units[0]
    }

    /// SI unit for a rotation: displacement in rad, moment in place of force.
    pub fn angular_unit(self) -> &'static str {
        self.row().units[1]
    }

    /// Column header: name and unit, for a translation or a rotation.
    pub fn column(self, is_rotation: bool) -> String {
        let CoefficientRow { name, units, .. } = self.row();
        let unit = units[usize::from(is_rotation)];
        let unit = unit
            .replace('/', "_per_")
            .replace(' ', "_")
            .replace('^', "");
        format!("{name}_{unit}")
    }

    /// Law of the force with this coefficient; `None` for the mass. `width` is that of laws that have one.
    pub fn law(self, width: f64) -> Option<Law> {
        self.row().law.map(|law| law(width))
    }
}

impl fmt::Debug for CoefficientKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for CoefficientKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for CoefficientKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::custom(format!("no coefficient `{name}`")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kinds known by name are their rows, and units follow from force, displacement and mass.
    #[test]
    fn rows_are_consistent() {
        assert_eq!(CoefficientKind::STATIC_FORCE.name(), "static_force");
        assert_eq!(CoefficientKind::COULOMB_FRICTION.name(), "coulomb_friction");
        assert_eq!(CoefficientKind::MASS.column(true), "mass_kg_m2");
        assert_eq!(
            CoefficientKind::QUADRATIC_DAMPING.column(false),
            "quadratic_damping_N_s2_per_m2"
        );
        assert_eq!(
            CoefficientKind::DAMPING.column(true),
            "damping_N_m_s_per_rad"
        );
        for kind in CoefficientKind::ALL {
            assert_eq!(CoefficientKind::named(kind.name()), Some(kind));
            assert_eq!(kind.law(0.1).is_none(), kind == CoefficientKind::MASS);
        }
    }
}
