//! Errors of an input, and the conditions under which they can be taken into account.

use super::BuildError;
use super::record::{ChannelSpec, Record};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{BaseMotion, Input, InputNoise, Loss, NoiseModel, Waveform, Weighting};
use crate::signal::Signal;
use crate::solvers::Solver;
use crate::system::InputQuantity;

impl Record {
    /// Errors of the input of the record with the key `record`; `input` is its input.
    pub(super) fn error_of(
        &self,
        input: &Input,
        record: &str,
    ) -> Result<Option<InputNoise>, BuildError> {
        let Some(stated) = &self.input_error else {
            return Ok(None);
        };
        let name = stated.quantity.name();
        let key = format!("{record}.sigma.{name}");
        if !(stated.sigma.is_finite() && stated.sigma > 0.0) {
            return Err(
                BuildError::new(key, "a standard deviation must be positive")
                    .found(stated.sigma)
                    .expected("a number greater than 0, in SI units"),
            );
        }
        let Some(signal) = samples(input, stated.quantity) else {
            let quantity = name.replace('_', " ");
            return Err(
                BuildError::new(key, format!("the {quantity} is not measured"))
                    .found(format!("no samples of the {quantity}"))
                    .expected(format!("`columns: {{{name}: …}}`, or no sigma of it")),
            );
        };
        match self.channels.as_slice() {
            [channel] => check_channel(channel, key)?,
            channels => {
                let problem = "errors of an input are supported for records with one channel";
                return Err(BuildError::new(key, problem)
                    .found(format!("{} channels", channels.len()))
                    .expected("one channel, or no sigma of the input"));
            }
        }
        Ok(Some(InputNoise {
            times: signal.times().to_vec(),
            interpolation: signal.interpolation(),
            ..stated.clone()
        }))
    }
}

/// Samples of an input, where it is measured.
fn samples(input: &Input, quantity: InputQuantity) -> Option<&Signal> {
    match (quantity, &input.force, &input.base) {
        (InputQuantity::Force, Some(Waveform::Samples(signal)), _)
        | (InputQuantity::BaseAcceleration, _, Some(BaseMotion::Acceleration(signal))) => {
            Some(signal)
        }
        _ => None,
    }
}

fn check_channel(channel: &ChannelSpec, key: String) -> Result<(), BuildError> {
    let kind = channel.kind.name();
    let error = |problem: &str| BuildError::new(&key, problem);
    match &channel.weighting {
        Some(Weighting::Sigma(_) | Weighting::Estimated { .. }) => {}
        other => {
            return Err(
                error("errors of an input need one sigma for all samples of the channel")
                    .found(match other {
                        None => format!("no `sigma.{kind}`"),
                        Some(_) => format!("a column as `sigma.{kind}`"),
                    })
                    .expected(format!("`sigma: {{{kind}: …}}`: a number, or `estimate`")),
            );
        }
    }
    if channel.loss != Loss::Squares {
        return Err(error("errors of an input need the loss `squares`")
            .found(format!("a robust loss of the {kind}"))
            .expected("`squares`, or no sigma of the input"));
    }
    if !channel.filter.is_empty() {
        return Err(error("errors of an input need samples without a filter")
            .found(format!("a filter of the {kind}"))
            .expected("no filter, or no sigma of the input"));
    }
    if matches!(channel.noise, NoiseModel::Autoregressive { .. }) {
        return Err(
            error("errors of an input are supported with white noise of the channel")
                .found(format!("`noise.{kind}.ar`"))
                .expected("`white` or `auto`, or no sigma of the input"),
        );
    }
    Ok(())
}

/// Error where the errors of an input cannot be used: by a method without a likelihood, or with too many parameters.
pub(super) fn check(problem: &Problem, solver: Solver) -> Result<(), BuildError> {
    let each = problem.experiments.iter().enumerate();
    let Some((i, error)) = each
        .filter_map(|(i, e)| Some((i, e.input_error.as_ref()?)))
        .next()
    else {
        return Ok(());
    };
    let key = format!("experiments[{i}].sigma.{}", error.quantity.name());
    if matches!(solver, Solver::SteepestDescent | Solver::EquationError) {
        let text = "the method does not use errors of an input";
        return Err(BuildError::new(key, text)
            .found(format!("`{}`", solver.name()))
            .expected(
                "`gauss-newton`, `projected-gradient` or `lbfgs`, or no sigma of the input",
            ));
    }
    let count = problem.parameters();
    if count > FEW_PARAMETERS {
        let text = format!("errors of an input are supported up to {FEW_PARAMETERS} parameters");
        return Err(BuildError::new(key, text)
            .found(format!("{count} parameters"))
            .expected("bases with fewer parameters, or no sigma of the input"));
    }
    Ok(())
}
