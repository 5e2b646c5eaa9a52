//! Costs along paths between two minima.

use crate::problem::Problem;
use crate::system::NodalCoefficients;

/// Costs along two paths between two points; infinite where the simulation fails.
#[derive(Debug, Clone, PartialEq)]
pub struct Paths {
    /// Costs along the straight path `(1 - s) a + s b`, both ends included.
    pub straight: Vec<f64>,
    /// Costs along the path of the scaling ambiguity: the mass is `m_a^(1-s) m_b^s` and the ratios to the mass vary linearly,
    /// so that only the common factor varies between systems with equal ratios. `None` where the bases do not contain the
    /// path, for example where a function is fixed.
    pub scaling: Option<Vec<f64>>,
}

impl Paths {
    /// True if the cost along one of the paths never exceeds the higher end's by more than the share `rise`: the minima are
    /// connected. False is no proof of the opposite.
    pub fn one_valley(&self, rise: f64) -> bool {
        let low = |path: &Vec<f64>| {
            let ends = path[0].max(path[path.len() - 1]);
            path.iter().all(|cost| *cost <= ends + rise)
        };
        low(&self.straight) || self.scaling.as_ref().is_some_and(low)
    }
}

/// Costs at `points` steps between the parameters `a` and `b`.
pub fn between(problem: &Problem, a: &[f64], b: &[f64], points: usize) -> Paths {
    let points = points.max(1);
    let shares: Vec<f64> = (0..=points).map(|i| i as f64 / points as f64).collect();
    let cost = |theta: &[f64]| problem.evaluate(theta).map_or(f64::INFINITY, |e| e.cost);
    let mix = |s: f64| -> Vec<f64> {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (1.0 - s) * a + s * b).collect()
    };
    let straight = shares.iter().map(|s| cost(&mix(*s))).collect();
    let scaling: Option<Vec<Vec<f64>>> = shares
        .iter()
        .map(|s| along_scaling(problem, a, b, *s, mix(*s)))
        .collect();
    Paths {
        straight,
        scaling: scaling.map(|path| path.iter().map(|theta| cost(theta)).collect()),
    }
}

/// Point `s` of the scaling path; functions of single experiments and scalars vary linearly.
fn along_scaling(
    problem: &Problem,
    a: &[f64],
    b: &[f64],
    s: f64,
    straight: Vec<f64>,
) -> Option<Vec<f64>> {
    // A known part fixes the scale.
    let has_known_part = (problem.functions.iter()).any(|f| f.is_known_part);
    (!has_known_part).then_some(())?;
    let mut theta = straight;
    let (one, two) = (problem.functions.nodal(a), problem.functions.nodal(b));
    if one.mass.iter().chain(&two.mass).any(|m| *m <= 0.0) {
        return None;
    }
    let between = mixed(&one, &two, s);
    let grid = &problem.system.grid;
    let assembly = problem.functions.coefficient_set(0);
    for (&f, values) in assembly.iter().zip(between.functions()) {
        let basis = problem.functions.get(f).basis.as_ref()?;
        let range = problem.functions.ranges()[f].clone();
        theta[range].copy_from_slice(&basis.project(grid, values)?);
    }
    Some(theta)
}

fn mixed(one: &NodalCoefficients, two: &NodalCoefficients, s: f64) -> NodalCoefficients {
    let pairs = one.mass.iter().zip(&two.mass);
    let mass: Vec<f64> = pairs.map(|(a, b)| a.powf(1.0 - s) * b.powf(s)).collect();
    let coefficient = |p: &Vec<f64>, q: &Vec<f64>| -> Vec<f64> {
        let ratio = |i: usize| (1.0 - s) * p[i] / one.mass[i] + s * q[i] / two.mass[i];
        (0..p.len()).map(|i| mass[i] * ratio(i)).collect()
    };
    let pairs = one.coefficients.iter().zip(&two.coefficients);
    let coefficients = pairs.map(|(p, q)| coefficient(p, q)).collect();
    NodalCoefficients { mass, coefficients }
}
