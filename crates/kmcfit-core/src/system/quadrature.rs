//! Quadrature and finite differences on an equally spaced grid, in the paper's order of operations.

use crate::simd::{self, Elementwise};

/// Trapezoid rule for values at the nodes: `dt/2 (f_0 + f_last)`, then the inner nodes in order.
pub fn trapezoid(f: &[f64], dt: f64) -> f64 {
    let Some((&last, _)) = f.split_last() else {
        return 0.0;
    };
    let ends = dt * 0.5 * (f[0] + last);
    let inner = f.get(1..f.len() - 1).unwrap_or_default();
    inner.iter().fold(ends, |sum, f| sum + dt * 0.5 * (2.0 * f))
}

/// Weights of [`trapezoid`] for `nodes` nodes: `dt`, halved at both ends.
pub fn trapezoid_weights(nodes: usize, dt: f64) -> Vec<f64> {
    let mut weights = vec![dt; nodes];
    if let [first, .., last] = weights.as_mut_slice() {
        *first = 0.5 * dt;
        *last = 0.5 * dt;
    }
    weights
}

/// Trapezoid weights over increasing `times`.
pub fn trapezoid_weights_at(times: &[f64]) -> Vec<f64> {
    let mut weights = vec![0.0; times.len()];
    for (i, pair) in times.windows(2).enumerate() {
        let half = 0.5 * (pair[1] - pair[0]);
        weights[i] += half;
        weights[i + 1] += half;
    }
    weights
}

/// Central differences, one-sided at the ends.
///
/// # Panics
/// If there are fewer than two values.
pub fn slope(f: &[f64], dt: f64) -> Vec<f64> {
    let last = f.len() - 1;
    let mut d = vec![0.0; f.len()];
    simd::run(Elementwise(|| {
        for (d, w) in d[1..].iter_mut().zip(f.windows(3)) {
            *d = 0.5 * (-w[0] + w[2]) / dt;
        }
    }));
    d[0] = (-f[0] + f[1]) / dt;
    d[last] = (f[last] - f[last - 1]) / dt;
    d
}

/// Second differences; the ends use the stencil of their neighbours.
///
/// # Panics
/// If there are fewer than three values.
pub fn curvature(f: &[f64], dt: f64) -> Vec<f64> {
    let last = f.len() - 1;
    let mut d = vec![0.0; f.len()];
    simd::run(Elementwise(|| {
        for (d, w) in d[1..].iter_mut().zip(f.windows(3)) {
            *d = second(w[0], w[1], w[2], dt);
        }
    }));
    d[0] = second(f[0], f[1], f[2], dt);
    d[last] = second(f[last], f[last - 1], f[last - 2], dt);
    d
}

/// [`curvature`] at node `i`.
#[inline(always)]
pub fn curvature_at(f: &[f64], dt: f64, i: usize) -> f64 {
    let middle = i.clamp(1, f.len() - 2);
    match i.cmp(&middle) {
        std::cmp::Ordering::Greater => second(f[i], f[i - 1], f[i - 2], dt),
        _ => second(f[middle - 1], f[middle], f[middle + 1], dt),
    }
}

#[inline(always)]
fn second(a: f64, b: f64, c: f64, dt: f64) -> f64 {
    (a - 2.0 * b + c) / dt / dt
}

/// Mean of the nodes `i` and `i + 1`.
#[inline(always)]
pub fn midpoint(f: &[f64], i: usize) -> f64 {
    (f[i + 1] + f[i]) * 0.5
}
