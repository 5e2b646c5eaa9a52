//! Degrees of freedom of estimates whose noise is estimated too.
//!
//! The variance `C(z)` of an estimate depends on the coordinates `z` of the noise, which have the covariance `V`. By Satterthwaite's
//! approximation the standardised error has Student's t distribution with
//!
//! ```text
//! nu = 2 / (g^T V g),    g = d log C / dz
//! ```
//!
//! degrees of freedom: `n - p` for one sigma alone (Satterthwaite 1946; Kenward and Roger 1997).

use super::covariance::covariance;
use super::directions::Directions;
use super::sensitivity::Sensitivity;
use crate::noise::STEP;
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Weighting};
use nalgebra::DMatrix;
use std::cell::LazyCell;

/// Covariances of the parameters with the noise moved along its coordinates.
pub struct NoiseVariants {
    here: DMatrix<f64>,
    channels: Vec<ChannelVariants>,
}

struct ChannelVariants {
    /// Covariances with a coordinate moved up and down.
    sides: Vec<[DMatrix<f64>; 2]>,
    /// Covariance of the coordinates.
    covariance: DMatrix<f64>,
}

impl NoiseVariants {
    /// Variants at an evaluated point, with the `known` sensitivity of all parameters or a new one; `None` where no noise was estimated with a
    /// covariance, or the parameters have none.
    pub fn of(
        problem: &Problem,
        evaluation: &Evaluation,
        known: Option<&Sensitivity>,
    ) -> Option<Self> {
        let is_estimated = |c: &Channel| !c.noise().covariance.is_empty();
        let (n, samples) = (problem.parameters(), problem.sample_count());
        let is_few = (1..=FEW_PARAMETERS).contains(&n) && samples > n;
        if !is_few || !problem.channels().any(is_estimated) {
            return None;
        }
        let directions = Directions::new(problem, evaluation, n, n);
        let here = match known {
            Some(sensitivity) => covariance(problem, sensitivity)?,
            None => problem.covariance(evaluation)?,
        };
        let jacobian =
            LazyCell::new(|| directions.of_jacobian(problem.predictions_jacobian(evaluation)));
        let is_alone = problem.channels().count() == 1;
        let mut channels = Vec::new();
        for (e, experiment) in problem.experiments.iter().enumerate() {
            for (c, channel) in experiment.channels.iter().enumerate() {
                let side = |index: usize, step: f64| {
                    let mut moved = problem.clone();
                    let noise = channel.with_moved_noise(index, step);
                    moved.parts_mut().experiments[e].channels[c] = noise;
                    let (directions, jacobian) = (directions.clone(), (*jacobian).clone());
                    let sensitivity =
                        Sensitivity::weighted(&moved, evaluation, directions, jacobian);
                    covariance(&moved, &sensitivity)
                };
                let mut sides = Vec::new();
                for index in 0..channel.noise().covariance.nrows() {
                    sides.push(match (is_alone, channel.weighting(), index) {
                        // All samples have this sigma: its square is a factor of the covariance.
                        (true, Weighting::Estimated { .. }, 0) => {
                            [STEP, -STEP].map(|step| &here * (1.0 + 2.0 * step))
                        }
                        _ => [side(index, STEP)?, side(index, -STEP)?],
                    });
                }
                channels.push(ChannelVariants {
                    sides,
                    covariance: channel.noise().covariance.clone(),
                });
            }
        }
        Some(Self { here, channels })
    }

    /// Degrees of freedom of the linear combination of the parameters with these entries; infinite where its variance is zero
    /// or independent of the noise.
    pub fn degrees(&self, entries: &[(usize, f64)]) -> f64 {
        let variance = |covariance: &DMatrix<f64>| {
            let mut sum = 0.0;
            for (i, a) in entries {
                for (j, b) in entries {
                    sum += a * b * covariance[(*i, *j)];
                }
            }
            sum
        };
        let here = variance(&self.here);
        if here.is_nan() || here <= 0.0 {
            return f64::INFINITY;
        }
        let mut inverse = 0.0;
        for channel in &self.channels {
            let slopes: Vec<f64> = (channel.sides.iter())
                .map(|[up, down]| (variance(up) - variance(down)) / (2.0 * STEP * here))
                .collect();
            for (i, a) in slopes.iter().enumerate() {
                for (j, b) in slopes.iter().enumerate() {
                    inverse += 0.5 * a * b * channel.covariance[(i, j)];
                }
            }
        }
        1.0 / inverse.max(0.0)
    }
}

impl Problem {
    /// Degrees of freedom of the estimate of each parameter: Student's t distribution gives their intervals. Infinite, for the
    /// normal distribution, where the noise counts as known.
    pub fn degrees_of_freedom(&self, evaluation: &Evaluation) -> Vec<f64> {
        degrees_of_parameters(self, NoiseVariants::of(self, evaluation, None).as_ref())
    }
}

/// Degrees of freedom of the estimate of each parameter.
pub(super) fn degrees_of_parameters(problem: &Problem, noise: Option<&NoiseVariants>) -> Vec<f64> {
    let parameters = 0..problem.parameters();
    match noise {
        None => parameters.map(|_| f64::INFINITY).collect(),
        Some(noise) => parameters.map(|j| noise.degrees(&[(j, 1.0)])).collect(),
    }
}
