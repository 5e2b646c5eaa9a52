//! The motion of a found device from other initial states, against the true device's.

use super::document::Prediction;
use kmcfit_core::internals::simulate::{SimulationError, Trajectory};
use kmcfit_core::internals::system::quadrature::trapezoid;
use kmcfit_core::internals::system::{NodalCoefficients, State, System};

/// A prediction and the motions that it sums up.
#[derive(Debug, Clone)]
pub struct PredictedMotion {
    /// In numbers.
    pub summary: Prediction,
    /// The found device's motion.
    pub motion: Trajectory,
    /// The true device's motion, where the truth is known.
    pub truth: Option<Trajectory>,
}

/// The free motion of `device` from each of `states`; `truth` is the true device, where known. The
/// cost is `integral (y - y_true)^2 dt`, the energy `integral y_true^2 dt`, by the trapezoid rule.
///
/// # Errors
/// A [`SimulationError`] if a motion does not exist.
pub fn predict(
    oscillator: &System,
    device: &NodalCoefficients,
    truth: Option<&NodalCoefficients>,
    states: &[State],
) -> Result<Vec<PredictedMotion>, SimulationError> {
    states
        .iter()
        .map(|&state| {
            let motion = oscillator.forward(device, state, None)?;
            let truth = truth
                .map(|truth| oscillator.forward(truth, state, None))
                .transpose()?;
            Ok(PredictedMotion {
                summary: summarise(oscillator, state, &motion, truth.as_ref()),
                motion,
                truth,
            })
        })
        .collect()
}

fn summarise(
    oscillator: &System,
    state: State,
    motion: &Trajectory,
    truth: Option<&Trajectory>,
) -> Prediction {
    let integral = |f: &dyn Fn(usize) -> f64| {
        let squares: Vec<f64> = (0..motion.displacement.len())
            .map(|i| f(i).powi(2))
            .collect();
        trapezoid(&squares, oscillator.grid.step())
    };
    Prediction {
        displacement: state.displacement,
        velocity: state.velocity,
        cost: truth.map(|t| integral(&|i| motion.displacement[i] - t.displacement[i])),
        energy: truth.map(|t| integral(&|i| t.displacement[i])),
        largest: Some((motion.displacement.iter()).fold(0.0, |most, y| most.max(y.abs()))),
        last: motion.displacement.last().copied(),
        failure: None,
    }
}
