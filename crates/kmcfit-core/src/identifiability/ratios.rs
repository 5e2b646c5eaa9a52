//! Ratios of coefficients at one time, with their derivatives for the delta method.

use crate::problem::Problem;
use crate::structure::Law;
use std::f64::consts::TAU;

/// A ratio of the shared coefficient set.
pub struct RatioOfSet {
    /// Name of its band.
    pub name: &'static str,
    pub unit: &'static str,
    /// For each of its coefficients the functions whose sum it is.
    pub coefficients: Vec<Vec<usize>>,
    pub ratio: Ratio,
}

/// `k/m`, `c/m`, natural frequency and damping ratio of the shared coefficient set, as far as the system has these terms; none of a structure of
/// several coordinates.
pub fn ratios_of_set(problem: &Problem) -> Vec<RatioOfSet> {
    if !problem.system.structure.is_one() {
        return Vec::new();
    }
    let set = problem.functions.coefficient_set(0);
    let terms = problem.system.laws();
    // The functions of a coefficient: its own and its known parts.
    let at_place = |place: usize| -> Vec<usize> {
        let parts = set.parts().filter(|(other, _)| *other == place);
        parts.map(|(_, f)| f).collect()
    };
    let of = |term: Law| {
        let place = terms.iter().position(|t| *t == term)?;
        Some(at_place(place + 1))
    };
    let (m, damping, stiffness) = (at_place(0), of(Law::Damping), of(Law::Stiffness));
    let of_set = |name, unit, coefficients: &[&Vec<usize>], ratio| RatioOfSet {
        name,
        unit,
        coefficients: coefficients.iter().copied().cloned().collect(),
        ratio,
    };
    let mut ratios = Vec::new();
    ratios.extend(
        stiffness
            .iter()
            .map(|k| of_set("k/m", "1/s^2", &[k, &m], over_mass as Ratio)),
    );
    ratios.extend(
        damping
            .iter()
            .map(|c| of_set("c/m", "1/s", &[c, &m], over_mass as Ratio)),
    );
    if let Some(k) = &stiffness {
        ratios.push(of_set("natural frequency", "Hz", &[k, &m], frequency));
        let of_damping = |c| of_set("damping ratio", "", &[c, k, &m], damping_ratio as Ratio);
        ratios.extend(damping.iter().map(of_damping));
    }
    ratios
}

impl RatioOfSet {
    /// All functions of the ratio.
    pub fn functions(&self) -> Vec<usize> {
        self.coefficients.iter().flatten().copied().collect()
    }

    /// The ratio at some nodes, and its slopes in the [`functions`](Self::functions), those of a node after one another; `values` are those
    /// of each function at these nodes.
    pub fn at_nodes(&self, values: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
        let count = values.first().map_or(0, Vec::len);
        let (mut ratios, mut all) = (Vec::with_capacity(count), Vec::new());
        let at_node = |i: usize| {
            let mut sums = [0.0; MOST_COEFFICIENTS];
            for (sum, functions) in sums.iter_mut().zip(&self.coefficients) {
                *sum = functions.iter().map(|f| values[*f][i]).sum();
            }
            (self.ratio)(sums)
        };
        for (value, slopes) in (0..count).map(at_node) {
            ratios.push(value);
            for (functions, slope) in self.coefficients.iter().zip(slopes) {
                all.extend(functions.iter().map(|_| slope));
            }
        }
        (ratios, all)
    }
}

/// Most coefficients of a ratio.
const MOST_COEFFICIENTS: usize = 3;

/// A ratio at a node: its value and its derivatives with respect to the coefficients, zero for those that it does not have.
pub type Ratio = fn([f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]);

/// `p/m`.
pub fn over_mass(at: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let ratio = at[0] / at[1];
    (ratio, [1.0 / at[1], -ratio / at[1], 0.0])
}

/// `f = sqrt(k/m)/(2 pi)`: `df = f/2 (dk/k - dm/m)`.
pub fn frequency(at: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let frequency = (at[0] / at[1]).sqrt() / TAU;
    let half = |p: f64| 0.5 * frequency / p;
    (frequency, [half(at[0]), -half(at[1]), 0.0])
}

/// `zeta = c/(2 sqrt(k m))`: `d zeta = dc/(2 sqrt(k m)) - zeta/2 (dk/k + dm/m)`.
pub fn damping_ratio(at: [f64; MOST_COEFFICIENTS]) -> (f64, [f64; MOST_COEFFICIENTS]) {
    let [c, k, m] = at;
    let root = if k > 0.0 {
        2.0 * (k * m).sqrt()
    } else {
        f64::NAN
    };
    let zeta = c / root;
    (zeta, [1.0 / root, -0.5 * zeta / k, -0.5 * zeta / m])
}
