//! Cost function of a problem and its derivatives, from one simulation per point.

mod cost_and_gradient;
mod gradient;
mod jacobian;
mod node_aligned;
mod prediction;
mod residual_diagnostics;
mod row_prediction;
mod scales;
mod simulated_record;
mod step_halving;

pub(crate) use gradient::Gradient;
pub use gradient::GradientKind;
pub use residual_diagnostics::{all_diagnostics, outliers};
pub(crate) use residual_diagnostics::{channel_fit_percent, diagnostics};
pub(crate) use row_prediction::RowSamples;
pub(crate) use scales::state_scales;
pub(crate) use simulated_record::RecordTangent;
pub use simulated_record::SimulatedRecord;
pub(crate) use step_halving::Refined;

use crate::problem::Problem;
use crate::record::{Channel, Experiment};
use crate::step::{Cause, Driven, EngineMode, SimulationError, Trajectory};
use crate::system::{NodalCoefficients, State, SystemTangent, TimePoint};

/// Cost at one point, with the simulation it was computed from.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Cost `J`, the sum of misfit and regularisation.
    pub cost: f64,
    /// Misfit of the samples.
    pub misfit: f64,
    /// Penalties, soft constraints and priors.
    pub regularisation: f64,
    /// Nodal values of the shared coefficient set.
    pub nodal: NodalCoefficients,
    /// Nodal values of the other coefficient sets of
    /// [`Parameterization::coefficient_sets`](crate::functions::Parameterization::coefficient_sets).
    pub own_nodal: Vec<NodalCoefficients>,
    /// Scalar parameters.
    pub scalars: Vec<f64>,
    /// Response of each experiment.
    pub trajectories: Vec<Trajectory>,
    /// Predicted samples of each experiment and channel.
    pub predictions: Vec<Vec<Vec<f64>>>,
}

impl Evaluation {
    /// Nodal values of coefficient set `which`.
    pub fn nodal_of(&self, which: usize) -> &NodalCoefficients {
        match which {
            0 => &self.nodal,
            own => &self.own_nodal[own - 1],
        }
    }
}

impl Problem {
    /// Storage for evaluations by [`Problem::evaluate_into`].
    pub fn workspace(&self) -> Evaluation {
        let nodal_sets = self.functions.coefficient_sets().len();
        Evaluation {
            cost: f64::NAN,
            misfit: f64::NAN,
            regularisation: f64::NAN,
            nodal: self.functions.empty_nodal(),
            own_nodal: vec![self.functions.empty_nodal(); nodal_sets - 1],
            scalars: vec![0.0; self.functions.scalars().len()],
            trajectories: (self.experiments.iter())
                .map(|e| Trajectory::of(&self.system.structure, e.nodes))
                .collect(),
            predictions: (self.experiments.iter())
                .map(|e| vec![Vec::new(); e.channels.len()])
                .collect(),
        }
    }

    /// Evaluates the cost at the parameters `theta`.
    ///
    /// The cost is the sum of [`Channel::cost`](crate::record::Channel::cost) over the channels, of
    /// `weight |L theta - target|^2` over the penalties ([`crate::functions::Penalty`]), of `weight sum |D theta|` over the
    /// total-variation penalties ([`crate::functions::TotalVariation`]), of the soft constraints
    /// ([`crate::constraints::RowGroup::price`]) and of the priors ([`crate::functions::Prior::price`]).
    ///
    /// # Errors
    /// A [`SimulationError`] if the mass is not positive at some node, or the response or the cost overflows.
    pub fn evaluate(&self, theta: &[f64]) -> Result<Evaluation, SimulationError> {
        let mut evaluation = self.workspace();
        self.evaluate_into(theta, &mut evaluation)?;
        Ok(evaluation)
    }

    /// [`Problem::evaluate`] into existing storage, whose contents are undefined after an error.
    ///
    /// # Errors
    /// As [`Problem::evaluate`].
    pub fn evaluate_into(
        &self,
        theta: &[f64],
        evaluation: &mut Evaluation,
    ) -> Result<(), SimulationError> {
        self.evaluate_for(EngineMode::Fastest, theta, evaluation)
    }

    /// [`Problem::evaluate_into`] in an [`EngineMode`].
    ///
    /// # Errors
    /// As [`Problem::evaluate`].
    pub fn evaluate_for(
        &self,
        mode: EngineMode,
        theta: &[f64],
        evaluation: &mut Evaluation,
    ) -> Result<(), SimulationError> {
        self.set_parameters(theta, evaluation);
        self.responses(mode, evaluation)?;
        evaluation.regularisation = self.regularisation(theta);
        evaluation.cost = evaluation.misfit + evaluation.regularisation;
        if !evaluation.cost.is_finite() {
            return Err(self.cost_overflow(evaluation));
        }
        Ok(())
    }

    /// Sets functions and scalars to those of the parameters `theta`.
    pub(crate) fn set_parameters(&self, theta: &[f64], evaluation: &mut Evaluation) {
        self.functions.nodal_into(theta, 0, &mut evaluation.nodal);
        for (i, own) in evaluation.own_nodal.iter_mut().enumerate() {
            self.functions.nodal_into(theta, i + 1, own);
        }
        evaluation.scalars.copy_from_slice(self.scalars(theta));
    }

    /// Channels of all experiments, each with its predictions.
    pub(crate) fn predicted<'a>(
        &'a self,
        evaluation: &'a Evaluation,
    ) -> impl Iterator<Item = (&'a Channel, &'a Vec<f64>)> {
        self.channels().zip(evaluation.predictions.iter().flatten())
    }

    fn responses(
        &self,
        mode: EngineMode,
        evaluation: &mut Evaluation,
    ) -> Result<(), SimulationError> {
        evaluation.misfit = 0.0;
        for (e, experiment) in self.experiments.iter().enumerate() {
            let nodal = match experiment.coefficient_set {
                0 => &evaluation.nodal,
                own => &evaluation.own_nodal[own - 1],
            };
            let response = &mut evaluation.trajectories[e];
            let initial = experiment.initial_state(&evaluation.scalars);
            let (system, excitation) = (&self.system, experiment.excitation.as_ref());
            let driven = Driven {
                system,
                nodal,
                excitation,
            };
            driven.respond(mode, &initial, response)?;
            let view = SimulatedRecord {
                system,
                nodal,
                excitation,
                response,
                scalars: &evaluation.scalars,
            };
            let predictions = experiment
                .channels
                .iter()
                .zip(&mut evaluation.predictions[e]);
            for (channel, predicted) in predictions {
                channel.predict_into(view, predicted);
                evaluation.misfit += channel.cost(predicted);
            }
        }
        Ok(())
    }

    /// Simulated record of experiment `e` at an evaluated point.
    pub fn view<'a>(&'a self, evaluation: &'a Evaluation, e: usize) -> SimulatedRecord<'a> {
        let experiment = &self.experiments[e];
        SimulatedRecord {
            system: &self.system,
            nodal: evaluation.nodal_of(experiment.coefficient_set),
            excitation: experiment.excitation.as_ref(),
            response: &evaluation.trajectories[e],
            scalars: &evaluation.scalars,
        }
    }

    /// Directional derivative of all predictions, for each experiment and channel, by one tangent solve.
    pub fn predictions_tangent(
        &self,
        evaluation: &Evaluation,
        along: &[f64],
    ) -> Vec<Vec<Vec<f64>>> {
        let scalars = self.scalars(along);
        let each = self.experiments.iter().enumerate().map(|(e, experiment)| {
            let view = self.view(evaluation, e);
            let direction = self.system_tangent(experiment, along);
            let response = view.driven().tangent(view.response, &direction);
            let along = RecordTangent {
                nodal: &direction.nodal,
                response: &response,
                scalars,
            };
            let channels = experiment.channels.iter();
            channels.map(|c| c.predict_tangent(view, along)).collect()
        });
        each.collect()
    }

    /// Change of the functions and the initial state of an experiment along a change of the parameters.
    fn system_tangent(&self, experiment: &Experiment, along: &[f64]) -> SystemTangent {
        let scalars = self.scalars(along);
        let initial = experiment.initial_parameters.iter();
        let initial = initial.map(|estimated| estimated.map_or(0.0, |i| scalars[i]));
        SystemTangent {
            nodal: self.functions.direction(along, experiment.coefficient_set),
            initial: State::of_components(experiment.initial.coordinates(), initial.collect()),
        }
    }

    /// Error with the location of the largest residual, for a cost that is not finite.
    fn cost_overflow(&self, evaluation: &Evaluation) -> SimulationError {
        let mut worst = (
            TimePoint {
                step: 0,
                fraction: 0.0,
            },
            0.0f64,
        );
        for (channel, predicted) in self.predicted(evaluation) {
            for (position, r) in channel.positions().zip(channel.residuals(predicted)) {
                if r.abs() > worst.1.abs() {
                    worst = (position, r);
                }
            }
        }
        let node = worst.0.as_node().unwrap_or(worst.0.step);
        SimulationError {
            cause: Cause::CostOverflow,
            node,
            time: self.system.grid.time(node),
            value: worst.1,
        }
    }

    /// Regularisation at `theta`: penalties `weight |L theta - target|^2`, total variation `weight sum |D theta|`, soft
    /// constraints `weight mean excess^2` and priors.
    pub fn regularisation(&self, theta: &[f64]) -> f64 {
        let ranges = self.functions.ranges();
        let smooth = self.penalties.iter().map(|penalty| {
            penalty.weight * penalty.roughness(&theta[ranges[penalty.function].clone()])
        });
        let jumps = self.variations.iter().map(|variation| {
            variation.weight * variation.total(&theta[ranges[variation.function].clone()])
        });
        let broken = self.soft.iter().map(|group| group.price(theta));
        let priors = self.functions.prior_cost(theta);
        // An empty sum is -0.0.
        0.0 + smooth.sum::<f64>() + jumps.sum::<f64>() + broken.sum::<f64>() + priors
    }
}
