//! The cost of a parameter vector and its derivatives, from one trajectory per point.

mod gradient;
mod readings;
mod sizes;
mod verify;

pub use gradient::{Gradient, GradientKind};
pub use readings::{Readings, Weighting};
pub use verify::GradientError;

use crate::dynamics::{Breakdown, Cause, Device, Trajectory};
use crate::problem::Problem;

/// The cost at one point and everything that it was computed from.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Cost `J`, the sum of the next two.
    pub cost: f64,
    /// Part of the readings.
    pub misfit: f64,
    /// Part of the penalties.
    pub regularisation: f64,
    /// The device at this point.
    pub device: Device,
    /// The motion in each experiment.
    pub trajectories: Vec<Trajectory>,
}

impl Problem {
    /// Storage for evaluations, used again and again by [`Problem::evaluate_into`].
    pub fn workspace(&self) -> Evaluation {
        Evaluation {
            cost: f64::NAN,
            misfit: f64::NAN,
            regularisation: f64::NAN,
            device: self.functions.empty_device(),
            trajectories: vec![Trajectory::default(); self.experiments.len()],
        }
    }

    /// Cost, device and motions for the parameters `theta`.
    ///
    /// The cost is the sum over the experiments of [`Readings::cost`] plus the sum over the penalties
    /// of `weight |L theta - target|^2` ([`crate::functions::Penalty`]) plus the sum over the variations
    /// of `weight sum |D theta|` ([`crate::functions::Variation`]) plus the price of the soft
    /// constraints ([`crate::constraints::RowGroup::price`]).
    ///
    /// # Errors
    /// A [`Breakdown`] if a motion does not exist (the mass is not positive, or it overflows), or the
    /// cost overflows.
    pub fn evaluate(&self, theta: &[f64]) -> Result<Evaluation, Breakdown> {
        let mut evaluation = self.workspace();
        self.evaluate_into(theta, &mut evaluation)?;
        Ok(evaluation)
    }

    /// [`Problem::evaluate`] into storage that is used again; its contents are meaningless after an
    /// error.
    ///
    /// # Errors
    /// As [`Problem::evaluate`].
    pub fn evaluate_into(
        &self,
        theta: &[f64],
        evaluation: &mut Evaluation,
    ) -> Result<(), Breakdown> {
        self.functions.device_into(theta, &mut evaluation.device);
        evaluation.misfit = 0.0;
        for (experiment, trajectory) in self.experiments.iter().zip(&mut evaluation.trajectories) {
            self.oscillator.forward_into(
                &evaluation.device,
                experiment.initial,
                experiment.force.as_deref(),
                trajectory,
            )?;
            if let Some(readings) = &experiment.readings {
                evaluation.misfit += readings.cost(&trajectory.displacement);
            }
        }
        evaluation.regularisation = self.regularisation(theta);
        evaluation.cost = evaluation.misfit + evaluation.regularisation;
        if !evaluation.cost.is_finite() {
            return Err(self.cost_overflow(evaluation));
        }
        Ok(())
    }

    /// Where the largest residual stands, for a cost that has left the finite numbers.
    fn cost_overflow(&self, evaluation: &Evaluation) -> Breakdown {
        let mut worst = (0, 0.0f64);
        for (experiment, motion) in self.experiments.iter().zip(&evaluation.trajectories) {
            let Some(readings) = &experiment.readings else {
                continue;
            };
            for (i, r) in readings.residuals(&motion.displacement).enumerate() {
                if r.abs() > worst.1.abs() {
                    worst = (i * readings.stride(), r);
                }
            }
        }
        Breakdown {
            cause: Cause::CostOverflow,
            node: worst.0,
            time: self.oscillator.grid.time(worst.0),
            value: worst.1,
        }
    }

    /// What the functions pay: smoothness `weight |L theta - target|^2` plus total variation
    /// `weight sum |D theta|` plus soft constraints `weight mean excess^2`.
    pub fn regularisation(&self, theta: &[f64]) -> f64 {
        let ranges = self.functions.ranges();
        let smooth = self.penalties.iter().map(|penalty| {
            penalty.weight * penalty.roughness(&theta[ranges[penalty.function].clone()])
        });
        let jumps = self.variations.iter().map(|variation| {
            variation.weight * variation.total(&theta[ranges[variation.function].clone()])
        });
        let broken = self.soft.iter().map(|group| group.price(theta));
        // An empty sum is -0.0.
        0.0 + smooth.sum::<f64>() + jumps.sum::<f64>() + broken.sum::<f64>()
    }
}
