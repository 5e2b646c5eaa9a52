//! Free responses of the identified system from given initial states, compared with those of the true system.

use crate::step::{SimulationError, Trajectory};
use crate::system::quadrature::trapezoid;
use crate::system::{NodalCoefficients, State, System};
use serde::{Deserialize, Serialize};

/// Key numbers of one free response, compared with that of the true system. Rotations are in rad in place of m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictionSummary {
    /// Initial displacement, m.
    pub displacement: f64,
    /// Initial velocity, m/s.
    pub velocity: f64,
    /// `integral (y - y_true)^2 dt`, m^2 s, where the truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// `integral y_true^2 dt`, m^2 s, where the truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    /// Peak displacement, m; `None` where the simulation fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest: Option<f64>,
    /// Displacement at the last node, m; `None` where the simulation fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<f64>,
    /// Reason for a failed simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// A free response and its key numbers.
#[derive(Debug, Clone)]
pub struct PredictedResponse {
    /// Key numbers.
    pub summary: PredictionSummary,
    /// Response of the identified system.
    pub response: Trajectory,
    /// Response of the true system, where known.
    pub truth: Option<Trajectory>,
}

/// Free responses of `system` with coefficients `nodal` from each of `states`, compared with those of the coefficients
/// `truth`, where known. Integrals use the trapezoid rule.
///
/// # Errors
/// A [`SimulationError`] if a simulation fails.
pub fn predict(
    system: &System,
    nodal: &NodalCoefficients,
    truth: Option<&NodalCoefficients>,
    states: &[State],
) -> Result<Vec<PredictedResponse>, SimulationError> {
    states
        .iter()
        .map(|state| {
            let response = system.forward(nodal, state, None)?;
            let truth = truth
                .map(|truth| system.forward(truth, state, None))
                .transpose()?;
            Ok(PredictedResponse {
                summary: summarise(system, state, &response, truth.as_ref()),
                response,
                truth,
            })
        })
        .collect()
}

fn summarise(
    system: &System,
    state: &State,
    response: &Trajectory,
    truth: Option<&Trajectory>,
) -> PredictionSummary {
    let integral = |f: &dyn Fn(usize) -> f64| {
        let squares: Vec<f64> = (0..response.displacement(0).len())
            .map(|i| f(i).powi(2))
            .collect();
        trapezoid(&squares, system.grid.step())
    };
    PredictionSummary {
        displacement: state.displacement(0),
        velocity: state.velocity(0),
        cost: truth.map(|t| integral(&|i| response.displacement(0)[i] - t.displacement(0)[i])),
        energy: truth.map(|t| integral(&|i| t.displacement(0)[i])),
        largest: Some((response.displacement(0).iter()).fold(0.0, |most, y| most.max(y.abs()))),
        last: response.displacement(0).last().copied(),
        failure: None,
    }
}
