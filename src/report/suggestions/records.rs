//! Suggestions about records and their inputs.

use super::{Suggestion, of_channel, position, written};
use crate::config::Model;
use crate::report::document::ResultDocument;
use kmcfit_core::assessment::{Doubt, RecordError};
use kmcfit_core::functions::ScalarValue;
use kmcfit_core::number_format::significant;
use kmcfit_core::record::{BaseMotion, Waveform};
use kmcfit_core::signal::{Interpolation, Signal};
use kmcfit_core::system::InputQuantity;

/// Delays, in samples, like that of an input held between its samples.
const HALF_SAMPLE: std::ops::RangeInclusive<f64> = 0.4..=0.6;

/// Override for the gain of a channel that is a factor of the given one.
fn changed_gain(model: &Model, i: usize, channel: &str, factor: f64) -> String {
    let mut channels = model.problem.experiments[i].channels.iter();
    let known = channels.find(|c| c.kind().name() == channel);
    let given = known.map_or(1.0, |c| match c.sensor().gain {
        ScalarValue::Known(gain) => gain,
        ScalarValue::Estimated(_) => 1.0,
    });
    let gain = written(given * factor);
    format!("experiments.{i}.sensors.{channel}.gain={gain}")
}

/// The measured input of an experiment, with its key in a model file.
fn sampled_input(model: &Model, i: usize) -> Option<(&'static str, &Signal)> {
    let input = &model.problem.experiments[i].input;
    match (&input.force, &input.base) {
        (Some(Waveform::Samples(signal)), _) => Some(("force", signal)),
        (_, Some(BaseMotion::Acceleration(signal))) => Some(("base", signal)),
        _ => None,
    }
}

/// Correction of an error of a record.
pub(super) fn about_error(
    error: &RecordError,
    document: &ResultDocument,
    model: &Model,
) -> Option<Suggestion> {
    match error {
        RecordError::ChannelFactor {
            channel, factor, ..
        } => {
            let gain = |i: usize| vec![changed_gain(model, i, channel, *factor)];
            Some(Suggestion::change(
                "scale_channel",
                format!(
                    "correct the unit of the {channel} or of the other channels and the input (`units`), or state the gain of its sensor"
                ),
                of_channel(document, channel, gain),
            ))
        }
        RecordError::InputSign { experiment } => {
            let i = position(document, experiment)?;
            let channels = document.experiments[i].channels.iter();
            let gains = channels.map(|c| changed_gain(model, i, &c.kind, -1.0));
            Some(Suggestion::change(
                "reverse_input",
                format!(
                    "reverse the sign of the input of {experiment} in its file, or that of the response"
                ),
                gains.collect(),
            ))
        }
        RecordError::Delay {
            experiment,
            samples,
            ..
        } => about_delay(document, experiment, *samples),
        RecordError::InputJump { experiment, .. } => {
            let i = position(document, experiment)?;
            let (part, signal) = sampled_input(model, i)?;
            (signal.interpolation() != Interpolation::Hold).then(|| {
                Suggestion::change(
                    "hold_input",
                    "hold each value of the input until the next",
                    vec![format!("experiments.{i}.{part}.interpolation=hold")],
                )
            })
        }
        RecordError::ClockDifference {
            experiment,
            percent,
        } => Some(Suggestion::untried(
            "scale_times",
            format!(
                "put input and response of {experiment} on one clock in the file: multiply the times of the response by {}",
                significant(1.0 + 0.01 * percent, 6)
            ),
        )),
        RecordError::InputPulses { .. } => None,
    }
}

/// Another interpolation of the input, or an estimated delay, for a response that lags by these samples.
pub(super) fn about_delay(
    document: &ResultDocument,
    experiment: &str,
    samples: f64,
) -> Option<Suggestion> {
    let i = position(document, experiment)?;
    let record = &document.experiments[i];
    let is_force = record.driven_by.iter().any(|d| d == "force");
    let input = if is_force { "force" } else { "base" };
    let channel = match record.channels.as_slice() {
        [only] => only.kind.as_str(),
        _ if is_force => "force",
        _ => "base_acceleration",
    };
    let is_half = HALF_SAMPLE.contains(&samples.abs());
    let (words, change) = match (is_half, samples > 0.0) {
        (true, true) => (
            "the lag is that of an input held between its samples",
            format!("{input}.interpolation=hold"),
        ),
        (true, false) => (
            "the lead is that of an input that is not held between its samples",
            format!("{input}.interpolation=cubic"),
        ),
        (false, _) => (
            "estimate the delay",
            format!("sensors.{channel}.delay=estimate"),
        ),
    };
    Some(Suggestion::change(
        "estimate_delay",
        format!("{experiment}: {words}"),
        vec![format!("experiments.{i}.{change}")],
    ))
}

/// Noise of the sensor of an input, with cubics where lines connect its samples, as these lose a share of it.
pub(super) fn about_disturbance(
    document: &ResultDocument,
    model: &Model,
    experiment: &str,
    name: &str,
    sigma: f64,
) -> Option<Suggestion> {
    let is_held = |signal: &Signal| signal.interpolation() == Interpolation::Hold;
    let jump = document.doubts().find_map(|doubt| match doubt {
        Doubt::RecordError(RecordError::InputJump { experiment, .. }) => Some(experiment),
        _ => None,
    });
    if let Some(jump) = jump {
        // The jump explains the disturbance.
        is_held(sampled_input(model, position(document, jump)?)?.1).then_some(())?;
    }
    let i = position(document, experiment)?;
    let (part, signal) = sampled_input(model, i)?;
    let is_linear = signal.interpolation() == Interpolation::Linear;
    let cubics = is_linear.then(|| format!("experiments.{i}.{part}.interpolation=cubic"));
    let noise = format!(
        "experiments.{i}.sigma.{name}={{value: {}, kind: sensor}}",
        written(sigma)
    );
    Some(Suggestion::change(
        "input_noise",
        format!("state the noise of the {} sensor", name.replace('_', " ")),
        std::iter::once(noise).chain(cubics).collect(),
    ))
}

/// Cubic interpolation of a force, which loses less.
pub(super) fn about_interpolation(
    document: &ResultDocument,
    experiment: &str,
    input: InputQuantity,
) -> Option<Suggestion> {
    let input = match input {
        InputQuantity::Force => "force",
        InputQuantity::BaseAcceleration => "base",
    };
    let i = position(document, experiment)?;
    Some(Suggestion::change(
        "cubic_interpolation",
        "interpolate the input by cubics",
        vec![format!("experiments.{i}.{input}.interpolation=cubic")],
    ))
}
