//! Robust losses of the residuals of the equation of motion.

use crate::record::{Experiment, Loss};
use crate::signal::median;

/// Ratio of the standard deviation of a normal distribution to the median of its absolute values.
pub(super) const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// Loss of residuals `e` of the equation of motion, in N^2: `s^2 rho(e/s)` with a robust scale `s` of the residuals, or `e^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ResidualLoss {
    loss: Loss,
    /// Scale `s`, N; zero stands for `e^2`.
    scale: f64,
}

impl ResidualLoss {
    /// Least squares until a scale is set: the loss of the channels, or that of the robust ones among them, as the residuals of the
    /// equation contain all of them.
    pub fn of(experiment: &Experiment) -> Self {
        let mut losses = experiment.channels.iter().map(|c| c.loss());
        let robust = losses.find(|loss| *loss != Loss::Squares);
        Self {
            loss: robust.unwrap_or_default(),
            scale: 0.0,
        }
    }

    /// Loss of the starting points of other methods.
    pub fn squares() -> Self {
        Self {
            loss: Loss::Squares,
            scale: 0.0,
        }
    }

    pub fn is_robust(self) -> bool {
        self.loss != Loss::Squares
    }

    /// The loss with the scale of these residuals: 1.4826 times the median of their absolute values, the standard deviation of a normal
    /// distribution.
    #[must_use]
    pub fn scaled_by(self, residuals: &[f64]) -> Self {
        let sizes: Vec<f64> = residuals.iter().map(|e| e.abs()).collect();
        let scale = match self.is_robust() && !sizes.is_empty() {
            true => MAD_TO_SIGMA * median(sizes),
            false => 0.0,
        };
        Self { scale, ..self }
    }

    /// Loss of the residual `e`, N^2.
    pub fn cost(self, e: f64) -> f64 {
        match self.scale > 0.0 {
            true => self.scale * self.scale * self.loss.cost(e / self.scale),
            false => e * e,
        }
    }

    /// Weight of the residual `e` in the least-squares problem with the same gradient.
    pub fn weight(self, e: f64) -> f64 {
        match self.scale > 0.0 {
            true => self.loss.weight(e / self.scale),
            false => 1.0,
        }
    }

    /// Ratio of the mean slope of the scores of these residuals to their mean weight, which the curvature of the cost has in place of that
    /// of the least-squares problem.
    pub fn curvature(self, residuals: &[f64]) -> f64 {
        if self.scale <= 0.0 {
            return 1.0;
        }
        let normalised: Vec<f64> = residuals.iter().map(|e| e / self.scale).collect();
        self.loss.information_ratio(&normalised, true).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::State;

    fn huber() -> ResidualLoss {
        ResidualLoss {
            loss: Loss::Huber { threshold: 1.345 },
            scale: 0.0,
        }
    }

    /// The scale is that of the bulk of the residuals; the loss is quadratic there and linear beyond.
    #[test]
    fn the_scale_is_that_of_the_bulk() {
        let mut residuals: Vec<f64> = (-50..=50).map(|i| 0.02 * f64::from(i)).collect();
        residuals.push(1e6);
        let loss = huber().scaled_by(&residuals);
        let expected = MAD_TO_SIGMA * 0.5;
        assert!((loss.scale / expected - 1.0).abs() < 0.05, "{loss:?}");
        assert_eq!(loss.cost(0.3), 0.3 * 0.3);
        assert!(loss.cost(1e6) < 1e7);
        let h = 1e-6;
        let slope = (loss.cost(3.0 + h) - loss.cost(3.0 - h)) / (2.0 * h);
        assert!((slope - 2.0 * 3.0 * loss.weight(3.0)).abs() < 1e-6);
    }

    /// Residuals that vanish have no scale, and are squared.
    #[test]
    fn residuals_without_a_scale_are_squared() {
        let loss = huber().scaled_by(&[0.0, 0.0, 2.0]);
        assert_eq!((loss.cost(2.0), loss.weight(2.0)), (4.0, 1.0));
        let rest = State::one(0.0, 0.0);
        let none = ResidualLoss::of(&Experiment::free("none", rest, 3));
        assert!(!none.is_robust());
        assert_eq!(none.scaled_by(&[1.0, 2.0]), ResidualLoss::squares());
    }
}
