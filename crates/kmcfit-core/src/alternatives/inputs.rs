//! Measured inputs, and problems with others in their place.

use crate::problem::Problem;
use crate::record::{BaseMotion, Experiment, Input, Waveform};
use crate::signal::{Interpolation, Signal};
use crate::system::InputQuantity;

/// The measured input of an experiment with one input.
pub(crate) fn measured(experiment: &Experiment) -> Option<(InputQuantity, &Signal)> {
    match (&experiment.input.force, &experiment.input.base) {
        (Some(Waveform::Samples(signal)), None) => Some((InputQuantity::Force, signal)),
        (None, Some(BaseMotion::Acceleration(signal))) => {
            Some((InputQuantity::BaseAcceleration, signal))
        }
        _ => None,
    }
}

/// The problem with cubic splines in place of the lines between the samples of all inputs; `None` where no lines connect them.
pub(crate) fn with_cubic_inputs(problem: &Problem) -> Option<Problem> {
    let mut other: Option<Problem> = None;
    for e in 0..problem.experiments.len() {
        if let Some(cubic) = with_cubics(problem, e) {
            other = Some(with_input(other.as_ref().unwrap_or(problem), e, cubic)?);
        }
    }
    other
}

/// The input of experiment `e`, if lines connect its samples, with cubic splines in their place. With errors of the input the samples are those
/// of the estimated input.
pub(crate) fn with_cubics(problem: &Problem, e: usize) -> Option<(InputQuantity, Signal)> {
    let experiment = &problem.experiments[e];
    let (input, times, values) = match (measured(experiment), &experiment.input_error) {
        (Some((input, signal)), _) => {
            (signal.interpolation() == Interpolation::Linear).then_some(())?;
            (input, signal.times().to_vec(), signal.values().to_vec())
        }
        (None, Some(error)) if error.interpolation == Interpolation::Linear => {
            let excitation = experiment.excitation.as_ref()?;
            let at_nodes = excitation.quantity(error.quantity)?.at_nodes();
            let grid = &problem.system.grid;
            let last = at_nodes.len().checked_sub(2)?;
            let at = |t: &f64| {
                let position = (t - grid.start()) / grid.step();
                let left = (position.max(0.0) as usize).min(last);
                let share = position - left as f64;
                at_nodes[left] + share * (at_nodes[left + 1] - at_nodes[left])
            };
            let values = error.times.iter().map(at).collect();
            (error.quantity, error.times.clone(), values)
        }
        _ => return None,
    };
    let cubic = Signal::new(times, values, Interpolation::Cubic)?;
    Some((input, cubic))
}

/// The problem with this signal in place of the input of experiment `e`.
pub(crate) fn with_input(
    problem: &Problem,
    e: usize,
    (input, signal): (InputQuantity, Signal),
) -> Option<Problem> {
    let mut other = problem.clone();
    let grid = other.system.grid;
    let experiment = other.parts_mut().experiments.get_mut(e)?;
    let input = match input {
        InputQuantity::Force => Input {
            force: Some(Waveform::Samples(signal)),
            ..Input::default()
        },
        InputQuantity::BaseAcceleration => Input {
            base: Some(BaseMotion::Acceleration(signal)),
            ..Input::default()
        },
    };
    experiment.excitation = Some(input.on(&grid, experiment.nodes));
    Some(other)
}
