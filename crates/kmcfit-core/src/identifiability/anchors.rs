//! Instants at which a response determines `k/m` or `c/m` alone.
//!
//! The equation of motion is `y'' + (c/m) y' + (k/m) y = f/m`. At a turning point, `y' = 0`, it gives
//! `k/m = (f/m - y'')/y`; at a zero crossing, `y = 0`, it gives `c/m = (f/m - y'')/y'`.

use crate::simulate::Trajectory;
use crate::system::Grid;

/// Turning points and zero crossings of a response, s, increasing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Anchors {
    /// Turning points, `y' = 0`, which determine `k/m`.
    pub turning_points: Vec<f64>,
    /// Zero crossings, `y = 0`, which determine `c/m`.
    pub zero_crossings: Vec<f64>,
}

/// Turning points and zero crossings by cubic Hermite interpolation of displacement and velocity; fourth-order accurate in
/// the step for zero crossings, third-order for turning points. Empty for a system at rest.
pub fn anchors(grid: &Grid, response: &Trajectory) -> Anchors {
    let (y, v, h) = (&response.displacement, &response.velocity, grid.step());
    let mut anchors = Anchors::default();
    for i in 0..response.nodes().saturating_sub(1) {
        let ends = [y[i], h * v[i], y[i + 1], h * v[i + 1]];
        let time = |x: f64| grid.time(i) + x * h;
        let last = i + 2 == response.nodes();
        if let Some(x) = root(last, |x| value(ends, x)) {
            anchors.zero_crossings.push(time(x));
        }
        if let Some(x) = root(last, |x| slope(ends, x)) {
            anchors.turning_points.push(time(x));
        }
    }
    anchors
}

/// Bisections of a step, enough for machine precision.
const HALVINGS: usize = 50;

/// Zero of `f` on `[0, 1)`, or `[0, 1]` if `closed`, where its sign changes.
fn root(closed: bool, f: impl Fn(f64) -> f64) -> Option<f64> {
    let (left, right) = (f(0.0), f(1.0));
    if left == 0.0 && right == 0.0 {
        return None;
    }
    if left == 0.0 {
        return Some(0.0);
    }
    if right == 0.0 {
        return closed.then_some(1.0);
    }
    if left.signum() == right.signum() || !(left - right).is_finite() {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == left.signum() {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// The cubic through displacements and (step times) velocities `[y0, h v0, y1, h v1]`.
fn value([y0, v0, y1, v1]: [f64; 4], x: f64) -> f64 {
    let (x2, x3) = (x * x, x * x * x);
    y0 * (1.0 - 3.0 * x2 + 2.0 * x3)
        + v0 * (x - 2.0 * x2 + x3)
        + y1 * (3.0 * x2 - 2.0 * x3)
        + v1 * (x3 - x2)
}

/// Derivative of the cubic in `x`.
fn slope([y0, v0, y1, v1]: [f64; 4], x: f64) -> f64 {
    let bend = 6.0 * (x - x * x);
    bend * (y1 - y0) + v0 * (1.0 - 4.0 * x + 3.0 * x * x) + v1 * (3.0 * x * x - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_points_and_crossings_of_a_cosine_are_exact_to_interpolation_error() {
        let grid = Grid::new(0.0, 10.0, 401).unwrap();
        let response = Trajectory {
            displacement: grid.times().iter().map(|t| t.cos()).collect(),
            velocity: grid.times().iter().map(|t| -t.sin()).collect(),
        };
        let found = anchors(&grid, &response);
        let pi = std::f64::consts::PI;
        let turning = [0.0, pi, 2.0 * pi, 3.0 * pi];
        let crossing = [0.5 * pi, 1.5 * pi, 2.5 * pi];
        let off = |a: &[f64], b: &[f64]| {
            assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
            a.iter()
                .zip(b)
                .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
        };
        // Hermite: h^4/384 and h^3/72 sqrt(3) of derivatives of size 1, with h = 0.025.
        let h: f64 = 0.025;
        assert!(off(&found.zero_crossings, &crossing) < h.powi(4) / 384.0);
        assert!(off(&found.turning_points, &turning) < h.powi(3) / 100.0);
    }

    #[test]
    fn a_system_at_rest_has_no_fixed_instants() {
        let grid = Grid::new(0.0, 1.0, 11).unwrap();
        assert_eq!(anchors(&grid, &Trajectory::zeros(11)), Anchors::default());
    }
}
