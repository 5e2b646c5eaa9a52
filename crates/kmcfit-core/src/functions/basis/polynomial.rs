//! Polynomials over the whole record, as sums of Legendre polynomials.
//!
//! Powers of `t` are nearly dependent from about degree 8; Legendre polynomials are orthogonal, and their Gram matrix has the
//! condition number `2 degree + 1`.

use super::knots::uniform_knots;
use super::legendre::legendre;
use super::space::BasisFunctions;
use crate::system::Grid;

/// `P_n(x)`, `n = 0..=degree`, with `x = 2 (t - start) / duration - 1`.
pub(super) struct Legendre {
    ends: Vec<f64>,
    degree: usize,
}

impl Legendre {
    /// The basis on the record.
    pub fn on(grid: &Grid, degree: usize) -> Self {
        Self {
            ends: uniform_knots(grid, 2),
            degree,
        }
    }
}

impl BasisFunctions for Legendre {
    fn parameters(&self) -> usize {
        self.degree + 1
    }

    fn degree(&self) -> usize {
        self.degree
    }

    fn breaks(&self) -> Vec<f64> {
        self.ends.clone()
    }

    fn row(&self, t: f64, derivative: usize, entries: &mut Vec<(usize, f64)>) {
        let (start, end) = (self.ends[0], self.ends[1]);
        let x = ((t - start) - (end - t)) / (end - start);
        let chain = (2.0 / (end - start)).powi(derivative as i32);
        let values = legendre(x.clamp(-1.0, 1.0), self.degree, derivative);
        entries.extend(values.into_iter().map(|p| chain * p).enumerate());
    }
}

/// Coefficients `a_0..=a_d` of `p(t) = sum_i a_i t^i` for the Legendre parameters `theta`; `t` in s as in the file, `a_i` in
/// (unit of p)/s^i.
///
/// High powers cancel: the coefficients are for reports, not for computation.
pub fn physical_powers(grid: &Grid, theta: &[f64]) -> Vec<f64> {
    // x = scale t + shift
    let scale = 2.0 / grid.duration();
    let shift = -1.0 - scale * grid.start();
    let mut sum = vec![0.0; theta.len()];
    let mut before = vec![0.0; theta.len()];
    let mut current = vec![0.0; theta.len()];
    if let Some(first) = current.first_mut() {
        *first = 1.0;
    }
    for (n, parameter) in theta.iter().enumerate() {
        for (s, c) in sum.iter_mut().zip(&current) {
            *s += parameter * c;
        }
        let k = n as f64;
        let next = |i: usize| {
            let raised = if i == 0 { 0.0 } else { scale * current[i - 1] };
            let times_x = raised + shift * current[i];
            ((2.0 * k + 1.0) * times_x - k * before[i]) / (k + 1.0)
        };
        let next = (0..theta.len()).map(next).collect();
        before = std::mem::replace(&mut current, next);
    }
    sum
}

/// Legendre parameters of `p(t) = sum_i powers_i t^i`, `t` in s as in the file: the inverse of [`physical_powers`].
pub fn from_physical_powers(grid: &Grid, powers: &[f64]) -> Vec<f64> {
    // Horner's scheme; t = middle + half x, and x P_n = ((n+1) P_{n+1} + n P_{n-1}) / (2n+1).
    let half = 0.5 * grid.duration();
    let middle = grid.start() + half;
    let mut theta = vec![0.0; powers.len()];
    for power in powers.iter().rev() {
        let mut next: Vec<f64> = theta.iter().map(|p| middle * p).collect();
        for (n, p) in theta.iter().enumerate() {
            let k = n as f64;
            let part = half * p / (2.0 * k + 1.0);
            if let Some(up) = next.get_mut(n + 1) {
                *up += (k + 1.0) * part;
            }
            if n > 0 {
                next[n - 1] += k * part;
            }
        }
        next[0] += power;
        theta = next;
    }
    theta
}
