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
