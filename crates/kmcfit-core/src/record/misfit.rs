//! Residuals and misfit of a channel.

use super::{Channel, LONG_RECORD_STEPS, Loss, Weighting};
use crate::simd::sum::squared_distance;
use crate::system::quadrature::trapezoid_weights_at;
use std::ops::Range;

impl Channel {
    /// Residuals `r = model - sample`, one per sample.
    pub fn residuals<'a>(&'a self, predicted: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        predicted.iter().zip(self.observed()).map(|(y, o)| y - o)
    }

    /// The residuals of some samples.
    pub(crate) fn residuals_of<'a>(
        &'a self,
        predicted: &'a [f64],
        samples: Range<usize>,
    ) -> impl Iterator<Item = f64> + 'a {
        let pairs = predicted[samples.clone()].iter();
        pairs.zip(&self.observed()[samples]).map(|(y, o)| y - o)
    }

    /// Misfit of the predictions: `integral r^2 dt`, in the square of the kind's unit times s, or `sum rho(r / sigma)`; for
    /// correlated noise the sum over the innovations ([`Channel::innovations`]).
    ///
    /// The integral over equally spaced samples is summed in the paper's order, both ends first, because the paper's run depends on
    /// every bit. Long sums use SIMD.
    pub fn cost(&self, predicted: &[f64]) -> f64 {
        if self.correlation().is_some() {
            return self.correlated_cost(predicted);
        }
        if let Weighting::Integral { spacing } = self.weighting() {
            let square = |i: usize| {
                let r = predicted[i] - self.observed()[i];
                r * r
            };
            let last = self.len() - 1;
            let ends = spacing * 0.5 * (square(0) + square(last));
            return (1..last).fold(ends, |sum, i| sum + spacing * 0.5 * (2.0 * square(i)));
        }
        if let Weighting::Sigma(sigma) | Weighting::Estimated { sigma } = self.weighting()
            && self.loss() == Loss::Squares
            && self.len() >= LONG_RECORD_STEPS
        {
            return squared_distance(predicted, self.observed(), 1.0 / sigma);
        }
        let terms = self.residuals(predicted).enumerate();
        terms
            .map(|(i, r)| match self.weighting().sigma(i) {
                Some(sigma) => self.loss().cost(r / sigma),
                None => self.weighting().weight(i, self.len()) * r * r,
            })
            .sum()
    }

    /// Difference `cost(to) - cost(from)`, as `sum w (y' - y) (y' + y - 2 y_obs)`, which avoids the cancellation of two rounded costs.
    pub fn cost_difference(&self, from: &[f64], to: &[f64]) -> f64 {
        if self.correlation().is_some() {
            return self.correlated_difference(from, to);
        }
        let pairs = from.iter().zip(to).zip(self.observed()).enumerate();
        let difference = |(i, ((y, moved), observed)): (usize, ((&f64, &f64), &f64))| match (
            self.loss(),
            self.weighting().sigma(i),
        ) {
            (Loss::Squares, _) | (_, None) => {
                let weight = self.weighting().weight(i, self.len());
                weight * (moved - y) * ((moved - observed) + (y - observed))
            }
            (loss, Some(sigma)) => {
                loss.cost((moved - observed) / sigma) - loss.cost((y - observed) / sigma)
            }
        };
        pairs.map(difference).sum()
    }

    /// Weights of the inner samples and of both ends, for a sum of squares with equal inner weights.
    pub fn uniform_weights(&self) -> Option<[f64; 2]> {
        if self.correlation().is_some() {
            return None;
        }
        match (self.weighting(), self.loss()) {
            (Weighting::Integral { spacing }, _) => Some([*spacing, 0.5 * spacing]),
            (Weighting::Sigma(sigma) | Weighting::Estimated { sigma }, Loss::Squares) => {
                Some([1.0 / (sigma * sigma); 2])
            }
            _ => None,
        }
    }

    /// Weight of the residual `r` of sample `i` in the least-squares problem `sum w r^2` with the gradient of the cost, for
    /// uncorrelated noise.
    pub fn weight(&self, i: usize, r: f64) -> f64 {
        let weight = self.weighting().weight(i, self.len());
        match (self.loss(), self.weighting().sigma(i)) {
            (Loss::Squares, _) | (_, None) => weight,
            (loss, Some(sigma)) => weight * loss.weight(r / sigma),
        }
    }

    /// Derivatives `dJ/d model = 2 w r` of all samples.
    pub fn slopes(&self, predicted: &[f64]) -> Vec<f64> {
        if let Some(correlation) = self.correlation() {
            return self.correlated_slopes(correlation, predicted);
        }
        if let Some([inner, ends]) = self.uniform_weights() {
            let residuals = self.residuals(predicted);
            let mut slopes: Vec<f64> = residuals.map(|r| 2.0 * inner * r).collect();
            let last = self.len() - 1;
            for i in [0, last] {
                slopes[i] = 2.0 * ends * (predicted[i] - self.observed()[i]);
            }
            return slopes;
        }
        let residuals = self.residuals(predicted).enumerate();
        residuals
            .map(|(i, r)| 2.0 * self.weight(i, r) * r)
            .collect()
    }
}

/// Trapezoid weights over unequally spaced times: the paper's cost for irregular samples.
pub fn integral_over(times: &[f64]) -> Weighting {
    Weighting::Trapezoid(trapezoid_weights_at(times))
}
