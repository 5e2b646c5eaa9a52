//! Distances of a run from the truth.

use super::RECOVERED;
use kmcfit_core::internals::functions::Ratios;
use kmcfit_core::internals::system::NodalCoefficients;
use serde::Serialize;

/// Largest distances from the truth over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Of the mass, kg.
    pub mass: f64,
    /// Of the damping, N s/m.
    pub damping: f64,
    /// Of the stiffness, N/m.
    pub stiffness: f64,
    /// Of `k/m`, 1/s^2.
    pub k_over_m: f64,
    /// Of `c/m`, 1/s.
    pub c_over_m: f64,
    /// Of the mass, relative to the largest true mass.
    pub mass_relative: f64,
    /// Of `k/m`, relative to the largest true `|k/m|`.
    pub k_over_m_relative: f64,
    /// Of `c/m`, relative to the largest true `|c/m|`; where that is below
    /// [`RECOVERED`] of critical damping `2 sqrt(k/m)`, relative to the latter.
    pub c_over_m_relative: f64,
    /// Whether `c_over_m_relative` is relative to critical damping.
    pub undamped: bool,
}

impl Errors {
    /// The distances of `device` from `truth`, on the same grid.
    pub fn of(device: &NodalCoefficients, truth: &NodalCoefficients) -> Self {
        let (found, real) = (Ratios::of(device), Ratios::of(truth));
        let k_over_m = largest_error(&found.k_over_m, &real.k_over_m);
        let c_over_m = largest_error(&found.c_over_m, &real.c_over_m);
        let mass = largest_error(&device.mass, &truth.mass);
        let stiffness_scale = largest(&real.k_over_m);
        let critical = 2.0 * stiffness_scale.sqrt();
        let undamped = largest(&real.c_over_m) < RECOVERED * critical;
        let damping_scale = match undamped {
            true => critical,
            false => largest(&real.c_over_m),
        };
        let relative = |error: f64, scale: f64| if error == 0.0 { 0.0 } else { error / scale };
        Self {
            mass,
            damping: largest_error(&device.coefficients[0], &truth.coefficients[0]),
            stiffness: largest_error(&device.coefficients[1], &truth.coefficients[1]),
            k_over_m,
            c_over_m,
            mass_relative: relative(mass, largest(&truth.mass)),
            k_over_m_relative: relative(k_over_m, stiffness_scale),
            c_over_m_relative: relative(c_over_m, damping_scale),
            undamped,
        }
    }

    /// Whether `k/m` and `c/m` are the true ones to [`RECOVERED`].
    pub fn within_truth(&self) -> bool {
        self.within(RECOVERED)
    }

    /// Whether `k/m` and `c/m` are the true ones to a relative tolerance.
    pub fn within(&self, tolerance: f64) -> bool {
        self.k_over_m_relative < tolerance && self.c_over_m_relative < tolerance
    }
}

fn largest(f: &[f64]) -> f64 {
    f.iter().map(|x| x.abs()).fold(0.0, f64::max)
}

/// Largest distance; infinite where a ratio is not finite, because the mass is zero there.
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
