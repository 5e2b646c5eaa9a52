//! A system beside the true one, and the roughness of its functions.

use crate::functions::Ratios;
use crate::system::{Grid, NodalCoefficients};
use serde::Serialize;

/// Largest relative error of `k/m` and `c/m` below which a system counts as the true one: well above
/// what steppers and stopping tests leave, well below what is visible in a figure.
pub const RECOVERED: f64 = 1e-3;
/// Truths that differ by less than this share of their size are the same on two grids.
const SAME_TRUTH: f64 = 2e-3;

/// Largest distances from the truth over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TruthErrors {
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

impl TruthErrors {
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

    /// The larger of the relative errors of `k/m` and `c/m`.
    pub fn worst_ratio(&self) -> f64 {
        self.k_over_m_relative.max(self.c_over_m_relative)
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

/// `integral (m'')^2 dt`, `integral (c')^2 dt`, `integral (k')^2 dt` by differences of the values at
/// the nodes, whatever the basis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Roughness {
    /// `integral (m'')^2 dt`, kg^2/s^3.
    pub mass: f64,
    /// `integral (c')^2 dt`, N^2 s/m^2.
    pub damping: f64,
    /// `integral (k')^2 dt`, N^2/(m^2 s).
    pub stiffness: f64,
}

impl Roughness {
    /// The roughness of a system on a grid with this step, s.
    pub fn of(device: &NodalCoefficients, step: f64) -> Self {
        let slope = |f: &[f64]| -> f64 {
            let squares = f.windows(2).map(|w| ((w[1] - w[0]) / step).powi(2));
            squares.sum::<f64>() * step
        };
        let curvature = |f: &[f64]| -> f64 {
            let second = |w: &[f64]| ((w[0] - 2.0 * w[1] + w[2]) / step / step).powi(2);
            f.windows(3).map(second).sum::<f64>() * step
        };
        Self {
            mass: curvature(&device.mass),
            damping: slope(&device.coefficients[0]),
            stiffness: slope(&device.coefficients[1]),
        }
    }
}

/// Whether two true systems agree at the nodes of the second grid that the first covers.
pub fn is_same_truth(
    (one, grid): (&NodalCoefficients, &Grid),
    (other, other_grid): (&NodalCoefficients, &Grid),
) -> bool {
    let times = other_grid.times();
    let close = |f: &[f64], g: &[f64]| {
        let size = f.iter().chain(g).map(|x| x.abs()).fold(0.0, f64::max);
        times.iter().zip(g).all(|(t, value)| {
            let place = (t - grid.start()) / grid.step();
            interpolate(f, place).is_none_or(|x| (x - value).abs() <= SAME_TRUTH * size)
        })
    };
    one.functions()
        .zip(other.functions())
        .all(|(f, g)| close(f, g))
}

/// The value between two nodes; `None` outside.
fn interpolate(f: &[f64], place: f64) -> Option<f64> {
    let i = place.floor();
    if i < 0.0 || i + 1.0 >= f.len() as f64 {
        return None;
    }
    let (i, share) = (i as usize, place - i);
    Some(f[i] + share * (f[i + 1] - f[i]))
}
