//! Errors of an identified system relative to the known true system, roughness of the identified coefficients, and a test
//! whether two true systems are the same.

use crate::functions::Ratios;
use crate::system::{Grid, NodalCoefficients};
use serde::Serialize;

/// Relative error of `k/m` and `c/m` below which a system counts as recovered, dimensionless: above the errors of time
/// integration and early stopping, below what is visible in a plot.
pub const RECOVERY_TOLERANCE: f64 = 1e-3;
/// Largest difference of two true systems that count as the same, relative to the largest value of either function,
/// dimensionless.
const SAME_TRUTH: f64 = 2e-3;

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
    /// Errors of `nodal` against `truth`, on the same grid.
    pub fn of(nodal: &NodalCoefficients, truth: &NodalCoefficients) -> Self {
        let (found, real) = (Ratios::of(nodal), Ratios::of(truth));
        let k_over_m = largest_error(&found.k_over_m, &real.k_over_m);
        let c_over_m = largest_error(&found.c_over_m, &real.c_over_m);
        let mass = largest_error(&nodal.mass, &truth.mass);
        let stiffness_scale = largest(&real.k_over_m);
        let critical = 2.0 * stiffness_scale.sqrt();
        let relative_to_critical = largest(&real.c_over_m) < RECOVERY_TOLERANCE * critical;
        let damping_scale = match relative_to_critical {
            true => critical,
            false => largest(&real.c_over_m),
        };
        let relative = |error: f64, scale: f64| if error == 0.0 { 0.0 } else { error / scale };
        Self {
            mass,
            damping: largest_error(&nodal.coefficients[0], &truth.coefficients[0]),
            stiffness: largest_error(&nodal.coefficients[1], &truth.coefficients[1]),
            k_over_m,
            c_over_m,
            mass_relative: relative(mass, largest(&truth.mass)),
            k_over_m_relative: relative(k_over_m, stiffness_scale),
            c_over_m_relative: relative(c_over_m, damping_scale),
            relative_to_critical,
        }
    }

    /// Larger of the relative errors of `k/m` and `c/m`.
    pub fn largest_ratio_error(&self) -> f64 {
        self.k_over_m_relative.max(self.c_over_m_relative)
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

/// Roughness by finite differences of nodal values, independent of the basis: `integral (m'')^2 dt` over the interior nodes,
/// `integral (c')^2 dt` and `integral (k')^2 dt` over the steps. The mass uses the second derivative because the true mass of
/// the paper falls linearly, and thus has zero roughness, as the constant true damping and stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Roughness {
    /// Roughness of the mass, `integral (m'')^2 dt`, kg^2/s^3.
    pub mass: f64,
    /// Roughness of the damping, `integral (c')^2 dt`, N^2 s/m^2.
    pub damping: f64,
    /// Roughness of the stiffness, `integral (k')^2 dt`, N^2/(m^2 s).
    pub stiffness: f64,
}

impl Roughness {
    /// Roughness of nodal coefficients on a grid with this step, s.
    pub fn of(nodal: &NodalCoefficients, step: f64) -> Self {
        let slope = |f: &[f64]| -> f64 {
            let squares = f.windows(2).map(|w| ((w[1] - w[0]) / step).powi(2));
            squares.sum::<f64>() * step
        };
        let curvature = |f: &[f64]| -> f64 {
            let second = |w: &[f64]| ((w[0] - 2.0 * w[1] + w[2]) / step / step).powi(2);
            f.windows(3).map(second).sum::<f64>() * step
        };
        Self {
            mass: curvature(&nodal.mass),
            damping: slope(&nodal.coefficients[0]),
            stiffness: slope(&nodal.coefficients[1]),
        }
    }
}

/// Returns true if every function of the second system differs, at the nodes of its grid within the span of the first grid,
/// from the linearly interpolated first by at most [`SAME_TRUTH`] times the larger maximum; also true if no node lies there.
pub fn is_same_truth(
    (one, grid): (&NodalCoefficients, &Grid),
    (other, other_grid): (&NodalCoefficients, &Grid),
) -> bool {
    let times = other_grid.times();
    let close = |f: &[f64], g: &[f64]| {
        let size = f.iter().chain(g).map(|x| x.abs()).fold(0.0, f64::max);
        times.iter().zip(g).all(|(t, value)| {
            let index = (t - grid.start()) / grid.step();
            interpolate(f, index).is_none_or(|x| (x - value).abs() <= SAME_TRUTH * size)
        })
    };
    one.functions()
        .zip(other.functions())
        .all(|(f, g)| close(f, g))
}

/// Interpolates linearly at the fractional node index `index`; `None` before the first node and from the last node on.
fn interpolate(f: &[f64], index: f64) -> Option<f64> {
    let i = index.floor();
    if i < 0.0 || i + 1.0 >= f.len() as f64 {
        return None;
    }
    let (i, fraction) = (i as usize, index - i);
    Some(f[i] + fraction * (f[i + 1] - f[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodal(mass: &[f64], damping: f64, stiffness: f64) -> NodalCoefficients {
        let constant = |value| vec![value; mass.len()];
        NodalCoefficients {
            mass: mass.to_vec(),
            coefficients: vec![constant(damping), constant(stiffness)],
        }
    }

    /// For m = 1 + t^2 on [0, 1], (m'')^2 = 4 at the 999 interior nodes.
    #[test]
    fn roughness_of_a_parabola() {
        let step = 1e-3;
        let mass: Vec<f64> = (0..=1000)
            .map(|i| 1.0 + (i as f64 * step).powi(2))
            .collect();
        let found = Roughness::of(&nodal(&mass, 0.3, 1.0), step);
        assert!((found.mass - 4.0 * 0.999).abs() < 1e-4, "{found:?}");
        assert_eq!((found.damping, found.stiffness), (0.0, 0.0));
    }

    #[test]
    fn systems_with_a_common_factor_are_equal() {
        let truth = nodal(&[1.0, 0.5, 0.8], 0.1, 1.0);
        let doubled = nodal(&[2.0, 1.0, 1.6], 0.2, 2.0);
        let errors = TruthErrors::of(&doubled, &truth);
        assert!(errors.within(RECOVERY_TOLERANCE) && !errors.relative_to_critical);
        assert_eq!(errors.mass_relative, 1.0);
    }

    #[test]
    fn negligible_damping_is_compared_with_critical_damping() {
        let truth = nodal(&[1.0, 1.0], 0.0, 1.0);
        let errors = TruthErrors::of(&nodal(&[1.0, 1.0], 0.02, 1.0), &truth);
        assert!(errors.relative_to_critical);
        assert!((errors.c_over_m_relative - 0.01).abs() < 1e-15);
        assert!(!errors.within(RECOVERY_TOLERANCE));
    }

    #[test]
    fn a_system_without_mass_is_not_recovered() {
        let truth = nodal(&[1.0, 1.0], 0.0, 1.0);
        let errors = TruthErrors::of(&nodal(&[1.0, 0.0], 0.0, 1.0), &truth);
        assert!(!errors.within(RECOVERY_TOLERANCE));
    }
}
