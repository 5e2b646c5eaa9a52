//! Ratios of stiffness and damping to mass, natural frequency and damping ratio: the table of their names, units and formulas.

use crate::structure::Law;
use crate::system::NodalCoefficients;
use std::f64::consts::TAU;

/// Most coefficients of a ratio.
pub(crate) const MOST_COEFFICIENTS: usize = 3;

/// A formula of a ratio: its value and its derivatives in the coefficients, zero for those that it does not have.
pub(crate) type Formula = fn([f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]);

/// A ratio of the coefficients of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ratio {
    /// `k/m`, 1/s^2.
    StiffnessOverMass,
    /// `c/m`, 1/s.
    DampingOverMass,
    /// `sqrt(k/m) / (2 pi)`, Hz; NaN where `k/m` is negative.
    NaturalFrequency,
    /// `c / (2 sqrt(k m))`; NaN where `k m` is not positive.
    DampingRatio,
}

struct RatioRow {
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    column: &'static str,
    /// Laws of the elements of its first coefficients; the mass is the one after them.
    laws: &'static [Law],
    formula: Formula,
}

/// In the order of [`Ratio::ALL`].
const ROWS: [RatioRow; 4] = [
    RatioRow {
        key: "k_over_m",
        name: "k/m",
        unit: "1/s^2",
        column: "k_over_m_per_s2",
        laws: &[Law::Stiffness],
        formula: over_mass,
    },
    RatioRow {
        key: "c_over_m",
        name: "c/m",
        unit: "1/s",
        column: "c_over_m_per_s",
        laws: &[Law::Damping],
        formula: over_mass,
    },
    RatioRow {
        key: "natural_frequency",
        name: "natural frequency",
        unit: "Hz",
        column: "natural_frequency_Hz",
        laws: &[Law::Stiffness],
        formula: frequency,
    },
    RatioRow {
        key: "damping_ratio",
        name: "damping ratio",
        unit: "",
        column: "damping_ratio",
        laws: &[Law::Damping, Law::Stiffness],
        formula: damping_ratio,
    },
];

impl Ratio {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::StiffnessOverMass,
        Self::DampingOverMass,
        Self::NaturalFrequency,
        Self::DampingRatio,
    ];

    const fn row(self) -> &'static RatioRow {
        &ROWS[self as usize]
    }

    /// The ratio with this key or name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|ratio| ratio.key() == name || ratio.name() == name)
    }

    /// Name in files: `k_over_m`, `natural_frequency`.
    pub const fn key(self) -> &'static str {
        self.row().key
    }

    /// Name in reports: `k/m`, `natural frequency`.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Unit; empty if dimensionless.
    pub const fn unit(self) -> &'static str {
        self.row().unit
    }

    /// Header of its column in tables: name and unit.
    pub const fn column(self) -> &'static str {
        self.row().column
    }

    pub(crate) fn formula(self) -> Formula {
        self.row().formula
    }

    /// Indices of its coefficients in a coefficient set of one mass and elements with these laws, in the order of the formula; `None` without
    /// them.
    pub(crate) fn indices(self, laws: &[Law]) -> Option<Vec<usize>> {
        let of = |law: &Law| Some(1 + laws.iter().position(|other| other == law)?);
        let elements: Option<Vec<usize>> = self.row().laws.iter().map(of).collect();
        Some([elements?, vec![0]].concat())
    }

    /// Values at the nodes for the coefficients of one mass and elements with these laws; empty without them.
    pub fn at_nodes(self, laws: &[Law], nodal: &NodalCoefficients) -> Vec<f64> {
        let Some(indices) = self.indices(laws).filter(|_| nodal.inertias.len() == 1) else {
            return Vec::new();
        };
        let functions: Vec<&[f64]> = nodal.functions().collect();
        let value = |i: usize| {
            let mut at = [0.0; MOST_COEFFICIENTS];
            for (p, f) in at.iter_mut().zip(&indices) {
                *p = functions[*f][i];
            }
            self.formula()(at).0
        };
        (0..nodal.nodes()).map(value).collect()
    }
}

/// `p/m`.
fn over_mass([p, m, _]: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let ratio = p / m;
    (ratio, [1.0 / m, -ratio / m, 0.0])
}

/// `f = sqrt(k/m)/(2 pi)`: `df = f/2 (dk/k - dm/m)`.
fn frequency([k, m, _]: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let frequency = (k / m).sqrt() / TAU;
    (frequency, [0.5 * frequency / k, -0.5 * frequency / m, 0.0])
}

/// `zeta = c/(2 sqrt(k m))`: `d zeta = dc/(2 sqrt(k m)) - zeta/2 (dk/k + dm/m)`.
fn damping_ratio([c, k, m]: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let root = if k > 0.0 {
        2.0 * (k * m).sqrt()
    } else {
        f64::NAN
    };
    let zeta = c / root;
    (zeta, [1.0 / root, -0.5 * zeta / k, -0.5 * zeta / m])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::Structure;

    /// One coordinate is the special case of the natural frequencies of a structure, and the derivatives are those of central differences.
    #[test]
    fn the_frequency_is_that_of_the_structure_and_the_derivatives_are_right() {
        let structure = Structure::one(vec![Law::Damping, Law::CubicStiffness, Law::Stiffness]);
        let (m, c, k) = (2.0, 0.3, 50.0);
        let nodal = NodalCoefficients {
            inertias: vec![vec![m; 2]],
            coefficients: vec![vec![c; 2], vec![7.0; 2], vec![k; 2]],
        };
        let found = Ratio::NaturalFrequency.at_nodes(structure.laws(), &nodal);
        let square = structure.eigenvalues(&[m, c, 7.0, k]).unwrap()[0];
        assert!((found[1] - square.sqrt() / TAU).abs() < 1e-15);
        assert!(
            Ratio::DampingRatio
                .at_nodes(&[Law::Stiffness], &nodal)
                .is_empty()
        );
        for ratio in Ratio::ALL {
            let at = match ratio {
                Ratio::DampingRatio => [c, k, m],
                _ => [k, m, 0.0],
            };
            let (_, slopes) = ratio.formula()(at);
            for (j, slope) in slopes.into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut moved = at;
                    moved[j] += by;
                    ratio.formula()(moved).0
                };
                let expected = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slope - expected).abs() < 1e-8, "{ratio:?} {j}");
            }
        }
    }
}
