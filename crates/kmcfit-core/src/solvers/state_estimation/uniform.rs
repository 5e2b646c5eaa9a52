//! State estimation from displacements at equally spaced nodes: smoothing, then fourth-order differences.

use super::{Kinematics, noise_level};
use crate::qp::Subproblem;
use crate::record::{Channel, Weighting};
use crate::simd::sum::rms;
use crate::system::State;

/// Rounds of the bisection for the exponent of the smoothing weight.
const ROUNDS: u32 = 14;
/// Decimal exponents of the smoothing weight between no smoothing and a parabola.
const EXPONENTS: [f64; 2] = [-12.0, 16.0];
/// Noise level, relative to the size of the samples, below which they are not smoothed.
const NOISELESS: f64 = 1e-6;

/// States at all samples but two at each end.
pub fn kinematics(channel: &Channel, stride: usize, step: f64) -> Option<Kinematics> {
    let y = smoothed(channel)?;
    let h = step * stride as f64;
    let each = |f: &dyn Fn(&[f64]) -> f64| y.windows(5).map(f).collect::<Vec<f64>>();
    let first = [-25.0, 48.0, -36.0, 16.0, -3.0];
    let slope = first.iter().zip(&y).map(|(w, y)| w * y).sum::<f64>() / (12.0 * h);
    Some(Kinematics {
        nodes: (2..y.len() - 2).map(|i| i * stride).collect(),
        v: each(&|w| (w[0] - 8.0 * w[1] + 8.0 * w[3] - w[4]) / (12.0 * h)),
        a: each(&|w| (-w[0] + 16.0 * w[1] - 30.0 * w[2] + 16.0 * w[3] - w[4]) / (12.0 * h * h)),
        y: each(&|w| w[2]),
        initial: Some(State {
            displacement: y[0],
            velocity: slope,
        }),
        size: y.iter().fold(0.0f64, |m, y| m.max(y.abs())),
        weight: channel.weighting().weight(1, channel.len()),
    })
}

/// Smoothest curve (in third differences) whose distance from the samples equals their noise.
fn smoothed(channel: &Channel) -> Option<Vec<f64>> {
    let observed = channel.observed();
    if observed.len() < 8 {
        return None;
    }
    let noise = match channel.weighting() {
        Weighting::Sigma(sigma) => *sigma,
        Weighting::Sigmas(sigmas) => rms(sigmas),
        Weighting::Integral { .. } | Weighting::Trapezoid(_) | Weighting::Estimated { .. } => {
            noise_level(observed)
        }
    };
    if noise <= NOISELESS * rms(observed) {
        return Some(observed.to_vec());
    }
    let [mut low, mut high] = EXPONENTS;
    let mut best = observed.to_vec();
    for _ in 0..ROUNDS {
        let middle = 0.5 * (low + high);
        let candidate = smooth(observed, 10f64.powf(middle))?;
        let pairs = candidate.iter().zip(observed);
        let mean_square =
            pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / observed.len() as f64;
        if mean_square.sqrt() <= noise {
            (low, best) = (middle, candidate);
        } else {
            high = middle;
        }
    }
    Some(best)
}

/// Minimises `|y - observed|^2 + weight |third differences of y|^2`.
fn smooth(observed: &[f64], weight: f64) -> Option<Vec<f64>> {
    let mut sub = Subproblem::new(observed.len());
    sub.elimination_order = (0..observed.len() as u32).collect();
    for (i, y) in observed.iter().enumerate() {
        sub.residuals.push([(i, 1.0)], *y);
    }
    let root = weight.sqrt();
    for i in 0..observed.len() - 3 {
        let row = [
            (i, -root),
            (i + 1, 3.0 * root),
            (i + 2, -3.0 * root),
            (i + 3, root),
        ];
        sub.residuals.push(row, 0.0);
    }
    sub.solve_equality_constrained()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::Grid;

    /// Differences of five samples are exact for polynomials of degree 4, for any step and number of steps between samples.
    #[test]
    fn states_of_a_quartic_are_exact() {
        let quartic = |t: f64| {
            [
                0.5 - t + 0.3 * t.powi(2) + 0.2 * t.powi(3) - 0.1 * t.powi(4),
                -1.0 + 0.6 * t + 0.6 * t.powi(2) - 0.4 * t.powi(3),
                0.6 + 1.2 * t - 1.2 * t.powi(2),
            ]
        };
        for (step, stride) in [(0.1, 1), (0.05, 3), (0.02, 8)] {
            let nodes = 10 * stride + 1;
            let grid = Grid::new(0.0, step * (nodes - 1) as f64, nodes).expect("a grid");
            let times: Vec<f64> = (0..=10).map(|i| grid.time(i * stride)).collect();
            let samples: Vec<f64> = times.iter().map(|t| quartic(*t)[0]).collect();
            // Samples without noise are not smoothed.
            let weighting = Weighting::Sigma(1e-9);
            let channel = Channel::displacement_at_nodes(samples, stride, weighting, &grid);
            let found = kinematics(&channel, stride, grid.step()).expect("enough samples");
            let inner: Vec<usize> = (2..9).map(|i| i * stride).collect();
            assert_eq!(found.nodes, inner);
            // A rounding error of a sample of size 1, divided by the square of the spacing of at least 0.1.
            let is_close = |found: f64, exact: f64| (found - exact).abs() < 1e-12;
            let states = found.y.iter().zip(&found.v).zip(&found.a);
            for (((y, v), a), node) in states.zip(inner) {
                let [exact_y, exact_v, exact_a] = quartic(grid.time(node));
                assert!(is_close(*y, exact_y), "y {y} {exact_y}");
                assert!(is_close(*v, exact_v), "v {v} {exact_v}");
                assert!(is_close(*a, exact_a), "a {a} {exact_a}");
            }
            let initial = found.initial.expect("a sample at the first node");
            let [y, v, _] = quartic(0.0);
            assert!(is_close(initial.displacement, y) && is_close(initial.velocity, v));
        }
    }
}
