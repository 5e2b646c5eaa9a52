//! Legendre polynomials and Gauss–Legendre quadrature.

/// Newton steps per root: convergence is quadratic from a start accurate to a few per cent.
const NEWTON_STEPS: usize = 8;

/// Points and weights of Gauss-Legendre quadrature on `[-1, 1]`, exact for polynomials of degree `2 points - 1`.
pub(super) fn gauss_rule(points: usize) -> Vec<(f64, f64)> {
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

/// Derivatives `d^derivative P_n / dx^derivative` at `x` for `n = 0..=degree`.
///
/// Values by `(n+1) P_{n+1} = (2n+1) x P_n - n P_{n-1}`, derivatives by
/// `P'_{n+1} = P'_{n-1} + (2n+1) P_n`.
pub(super) fn legendre(x: f64, degree: usize, derivative: usize) -> Vec<f64> {
    let mut values = vec![1.0; degree + 1];
    for n in 0..degree {
        let before = if n == 0 { 0.0 } else { values[n - 1] };
        let k = n as f64;
        values[n + 1] = ((2.0 * k + 1.0) * x * values[n] - k * before) / (k + 1.0);
    }
    for _ in 0..derivative {
        let mut slopes = vec![0.0; degree + 1];
        for n in 0..degree {
            let before = if n == 0 { 0.0 } else { slopes[n - 1] };
            slopes[n + 1] = before + (2.0 * n as f64 + 1.0) * values[n];
        }
        values = slopes;
    }
    values
}
