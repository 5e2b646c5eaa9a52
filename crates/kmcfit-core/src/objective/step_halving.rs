//! Step-size check: simulation on a grid with half the step, at unchanged functions.

use super::{Evaluation, SimulatedRecord};
use crate::problem::Problem;
use crate::simulate::{Engine, EngineMode, SimulationError, Trajectory};
use crate::system::{NodalCoefficients, System};

/// Results on half the step.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Half the step, s.
    pub step: f64,
    /// Misfit on half the step.
    pub misfit: f64,
    /// Changes of the predictions of each experiment and channel, in the SI unit of the channel.
    pub changes: Vec<Vec<Vec<f64>>>,
}

impl Problem {
    /// Simulates the same functions and scalars on a grid of half the step. Functions are linear between the old nodes,
    /// forces are sampled anew. `None` where samples do not lie on the finer grid.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation on the finer grid fails.
    pub fn on_half_step(
        &self,
        evaluation: &Evaluation,
    ) -> Result<Option<Refined>, SimulationError> {
        let Some(grid) = (self.system.grid).with_nodes(2 * self.system.grid.nodes() - 1) else {
            return Ok(None);
        };
        let system = System {
            grid,
            ..self.system.clone()
        };
        let mut refined = Refined {
            step: grid.step(),
            misfit: 0.0,
            changes: Vec::new(),
        };
        for (e, experiment) in self.experiments.iter().enumerate() {
            let Some(experiment) = experiment.halved(&grid) else {
                return Ok(None);
            };
            let nodal = halved(evaluation.nodal_of(experiment.coefficient_set));
            let mut response = Trajectory::zeros(experiment.nodes);
            let excitation = experiment.excitation.as_ref();
            let engine = Engine::choose(&system, excitation, experiment.nodes, EngineMode::Fastest);
            let initial = experiment.initial_state(&evaluation.scalars);
            engine.forward_into(&system, &nodal, initial, excitation, &mut response)?;
            let view = SimulatedRecord {
                system: &system,
                nodal: &nodal,
                excitation,
                response: &response,
                scalars: &evaluation.scalars,
            };
            let mut changes = Vec::new();
            for (channel, before) in experiment.channels.iter().zip(&evaluation.predictions[e]) {
                let after = channel.predict(view);
                refined.misfit += channel.cost(&after);
                changes.push(after.iter().zip(before).map(|(a, b)| a - b).collect());
            }
            refined.changes.push(changes);
        }
        Ok(Some(refined))
    }
}

/// Functions on the refined grid, linear between the old nodes.
fn halved(nodal: &NodalCoefficients) -> NodalCoefficients {
    let finer = |f: &[f64]| -> Vec<f64> {
        let pairs = f.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]);
        pairs.chain(f.last().copied()).collect()
    };
    NodalCoefficients {
        mass: finer(&nodal.mass),
        coefficients: nodal.coefficients.iter().map(|f| finer(f)).collect(),
    }
}
