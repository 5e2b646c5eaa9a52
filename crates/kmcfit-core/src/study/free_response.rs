//! Free responses of a system from other initial states, beside those of the true system.

use crate::simulate::{SimulationError, Trajectory};
use crate::system::quadrature::trapezoid;
use crate::system::{NodalCoefficients, State, System};
use serde::{Deserialize, Serialize};

/// The response of the found system from one initial state, against the true system's. Of a rotation rad stands for m.
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
    /// Largest distance of the response from zero, m; `None` where there is no response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest: Option<f64>,
    /// Displacement at the last node, m; `None` where there is no response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<f64>,
    /// Why there is no response from there, if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// A prediction and the responses that it sums up.
#[derive(Debug, Clone)]
pub struct PredictedResponse {
    /// In numbers.
    pub summary: PredictionSummary,
    /// The found system's response.
    pub response: Trajectory,
    /// The true system's response, where the truth is known.
    pub truth: Option<Trajectory>,
}

/// The free response of `system` from each of `states`; `truth` is the true system, where known. The
/// cost is `integral (y - y_true)^2 dt`, the energy `integral y_true^2 dt`, by the trapezoid rule.
///
/// # Errors
/// A [`SimulationError`] if a response does not exist.
pub fn predict(
    system: &System,
    nodal: &NodalCoefficients,
    truth: Option<&NodalCoefficients>,
    states: &[State],
) -> Result<Vec<PredictedResponse>, SimulationError> {
    states
        .iter()
        .map(|&state| {
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
    state: State,
    response: &Trajectory,
    truth: Option<&Trajectory>,
) -> PredictionSummary {
    let integral = |f: &dyn Fn(usize) -> f64| {
        let squares: Vec<f64> = (0..response.displacement.len())
            .map(|i| f(i).powi(2))
            .collect();
        trapezoid(&squares, system.grid.step())
    };
    PredictionSummary {
        displacement: state.displacement,
        velocity: state.velocity,
        cost: truth.map(|t| integral(&|i| response.displacement[i] - t.displacement[i])),
        energy: truth.map(|t| integral(&|i| t.displacement[i])),
        largest: Some((response.displacement.iter()).fold(0.0, |most, y| most.max(y.abs()))),
        last: response.displacement.last().copied(),
        failure: None,
    }
}
