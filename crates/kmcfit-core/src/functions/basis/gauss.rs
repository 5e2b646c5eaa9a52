//! Gauss-Legendre quadrature.

use super::polynomial::legendre;

/// Newton steps for one point: convergence is quadratic from a start good to a few per cent.
const NEWTON_STEPS: usize = 8;

/// Points and weights on `[-1, 1]`, exact for polynomials of degree `2 points - 1`.
pub(super) fn rule(points: usize) -> Vec<(f64, f64)> {
    let n = points as f64;
    let point = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let slope = |x: f64| legendre(x, points, 1)[points];
        for _ in 0..NEWTON_STEPS {
            x -= legendre(x, points, 0)[points] / slope(x);
        }
        (x, 2.0 / ((1.0 - x * x) * slope(x).powi(2)))
    };
    (0..points).rev().map(point).collect()
}
