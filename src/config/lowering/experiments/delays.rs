//! Delays of channels and inputs: stated ones shift the times, estimated ones leave out the samples that they may move out of the record.

use super::data_facts::{RecordNotes, time};
use super::{Entry, RawRecord};
use crate::error::InputError;
use kmcfit_core::finding::Finding;
use kmcfit_core::model::{DelayValue, ExperimentSpec, InputSensorSpec};
use kmcfit_core::number_format::significant;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::system::Grid;
use serde_json::json;
use std::sync::Arc;

/// Default limit of an estimated delay, in samples.
const LIMIT: f64 = 10.0;

/// Limits of an estimated delay.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayLimits {
    /// Name of the parameter.
    pub parameter: String,
    /// Smallest and largest delay, s.
    pub range: [f64; 2],
}

/// A delay, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Delay {
    /// Stated.
    Known(f64),
    /// Estimated within limits.
    Estimated { start: f64, range: [f64; 2] },
}

impl Delay {
    fn known(self) -> f64 {
        match self {
            Self::Known(delay) => delay,
            Self::Estimated { .. } => 0.0,
        }
    }

    /// Limits of the estimated part.
    fn range(self) -> [f64; 2] {
        match self {
            Self::Known(_) => [0.0; 2],
            Self::Estimated { range, .. } => range,
        }
    }

    /// Start of an estimated delay; `None` for a stated one, which is in the times.
    pub fn start(self) -> Option<f64> {
        match self {
            Self::Known(_) => None,
            Self::Estimated { start, .. } => Some(start),
        }
    }
}

/// The delay of a channel of an experiment, with samples `spacing` (s) apart.
pub fn of_channel(entry: &Entry<'_>, kind: ChannelKind, spacing: f64) -> Result<Delay, InputError> {
    let given = super::channel::sensor_of(entry.spec, kind).and_then(|s| s.delay.as_ref());
    delay(entry, kind.name(), given, spacing)
}

/// The delay of the input of an experiment.
pub fn of_input(entry: &Entry<'_>, spacing: f64) -> Result<Delay, InputError> {
    match input_sensor(entry.spec) {
        None => Ok(Delay::Known(0.0)),
        Some((name, sensor)) => delay(entry, name, sensor.delay.as_ref(), spacing),
    }
}

/// The sensor of the input that the model names.
fn input_sensor(spec: &ExperimentSpec) -> Option<(&'static str, &InputSensorSpec)> {
    let sensors = spec.sensors.as_ref()?;
    let named = [
        ("force", sensors.force.as_ref()),
        ("base_acceleration", sensors.base_acceleration.as_ref()),
        ("base_displacement", sensors.base_displacement.as_ref()),
    ];
    named
        .into_iter()
        .find_map(|(name, sensor)| Some((name, sensor?)))
}

fn delay(
    entry: &Entry<'_>,
    sensor: &str,
    given: Option<&DelayValue>,
    spacing: f64,
) -> Result<Delay, InputError> {
    let usual = LIMIT * spacing;
    let (start, range) = match given {
        None => return Ok(Delay::Known(0.0)),
        Some(DelayValue::Known(delay)) => {
            return Ok(Delay::Known(*delay));
        }
        Some(DelayValue::Estimate(_)) => (0.0, [-usual, usual]),
        Some(DelayValue::Estimated(spec)) => {
            let start = spec.start;
            let around = start.unwrap_or(0.0);
            let least = spec.min.unwrap_or(around - usual);
            let most = spec.max.unwrap_or(around + usual);
            let middle = if (least..=most).contains(&0.0) {
                0.0
            } else {
                0.5 * (least + most)
            };
            (start.unwrap_or(middle), [least, most])
        }
    };
    let [least, most] = range;
    let is_inside = least < most && (least..=most).contains(&start);
    match is_inside {
        true => Ok(Delay::Estimated { start, range }),
        false => Err((entry.at)
            .error_in(
                &format!("sensors.{sensor}.delay"),
                "the limits of the delay do not hold its start",
            )
            .found(format!("min {least} s, start {start} s, max {most} s"))
            .expected("`min` less than `max`, with `start` between them")),
    }
}

/// Refuses a sensor of an input that the experiment does not measure.
pub fn check_input(entry: &Entry<'_>, record: &RawRecord) -> Result<(), InputError> {
    let spec = entry.spec;
    let Some((name, _)) = input_sensor(spec) else {
        return Ok(());
    };
    let columns = spec.columns.as_ref();
    let has_column = columns.is_some_and(|c| match name {
        "force" => c.force.is_some(),
        "base_acceleration" => c.base_acceleration.is_some(),
        _ => c.base_displacement.is_some(),
    });
    let at = entry.at.below(&format!("sensors.{name}"));
    let in_words = name.replace('_', " ");
    if !has_column {
        return Err(at
            .error(format!("the {in_words} has no column, so it is not read"))
            .found(format!("a sensor of the {in_words}"))
            .expected(format!("`columns: {{{name}: …}}`, or leave the key out")));
    }
    if record.has_two_inputs() {
        return Err(at
            .error("the delay of an input needs one input")
            .found("a force and a motion of the base")
            .expected("one input, or delays of the channels"));
    }
    Ok(())
}

/// Applies stated delays to the times of the channels, and leaves out samples that a delay moves out of the record.
pub fn apply(
    entry: &Entry<'_>,
    record: &mut RawRecord,
    notes: &mut RecordNotes,
) -> Result<(), InputError> {
    check_input(entry, record)?;
    let (start, end) = (record.start(), record.end());
    let input = of_input(entry, record.spacing())?;
    let spec = entry.spec;
    if let (Delay::Known(seconds), Some((name, _))) = (input, input_sensor(spec))
        && seconds != 0.0
    {
        state(entry, &name.replace('_', " "), seconds, notes);
    }
    for channel in &mut record.channels {
        let own = of_channel(entry, channel.kind, channel.median_spacing)?;
        if own.known() != 0.0 {
            state(entry, channel.kind.name(), own.known(), notes);
        }
        let shift = own.known() - input.known();
        let least = shift + own.range()[0] - input.range()[1];
        let most = shift + own.range()[1] - input.range()[0];
        if shift == 0.0 && least == most {
            continue;
        }
        let near = 1e-6 * channel.median_spacing;
        let stays = |t: &f64| *t >= start + most - near && *t <= end + least + near;
        let kept: Vec<usize> = (0..channel.times.len())
            .filter(|i| stays(&channel.times[*i]))
            .collect();
        if kept.len() < Grid::FEWEST_NODES {
            return Err((entry.at)
                .error_in("sensors", "the delays leave too few samples")
                .found(format!(
                    "{} of {} samples of the {} within the record for delays from {} to {} s",
                    kept.len(),
                    channel.times.len(),
                    channel.kind.name(),
                    significant(least, 4),
                    significant(most, 4)
                ))
                .expected("closer limits: `delay: {min: …, max: …}`"));
        }
        channel.keep(&kept, shift);
    }
    Ok(())
}

fn state(entry: &Entry<'_>, channel: &str, seconds: f64, notes: &mut RecordNotes) {
    let text = format!(
        "times of the {channel} shifted by its delay of {} s",
        time(seconds)
    );
    let found = json!({"channel": channel, "seconds": seconds, "action": "shifted"});
    notes.state(&entry.name(), Finding::having("delay", text, found));
}

impl super::RawChannel {
    /// Keeps some samples, and subtracts `shift` (s) from their times.
    fn keep(&mut self, kept: &[usize], shift: f64) {
        let dropped = self.times.len() - kept.len();
        let pick = |list: &[f64]| -> Vec<f64> { kept.iter().map(|i| list[*i]).collect() };
        self.times = Arc::new(kept.iter().map(|i| self.times[*i] - shift).collect());
        self.values = Arc::new(pick(&self.values));
        if let Some(Weighting::Sigmas(sigmas)) = &mut self.weighting {
            *sigmas = pick(sigmas);
        }
        if dropped > 0 {
            let reason = "within the delay of an end of the record";
            self.ignored.push((dropped, reason.to_owned()));
        }
    }
}

/// Limits of the estimated delays of a model, by the names of their parameters.
pub fn limits(entry: &Entry<'_>, record: &RawRecord) -> Result<Vec<DelayLimits>, InputError> {
    let name = entry.name();
    let of = |delay: Delay, channel: &str| match delay {
        Delay::Known(_) => None,
        Delay::Estimated { range, .. } => Some(DelayLimits {
            parameter: format!("delay of the {channel} of {name}"),
            range,
        }),
    };
    let spec = entry.spec;
    let input = match input_sensor(spec) {
        Some(("force", _)) => "force",
        _ => "base motion",
    };
    let mut found = Vec::new();
    found.extend(of(of_input(entry, record.spacing())?, input));
    for channel in &record.channels {
        let delay = of_channel(entry, channel.kind, channel.median_spacing)?;
        found.extend(of(delay, channel.kind.name()));
    }
    Ok(found)
}
