//! Loss of an input by lines between its samples.
//!
//! Lines between samples, equally spaced as most are, pass a sine of frequency `f` by the factor `sinc(f dt)^2` with `sinc(x) = sin(pi x) / (pi x)`. A response
//! near its natural frequency shows the input there: the coefficients have lost the same share, and short pulses lose more. What the estimates
//! have lost is seen by a second interpolation: the predictions with cubic splines, less those with lines, shift the estimates by one
//! Gauss-Newton step.
//!
//! White residuals show that the input is as interpolated, unless errors of the input are stated, which whiten what an interpolation leaves.

use super::Doubt;
use super::median_frequency::median_frequency;
use crate::alternatives::{with_cubics, with_input};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::{Signal, median_spacing};
use crate::simd::sum::rms;
use crate::system::InputQuantity;
use std::f64::consts::PI;

/// Smallest shift of an estimate, in standard errors, that is named.
const NOTICEABLE: f64 = 0.5;

/// Warnings about the interpolation of the inputs of all experiments; `is_white` where the residuals are.
pub(super) fn interpolation_losses(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    is_white: bool,
) -> Vec<Doubt> {
    let frequency = median_frequency(problem, evaluation);
    let each = problem.experiments.iter().enumerate();
    let each = each.filter_map(|(e, experiment)| {
        let is_open = !is_white || experiment.input_error.is_some();
        let (input, cubic) = is_open.then(|| with_cubics(problem, e)).flatten()?;
        let cycles = frequency? * median_spacing(cubic.times());
        let errors = shift_by(problem, theta, evaluation, e, (input, cubic))?;
        (errors > NOTICEABLE).then(|| Doubt::InterpolationLoss {
            experiment: experiment.name.clone(),
            input,
            share: 1.0 - passed(cycles),
            errors,
        })
    });
    each.collect()
}

/// True for a sigma of an input that the residuals contradict by no more than what the lines between its samples lose.
pub(super) fn is_loss(problem: &Problem, losses: &[Doubt], warning: &Doubt) -> bool {
    let Doubt::ContradictedInputSigma {
        experiment: name,
        input: quantity,
        given,
        likely,
    } = warning
    else {
        return false;
    };
    let lost = losses.iter().find_map(|loss| match loss {
        Doubt::InterpolationLoss {
            experiment,
            input,
            share,
            ..
        } => (experiment == name && input == quantity).then_some(*share),
        _ => None,
    });
    let mut experiments = problem.experiments.iter();
    let experiment = experiments.find(|experiment| experiment.name == *name);
    let size = || {
        let excitation = experiment?.excitation.as_ref()?;
        Some(rms(&excitation.quantity(*quantity)?.at_nodes()))
    };
    let most = lost.and_then(|share| Some(given.hypot(share * size()?)));
    most.is_some_and(|most| (*given..most).contains(likely))
}

/// Factor by which lines pass a sine of so many cycles per sample.
fn passed(cycles: f64) -> f64 {
    let sinc = (PI * cycles).sin() / (PI * cycles);
    sinc * sinc
}

/// Largest shift of a parameter, in standard errors, with this signal in place of the input of experiment `e`.
fn shift_by(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    e: usize,
    input: (InputQuantity, Signal),
) -> Option<f64> {
    let there = with_input(problem, e, input)?.evaluate(theta).ok()?;
    let pairs = problem.predicted(evaluation);
    let pairs = pairs.zip(there.predictions.iter().flatten());
    let changes = pairs.map(|((_, here), there)| {
        let both = there.iter().zip(here);
        both.map(|(a, b)| a - b).collect()
    });
    let shifts = problem.shifts_by(theta, evaluation, changes.collect())?;
    let errors = shifts
        .into_iter()
        .map(|[shift, error]| (shift / error).abs());
    Some(errors.filter(|x| x.is_finite()).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Interpolation;
    use std::f64::consts::TAU;

    /// The factor is the projection of the interpolated sine on the sine, over many periods.
    #[test]
    fn the_factor_is_that_of_an_interpolated_sine() {
        let cycles = 0.037;
        let times: Vec<f64> = (0..4001).map(f64::from).collect();
        let sine = |t: f64| (TAU * cycles * t).sin();
        let values = times.iter().map(|t| sine(*t)).collect();
        let signal = Signal::new(times, values, Interpolation::Linear).unwrap();
        let (mut product, mut square) = (0.0, 0.0);
        // 10 points in each interval of 100 periods in the middle.
        for i in 0..27_027 {
            let t = 600.0 + 0.1 * (f64::from(i) + 0.5);
            product += signal.value(t) * sine(t);
            square += sine(t) * sine(t);
        }
        let loss = 1.0 - product / square;
        let expected = 1.0 - passed(cycles);
        assert!((loss / expected - 1.0).abs() < 0.02, "{loss} {expected}");
    }
}
