//! Errors of an identified system relative to the known true system, roughness of the identified coefficients, and a test
//! whether two true systems are the same.

use crate::functions::Ratio;
use crate::structure::Law;
use crate::system::NodalCoefficients;
use serde::Serialize;

/// Relative error of `k/m` and `c/m` below which a system counts as recovered, dimensionless: above the errors of time
/// integration and early stopping, below what is visible in a plot.
pub const RECOVERY_TOLERANCE: f64 = 1e-3;

/// Largest absolute errors over all nodes, in SI units (for a rotation with kg m² in place of kg, and so on), and relative to
/// true values, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TruthErrors {
    /// Error of the mass, kg.
    pub mass: f64,
    /// Error of the damping, N s/m.
    pub damping: f64,
    /// Error of the stiffness, N/m.
    pub stiffness: f64,
    /// Error of `k/m`, 1/s^2.
    pub k_over_m: f64,
    /// Error of `c/m`, 1/s.
    pub c_over_m: f64,
    /// Error of the mass, relative to the largest true mass.
    pub mass_relative: f64,
    /// Error of `k/m`, relative to the largest true `|k/m|`.
    pub k_over_m_relative: f64,
    /// Error of `c/m`, dimensionless: relative to the largest true `|c/m|`, or to the critical value `2 sqrt(max |k/m|)` (1/s) if
    /// the true `|c/m|` is everywhere below [`RECOVERY_TOLERANCE`] times that value, i.e. for a damping ratio below about 0.001.
    pub c_over_m_relative: f64,
    /// True if `c_over_m_relative` is relative to the critical value because the true damping is negligible.
    #[serde(rename = "undamped")]
    pub relative_to_critical: bool,
}

impl TruthErrors {
    /// Errors of `nodal` against `truth`, on the same grid, for elements with these laws, damping and stiffness first.
    pub fn of(laws: &[Law], nodal: &NodalCoefficients, truth: &NodalCoefficients) -> Self {
        let compared = [Ratio::StiffnessOverMass, Ratio::DampingOverMass].map(|ratio| {
            let [found, real] = [nodal, truth].map(|nodal| ratio.at_nodes(laws, nodal));
            [largest_error(&found, &real), largest(&real)]
        });
        let [[k_over_m, stiffness_scale], [c_over_m, real_damping]] = compared;
        let mass = largest_error(&nodal.inertias[0], &truth.inertias[0]);
        let critical = 2.0 * stiffness_scale.sqrt();
        let relative_to_critical = real_damping < RECOVERY_TOLERANCE * critical;
        let damping_scale = match relative_to_critical {
            true => critical,
            false => real_damping,
        };
        let relative = |error: f64, scale: f64| if error == 0.0 { 0.0 } else { error / scale };
        Self {
            mass,
            damping: largest_error(&nodal.coefficients[0], &truth.coefficients[0]),
            stiffness: largest_error(&nodal.coefficients[1], &truth.coefficients[1]),
            k_over_m,
            c_over_m,
            mass_relative: relative(mass, largest(&truth.inertias[0])),
            k_over_m_relative: relative(k_over_m, stiffness_scale),
            c_over_m_relative: relative(c_over_m, damping_scale),
            relative_to_critical,
        }
    }

    /// True if the relative errors of `k/m` and `c/m` are within a tolerance.
    pub fn within(&self, tolerance: f64) -> bool {
        self.k_over_m_relative < tolerance && self.c_over_m_relative < tolerance
    }
}

fn largest(f: &[f64]) -> f64 {
    f.iter().map(|x| x.abs()).fold(0.0, f64::max)
}

/// Returns the largest absolute difference; a difference that is NaN, e.g. 0/0 at zero mass, counts as infinite.
fn largest_error(found: &[f64], truth: &[f64]) -> f64 {
    let distance = |(a, b): (&f64, &f64)| {
        let distance = (a - b).abs();
        if distance.is_nan() {
            f64::INFINITY
        } else {
            distance
        }
    };
    found.iter().zip(truth).map(distance).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [Law; 2] = [Law::Damping, Law::Stiffness];

    fn nodal(mass: &[f64], damping: f64, stiffness: f64) -> NodalCoefficients {
        let constant = |value| vec![value; mass.len()];
        NodalCoefficients {
            inertias: vec![mass.to_vec()],
            coefficients: vec![constant(damping), constant(stiffness)],
        }
    }

    #[test]
    fn systems_with_a_common_factor_are_equal() {
        let truth = nodal(&[1.0, 0.5, 0.8], 0.1, 1.0);
        let doubled = nodal(&[2.0, 1.0, 1.6], 0.2, 2.0);
        let errors = TruthErrors::of(&LAWS, &doubled, &truth);
        assert!(errors.within(RECOVERY_TOLERANCE) && !errors.relative_to_critical);
        assert_eq!(errors.mass_relative, 1.0);
    }

    #[test]
    fn negligible_damping_is_compared_with_critical_damping() {
        let truth = nodal(&[1.0, 1.0], 0.0, 1.0);
        let errors = TruthErrors::of(&LAWS, &nodal(&[1.0, 1.0], 0.02, 1.0), &truth);
        assert!(errors.relative_to_critical);
        assert!((errors.c_over_m_relative - 0.01).abs() < 1e-15);
        assert!(!errors.within(RECOVERY_TOLERANCE));
    }

    #[test]
    fn a_system_without_mass_is_not_recovered() {
        let truth = nodal(&[1.0, 1.0], 0.0, 1.0);
        let errors = TruthErrors::of(&LAWS, &nodal(&[1.0, 0.0], 0.0, 1.0), &truth);
        assert!(!errors.within(RECOVERY_TOLERANCE));
    }
}
