//! Error of a gradient against finite differences.

use super::{Evaluation, GradientKind};
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// Error of a gradient at one step, a point of the paper's Fig. 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientError {
    /// Step `a` along the negative L2 gradient.
    pub step: f64,
    /// `|(J(p - a g) - J(p))/a + G^2| / G^2`.
    pub error: f64,
}

impl Problem {
    /// Errors of a gradient against one-sided differences along the negative L2 gradient, for each of `steps` (the paper's
    /// Fig. 2). The error of an exact gradient is proportional to the step until rounding errors dominate; that of an inexact
    /// one levels off.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation at `theta` fails; steps whose simulation fails are omitted.
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

    /// Difference `J(to) - J(from)`, computed from the residuals to avoid cancellation.
    pub fn cost_difference(&self, from: &Evaluation, to: &Evaluation) -> f64 {
        let channels = self.predicted(from).zip(to.predictions.iter().flatten());
        let misfit: f64 = channels
            .map(|((channel, from), to)| channel.cost_difference(from, to))
            .sum();
        misfit + (to.regularisation - from.regularisation)
    }
}
