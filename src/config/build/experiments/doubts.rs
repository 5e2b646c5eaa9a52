//! Data checks of a record.

use super::{RawChannel, Record, is_equation_error};
use crate::config::ModelFile;
use crate::config::scalar::{NumberOrEstimate, ScalarOr};
use crate::config::spec::{ExperimentSpec, InitialSpec};
use crate::digits::significant;
use kmcfit_core::internals::diagnostics::{far_off, spread, without_line};
use kmcfit_core::internals::record::ChannelKind;
use kmcfit_core::internals::signal::{Interpolation, Signal, Spectrum, clipped, onset};
use kmcfit_core::internals::system::round_time;
use std::f64::consts::TAU;

/// Factors between channels, or between a reading and a known state, that look like a wrong unit.
const SUSPICIOUS: [(f64, &str); 8] = [
    (1e3, "a factor of 1000, as between m and mm"),
    (1e-3, "a factor of 1/1000, as between mm and m"),
    (1e6, "a factor of 10^6, as between m and um"),
    (1e-6, "a factor of 10^-6, as between um and m"),
    (1e2, "a factor of 100, as between m and cm"),
    (1e-2, "a factor of 1/100, as between cm and m"),
    (9.80665, "a factor of 9.81, as between g and m/s^2"),
    (1.0 / 9.80665, "a factor of 1/9.81, as between m/s^2 and g"),
];
/// How near a ratio must be to such a factor, as a ratio of the two: channels of one motion agree
/// within some ten per cent, for its frequency is not single.
const NEAR: f64 = 1.5;
/// Channels whose correlation is below minus this go against each other: noise brings it nearer to zero, no swing
/// turns it.
const AGAINST: f64 = 0.7;
/// Fewest periods of a swing, and fewest readings in one of them: what only falls has an acceleration of the sign of the
/// displacement, and slopes between readings that are too far apart have any.
const FEWEST_PERIODS: f64 = 3.0;
const FEWEST_IN_A_PERIOD: f64 = 4.0;

/// Everything that looks wrong in the record of experiment `i`.
pub fn of(file: &ModelFile, i: usize, spec: &ExperimentSpec, record: &Record) -> Vec<String> {
    let mut doubts = sizes(spec, record);
    doubts.extend(signs(spec, record));
    doubts.extend(record.channels.iter().filter_map(range));
    doubts.extend(record.channels.iter().filter_map(|c| outliers(spec, c)));
    // The equation error asks for no motion from a start.
    if !is_equation_error(file) {
        doubts.extend(stillness(spec, record));
    }
    let name = file.experiment_name(i);
    let placed = |doubt| format!("experiments[{i}] ({name}): {doubt}");
    doubts.into_iter().map(placed).collect()
}

/// Channels of one motion, or a reading and the known state, that disagree by a factor that looks like a wrong unit.
fn sizes(spec: &ExperimentSpec, record: &Record) -> Vec<String> {
    let mut found = Vec::new();
    let mut say = |ratio: f64, what: String| {
        let near = |f: f64| ratio / f < NEAR && f / ratio < NEAR;
        if let Some((_, factor)) = SUSPICIOUS.iter().find(|(f, _)| near(*f)) {
            found.push(format!(
                "{what} {ratio:.3e} times what it should be: {factor}? `units` converts"
            ));
        }
    };
    let first = |kind: ChannelKind| record.channels.iter().find(|c| c.kind == kind);
    let displacement = first(ChannelKind::Displacement);
    if let (Some(channel), InitialSpec::Map(state)) = (displacement, &spec.initial)
        && let ScalarOr::Scalar(NumberOrEstimate::Number(start)) = &state.displacement
        && start.0 != 0.0
    {
        say(
            (channel.values[0] / start.0).abs(),
            "the first displacement is".to_owned(),
        );
    }
    for pair in [
        [ChannelKind::Displacement, ChannelKind::Velocity],
        [ChannelKind::Velocity, ChannelKind::Acceleration],
        [ChannelKind::Displacement, ChannelKind::Acceleration],
    ] {
        let [Some(low), Some(high)] = pair.map(first) else {
            continue;
        };
        let Some(spectrum) = Spectrum::of(&low.values, low.median_spacing) else {
            continue;
        };
        let omega = TAU * spectrum.dominant();
        let orders = pair[1] as i32 - pair[0] as i32;
        let ratio = spread(&high.values) / (omega.powi(orders) * spread(&low.values));
        if ratio.is_finite() && ratio > 0.0 {
            let [low, high] = pair.map(ChannelKind::name);
            say(ratio, format!("the {high} beside the {low} is"));
        }
    }
    found
}

/// Channels of one motion that swing against each other, as where one of them has the wrong sign.
fn signs(spec: &ExperimentSpec, record: &Record) -> Vec<String> {
    let channels = &record.channels;
    let pairs = (channels.iter().enumerate())
        .flat_map(|(place, high)| channels[..place].iter().map(move |low| (low, high)));
    let against = pairs.filter(|(low, high)| {
        let turned = turn(spec, low.kind).zip(turn(spec, high.kind));
        turned.is_some_and(|(one, other)| {
            one * other * together(low, high).unwrap_or_default() < -AGAINST
        })
    });
    let said = against.map(|(low, high)| {
        let [low, high] = [low, high].map(|c| c.kind.name());
        format!(
            "the {high} goes against what the {low} says of it, as if one of them had the wrong sign: \
             `sensors: {{{high}: {{gain: -1}}}}` turns the {high}"
        )
    });
    said.collect()
}

/// The sign of a sensor's gain; `None` where that is sought.
fn turn(spec: &ExperimentSpec, kind: ChannelKind) -> Option<f64> {
    let sensors = spec.sensors.as_ref();
    let sensor = sensors.and_then(|sensors| match kind {
        ChannelKind::Displacement => sensors.displacement.as_ref(),
        ChannelKind::Velocity => sensors.velocity.as_ref(),
        ChannelKind::Acceleration => sensors.acceleration.as_ref(),
    });
    match sensor.and_then(|sensor| sensor.gain.as_ref()) {
        None => Some(1.0),
        Some(ScalarOr::Scalar(NumberOrEstimate::Number(gain))) => Some(gain.0.signum()),
        Some(_) => None,
    }
}

/// The correlation of the readings of a channel with what a lower derivative of the motion says of them: its own slope, or
/// for the acceleration beside the displacement the displacement turned, as both are those of a swing.
fn together(low: &RawChannel, high: &RawChannel) -> Option<f64> {
    let frequency = Spectrum::of(&high.values, high.median_spacing)?.dominant();
    let duration = high.times[high.times.len() - 1] - high.times[0];
    if frequency * duration < FEWEST_PERIODS
        || frequency * low.median_spacing * FEWEST_IN_A_PERIOD > 1.0
    {
        return None;
    }
    let values = Signal::new(
        high.times.clone(),
        high.values.clone(),
        Interpolation::Linear,
    )?;
    let around = low.times.windows(3).zip(low.values.windows(3));
    let inside = around.filter(|(t, _)| values.covers(t[1], t[1]));
    let (mut times, mut said, mut read) = (Vec::new(), Vec::new(), Vec::new());
    for (t, y) in inside {
        times.push(t[1]);
        read.push(values.value(t[1]));
        said.push(match high.kind as i32 - low.kind as i32 {
            1 => (y[2] - y[0]) / (t[2] - t[0]),
            _ => -y[1],
        });
    }
    // Sensors drift.
    let [said, read] = [said, read].map(|values| without_line(&times, &values));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let correlation =
        product(&said, &read) / (product(&said, &said) * product(&read, &read)).sqrt();
    correlation.is_finite().then_some(correlation)
}

/// A record without a drive that stands still before its motion begins: a free motion begins where nothing holds the device
/// any more, or when it has been struck.
fn stillness(spec: &ExperimentSpec, record: &Record) -> Option<String> {
    if !record.excitation.is_empty() || spec.force.is_some() || spec.base.is_some() {
        return None;
    }
    let mut channels = record.channels.iter();
    let (channel, first) = channels.find_map(|c| Some((c, onset(&c.values, c.median_spacing)?)))?;
    let from = in_file(spec, channel, first);
    Some(format!(
        "the {} stands still before {from} s: a free motion begins where nothing holds or strikes the device any more: \
         `window: {{min: {from}}}`",
        channel.kind.name(),
    ))
}

/// The time of a reading, s, as its file counts.
fn in_file(spec: &ExperimentSpec, channel: &RawChannel, reading: usize) -> f64 {
    let zero = spec.time_zero.as_ref().map_or(0.0, |zero| zero.0);
    round_time(channel.times[reading] + zero, channel.median_spacing)
}

/// Single readings that lie far off the others, where their squares count in full.
fn outliers(spec: &ExperimentSpec, channel: &RawChannel) -> Option<String> {
    if !channel.is_squared() {
        return None;
    }
    let mut sorted = channel.values.clone();
    sorted.sort_by(f64::total_cmp);
    let level = sorted[sorted.len() / 2];
    let away: Vec<f64> = channel.values.iter().map(|value| value - level).collect();
    let far = far_off(&away);
    let first = *far.first()?;
    let kind = channel.kind.name();
    let lie = match far.len() {
        1 => format!("one reading of the {kind} lies far off,"),
        many => format!("{many} readings of the {kind} lie far off, the first"),
    };
    let sigma = match channel.weighting {
        Some(_) => "",
        None => ", with `sigma`",
    };
    Some(format!(
        "{lie} {} {} at {} s: better left out (empty fields), or counted little (`loss: {{{kind}: huber}}`{sigma})",
        significant(channel.values[first] / channel.unit.factor(), 4),
        channel.unit.symbol(),
        in_file(spec, channel, first),
    ))
}

/// Readings that pile up at one value, as where a motion goes beyond the range of its sensor.
fn range(channel: &RawChannel) -> Option<String> {
    let (readings, level) = clipped(&channel.values)?;
    Some(format!(
        "{readings} readings of the {} lie at {} {}, the end of its range: if the sensor reads no further, the motion was \
         cut off there, and these readings are better left out (empty fields)",
        channel.kind.name(),
        level / channel.unit.factor(),
        channel.unit.symbol(),
    ))
}
