//! Step-size check: simulation on a grid with half the step, at unchanged functions.

use super::{Evaluation, SimulatedRecord};
use crate::problem::Problem;
use crate::step::{Driven, EngineMode, SimulationError, Trajectory};
use crate::system::{Grid, NodalCoefficients, System};
use std::ops::Range;

/// Number of steps of a block: its states and functions on half the step take some ten MB.
const BLOCK: usize = 1 << 17;

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
        let mut refined = Refined {
            step: 0.5 * self.system.grid.step(),
            misfit: 0.0,
            changes: Vec::new(),
        };
        for (e, experiment) in self.experiments.iter().enumerate() {
            let Some(predictions) = self.halved_predictions(e, evaluation, BLOCK)? else {
                return Ok(None);
            };
            let mut changes = Vec::new();
            let channels = experiment.channels.iter().zip(&evaluation.predictions[e]);
            for ((channel, before), mut after) in channels.zip(predictions) {
                if !channel.filter().is_empty() {
                    after = channel.filtered(&after);
                }
                refined.misfit += channel.cost(&after);
                changes.push(after.iter().zip(before).map(|(a, b)| a - b).collect());
            }
            refined.changes.push(changes);
        }
        Ok(Some(refined))
    }

    /// Predictions of experiment `e` on half the step before filters, by blocks of `block` steps, so that memory holds the states of one
    /// block.
    fn halved_predictions(
        &self,
        e: usize,
        evaluation: &Evaluation,
        block: usize,
    ) -> Result<Option<Vec<Vec<f64>>>, SimulationError> {
        let (experiment, whole) = (&self.experiments[e], &self.system.grid);
        let nodal = evaluation.nodal_of(experiment.coefficient_set);
        let count = experiment.nodes - 1;
        // A delayed sample may need the states of another block.
        let is_delayed = (experiment.channels.iter()).any(|c| c.sensor().is_delayed());
        let block = if is_delayed { count } else { block };
        let mut predictions = vec![Vec::new(); experiment.channels.len()];
        let mut state = experiment.initial_state(&evaluation.scalars);
        let mut first = 0;
        while first < count {
            // The last block has up to twice the steps.
            let end = if count - first < 2 * block {
                count
            } else {
                first + block
            };
            let (grid, steps) = match (first, end) == (0, count) {
                true => (
                    whole.with_nodes(2 * whole.nodes() - 1),
                    0..whole.nodes() - 1,
                ),
                false => {
                    let duration = (end - first) as f64 * whole.step();
                    let grid = Grid::new(whole.time(first), duration, 2 * (end - first) + 1);
                    (grid, first..end)
                }
            };
            let Some(grid) = grid else {
                return Ok(None);
            };
            let Some(part) = experiment.halved(first..end, state.clone(), &grid) else {
                return Ok(None);
            };
            let system = System {
                grid,
                ..self.system.clone()
            };
            let nodal = halved(nodal, steps);
            let excitation = part.excitation.as_ref();
            let mut response = Trajectory::of(&system.structure, part.nodes);
            let driven = Driven {
                system: &system,
                nodal: &nodal,
                excitation,
            };
            driven
                .respond(EngineMode::Fastest, &state, &mut response)
                .map_err(|error| SimulationError {
                    node: error.node + 2 * first,
                    ..error
                })?;
            let view = SimulatedRecord {
                system: &system,
                nodal: &nodal,
                excitation,
                response: &response,
                scalars: &evaluation.scalars,
            };
            let channels = part.channels.iter().zip(&mut predictions);
            for (channel, predicted) in channels.filter(|(channel, _)| !channel.is_empty()) {
                predicted.extend(channel.predict(view));
            }
            response.read(part.nodes - 1, state.components_mut());
            first = end;
        }
        Ok(Some(predictions))
    }
}

/// Functions over the steps `steps` on the refined grid, linear between the old nodes.
fn halved(nodal: &NodalCoefficients, steps: Range<usize>) -> NodalCoefficients {
    let finer = |f: &[f64]| -> Vec<f64> {
        let f = &f[steps.start..=steps.end];
        let pairs = f.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]);
        pairs.chain(f.last().copied()).collect()
    };
    NodalCoefficients {
        inertias: nodal.inertias.iter().map(|f| finer(f)).collect(),
        coefficients: nodal.coefficients.iter().map(|f| finer(f)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::functions::{
        Basis, CoefficientFunction, CoefficientKind, Parameterization, ScalarValue,
    };
    use crate::record::{Channel, ChannelKind, Experiment, Input, Sensor, Waveform, Weighting};
    use crate::signal::{Interpolation, Signal, low_pass};
    use crate::structure::{Law, Structure};
    use crate::system::InputSample;
    use crate::system::Method;
    use crate::system::State;

    const NODES: usize = 101;

    /// A record with a force that jumps, a stiffness that varies, accelerations of a sensor with gain and drift behind a filter, and
    /// displacements at and between the nodes.
    fn problem() -> Problem {
        let grid = Grid::new(0.5, 10.0, NODES).expect("a grid");
        let knots = vec![0.5, 3.3, 10.5];
        let basis = Basis::PiecewiseLinear { knots };
        let stiffness = vec![3.0, 8.0, 5.0];
        let list = vec![
            CoefficientFunction::constant(CoefficientKind::MASS, 1.3, NODES),
            CoefficientFunction::constant(CoefficientKind::DAMPING, 0.2, NODES),
            CoefficientFunction::free(CoefficientKind::STIFFNESS, basis, &grid, stiffness),
        ];
        let functions = Parameterization::new(list, NODES, grid.step()).expect("functions");
        let times: Vec<f64> = (0..=40).map(|i| 0.5 + 0.25 * f64::from(i)).collect();
        let forces = times.iter().map(|t| (3.0 * t).sin()).collect();
        let signal = Signal::new(times, forces, Interpolation::Hold).expect("a signal");
        let input = Input {
            force: Some(Waveform::Samples(signal)),
            ..Input::default()
        };
        let channel = |kind, times: Vec<f64>| {
            let values = times.iter().map(|t| (2.0 * t).cos()).collect();
            Channel::new(kind, times, values, Weighting::Sigma(0.1), &grid, NODES).expect("samples")
        };
        let input_at = |t: &f64| InputSample {
            force: input.force_at(*t),
            base: 0.0,
        };
        let sensor = Sensor {
            gain: ScalarValue::Known(1.1),
            drift: ScalarValue::Known(0.01),
            ..Sensor::default()
        };
        let accelerations = channel(ChannelKind::Acceleration, grid.times())
            .with_inputs_at_samples(grid.times().iter().map(input_at).collect())
            .with_sensor(sensor)
            .with_filter(low_pass(2, 2.0, 10.0).expect("a filter"));
        let between = (0..60)
            .map(|i| grid.start() + 0.15 * f64::from(i))
            .collect();
        let state = State::one(0.3, -1.0);
        let record = Experiment {
            excitation: Some(input.on(&grid, NODES)),
            input,
            ..Experiment::free("driven", state, NODES)
                .with_channel(accelerations)
                .with_channel(channel(ChannelKind::Displacement, between))
        };
        let system = System {
            grid,
            method: Method::Rk4,
            structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
        };
        Problem::new(system, functions, vec![record]).expect("a problem")
    }

    #[test]
    fn blocks_have_the_predictions_of_the_whole_record() {
        let problem = problem();
        let evaluation = problem.evaluate(&problem.start()).expect("a response");
        let by = |block| {
            let found = problem.halved_predictions(0, &evaluation, block);
            found.expect("a response").expect("samples on the grid")
        };
        let whole = by(NODES);
        assert_eq!(whole.iter().map(Vec::len).collect::<Vec<_>>(), [NODES, 60]);
        for block in [1, 2, 7, 33, 50, 99, 100] {
            for (parts, whole) in by(block).iter().zip(&whole) {
                assert_eq!(parts.len(), whole.len(), "{block}");
                // Predictions are of size 10; times of nodes differ by rounding.
                let apart = crate::simd::sum::largest_difference(parts, whole);
                assert!(apart < 1e-12, "{block}: {apart}");
            }
        }
    }
}
