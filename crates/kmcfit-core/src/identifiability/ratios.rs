//! Ratios of coefficients at one time, with their derivatives for the delta method.

use std::f64::consts::TAU;

/// A ratio at a node: its value and its derivatives with respect to the coefficients.
pub type Ratio = fn(&[f64]) -> (f64, Vec<f64>);

/// `p/m`.
pub fn over_mass(at: &[f64]) -> (f64, Vec<f64>) {
    let ratio = at[0] / at[1];
    (ratio, vec![1.0 / at[1], -ratio / at[1]])
}

/// `f = sqrt(k/m)/(2 pi)`: `df = f/2 (dk/k - dm/m)`.
pub fn frequency(at: &[f64]) -> (f64, Vec<f64>) {
    let frequency = (at[0] / at[1]).sqrt() / TAU;
    let half = |p: f64| 0.5 * frequency / p;
    (frequency, vec![half(at[0]), -half(at[1])])
}

/// `zeta = c/(2 sqrt(k m))`: `d zeta = dc/(2 sqrt(k m)) - zeta/2 (dk/k + dm/m)`.
pub fn damping_ratio(at: &[f64]) -> (f64, Vec<f64>) {
    let [c, k, m] = [at[0], at[1], at[2]];
    let root = if k > 0.0 {
        2.0 * (k * m).sqrt()
    } else {
        f64::NAN
    };
    let zeta = c / root;
    (zeta, vec![1.0 / root, -0.5 * zeta / k, -0.5 * zeta / m])
}
