//! Proofs that a gradient is one, as functions that anyone can call.

use super::{Evaluation, GradientKind};
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// One point of the paper's Fig. 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientError {
    /// Step `a` along the negative L2 gradient.
    pub step: f64,
    /// `|(J(p - a g) - J(p))/a + G^2| / G^2`.
    pub error: f64,
}

impl Problem {
    /// The paper's Fig. 2: the error of a gradient against one-sided differences along itself, for
    /// each of `steps`. An exact gradient's error falls in proportion to the step until rounding
    /// takes over; an inexact one's stays at its floor.
    ///
    /// # Errors
    /// A [`SimulationError`] at `theta` itself; steps that break down are left out.
    pub fn gradient_error(
        &self,
        theta: &[f64],
        kind: GradientKind,
        steps: &[f64],
    ) -> Result<Vec<GradientError>, SimulationError> {
        let here = self.evaluate(theta)?;
        let gradient = self.gradient(theta, &here, kind);
        let mut trial = self.workspace();
        let mut errors = Vec::with_capacity(steps.len());
        for &step in steps {
            let moved: Vec<f64> = theta
                .iter()
                .zip(&gradient.l2)
                .map(|(p, g)| p - step * g)
                .collect();
            if self.evaluate_into(&moved, &mut trial).is_ok() {
                let slope = self.cost_difference(&here, &trial) / step;
                let error = (slope + gradient.norm_squared).abs() / gradient.norm_squared;
                errors.push(GradientError { step, error });
            }
        }
        Ok(errors)
    }

    /// `J(to) - J(from)` without the cancellation of two rounded costs.
    pub fn cost_difference(&self, from: &Evaluation, to: &Evaluation) -> f64 {
        let channels = self.predicted(from).zip(to.predictions.iter().flatten());
        let misfit: f64 = channels
            .map(|((channel, from), to)| channel.cost_difference(from, to))
            .sum();
        misfit + (to.regularisation - from.regularisation)
    }

    /// Taylor remainders `|J(theta + a d) - J(theta) - a <dJ, d>|` along `direction` for each of
    /// `steps`: they fall with the square of the step if the gradient is exact.
    ///
    /// # Errors
    /// A [`SimulationError`] at `theta` or at one of the trial points.
    pub fn taylor_remainders(
        &self,
        theta: &[f64],
        direction: &[f64],
        kind: GradientKind,
        steps: &[f64],
    ) -> Result<Vec<f64>, SimulationError> {
        let here = self.evaluate(theta)?;
        let gradient = self.gradient(theta, &here, kind).euclidean;
        let slope: f64 = gradient.iter().zip(direction).map(|(g, d)| g * d).sum();
        let mut trial = self.workspace();
        let mut remainder = |step: f64| {
            let moved: Vec<f64> = theta
                .iter()
                .zip(direction)
                .map(|(p, d)| p + step * d)
                .collect();
            self.evaluate_into(&moved, &mut trial)?;
            Ok((self.cost_difference(&here, &trial) - step * slope).abs())
        };
        steps.iter().map(|&step| remainder(step)).collect()
    }
}
