//! Predicted samples of an identified system under a new excitation, with bands for the errors of its parameters and for the noise of the
//! samples.
//!
//! ```text
//! z(t) +- 1.96 sqrt(J(t) C J(t)^T)              errors of the parameters (delta method)
//! z(t) +- 1.96 sqrt(J(t) C J(t)^T + sigma^2)    a sample with noise
//! ```
//!
//! with the derivatives `J` of the sample in the parameters and their covariance `C`.

use super::prediction::{band, standard_errors};
use crate::functions::{CoefficientFunction, CoefficientSet, Parameterization, ScalarParameter};
use crate::problem::Problem;
use crate::record::{Channel, Experiment};
use crate::step::SimulationError;
use crate::system::{Grid, System};
use nalgebra::DMatrix;

/// An identified system: the coefficient set of its equation of motion on the grid of its record.
#[derive(Debug, Clone)]
pub struct IdentifiedSystem {
    /// Grid, stepper and terms of the fit.
    pub system: System,
    /// Functions of mass and terms, known parts last.
    pub functions: Vec<CoefficientFunction>,
    /// The functions of the equation of motion by their index.
    pub set: CoefficientSet,
    /// Parameters of the functions, then those of sensors.
    pub theta: Vec<f64>,
    /// Their covariance, if known.
    pub covariance: Option<DMatrix<f64>>,
}

impl IdentifiedSystem {
    /// True if every coefficient is the same at all times.
    pub fn is_constant(&self) -> bool {
        let is_flat = |list: &[f64]| list.windows(2).all(|pair| pair[0] == pair[1]);
        let mut functions = self.functions.iter();
        functions.all(|f| is_flat(&f.offset) && (f.parameters() == 0 || f.design.is_constant()))
    }

    /// The problem of a record with its own grid. Coefficients are linear between the nodes of the fit, and constant beyond its ends.
    ///
    /// `None` if the functions do not fit the terms, or the record does not fit the grid.
    pub fn problem(&self, grid: Grid, record: Experiment) -> Option<Problem> {
        self.problem_with_sensors(grid, record, Vec::new())
    }

    /// [`Self::problem`] of a record whose sensors have the estimated parameters `scalars`, the last ones of [`Self::theta`].
    pub fn problem_with_sensors(
        &self,
        grid: Grid,
        record: Experiment,
        scalars: Vec<ScalarParameter>,
    ) -> Option<Problem> {
        let from = &self.system.grid;
        let functions: Vec<CoefficientFunction> = (self.functions.iter())
            .map(|f| f.resampled(from, &grid))
            .collect();
        let sets = vec![self.set.clone()];
        let functions =
            Parameterization::with_coefficient_sets(functions, sets, grid.nodes(), grid.step())?
                .with_scalars(scalars);
        let system = System {
            grid,
            ..self.system.clone()
        };
        Problem::new(system, functions, vec![record]).ok()
    }

    /// Predicts the channels of the record of `problem` ([`Self::problem`]), with the standard deviation of the noise of each, where known.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation fails.
    pub fn predict(
        &self,
        problem: &Problem,
        sigmas: &[Option<f64>],
    ) -> Result<Vec<PredictedChannel>, SimulationError> {
        let evaluation = problem.evaluate(&self.theta)?;
        let errors = (self.covariance.as_ref())
            .map(|covariance| standard_errors(problem, &evaluation, covariance));
        let each = problem.predicted(&evaluation).enumerate();
        let predicted = each.map(|(c, (channel, values))| PredictedChannel {
            channel: channel.clone(),
            values: values.clone(),
            errors: errors.as_ref().map(|errors| errors[c].clone()),
            sigma: sigmas.get(c).copied().flatten(),
        });
        Ok(predicted.collect())
    }
}

/// Predicted samples of a channel.
#[derive(Debug, Clone)]
pub struct PredictedChannel {
    /// The channel; its samples are placeholders where there are no measurements.
    pub channel: Channel,
    /// Predictions, in the SI unit of the channel.
    pub values: Vec<f64>,
    /// Standard deviations of the predictions by the errors of the parameters, if these have a covariance.
    pub errors: Option<Vec<f64>>,
    /// Standard deviation of the noise of a sample, if known.
    pub sigma: Option<f64>,
}

impl PredictedChannel {
    /// 95 % band of the response; `None` without a covariance.
    pub fn band(&self) -> Option<Vec<[f64; 2]>> {
        let errors = self.errors.as_ref()?;
        Some(band(&self.values, errors.iter().copied()))
    }

    /// 95 % band of a sample, noise included; `None` without covariance or sigma.
    pub fn sample_band(&self) -> Option<Vec<[f64; 2]>> {
        let (errors, sigma) = (self.errors.as_ref()?, self.sigma?);
        let errors = errors.iter().map(|error| error.hypot(sigma));
        Some(band(&self.values, errors))
    }

    /// Share of the samples of the channel within their band ([`Self::sample_band`]).
    pub fn share_within(&self) -> Option<f64> {
        let band = self.sample_band()?;
        let pairs = band.iter().zip(self.channel.observed());
        let within = pairs.filter(|([low, high], z)| (low..=high).contains(z));
        Some(within.count() as f64 / band.len() as f64)
    }
}
