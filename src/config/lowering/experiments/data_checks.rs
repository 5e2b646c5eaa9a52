//! Data checks of a record.

use super::{Entry, RawChannel, RawRecord, is_equation_error, sensor_of};
use crate::config::ModelFile;
use crate::config::dominant::Oscillation;
use crate::magnitudes::{Magnitude, implausible, mains_hum};
use crate::tables::codes_of_column;
use kmcfit_core::assessment::Doubt;
use kmcfit_core::diagnostics::{detrended, outlier_indices, standard_deviation};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::model::{ExperimentSpec, InitialSpec, KnownValue, ScalarSpec};
use kmcfit_core::number_format::significant;
use kmcfit_core::record::{ChannelKind, Loss};
use kmcfit_core::signal::{
    Interpolation, Signal, Spectrum, driven_oscillator, is_kept_up, median, onset,
    two_forced_modes, two_modes,
};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::round_time;
use kmcfit_core::threads::both;
use serde_json::json;
use std::cell::OnceCell;
use std::f64::consts::{PI, TAU};

/// Factors between units that a ratio between channels, or between a sample and the given state, suggests.
const SUSPICIOUS: [(f64, &str); 8] = [
    (1e3, "the factor 1000 between m and mm"),
    (1e-3, "the factor 1/1000 between mm and m"),
    (1e6, "the factor 10^6 between m and um"),
    (1e-6, "the factor 10^-6 between um and m"),
    (1e2, "the factor 100 between m and cm"),
    (1e-2, "the factor 1/100 between cm and m"),
    (9.80665, "the factor 9.81 between g and m/s^2"),
    (1.0 / 9.80665, "the factor 1/9.81 between m/s^2 and g"),
];
/// Factors of times in minutes, of displacements and their derivatives of translations, and of angles in degrees.
const MINUTES: [(f64, &str); 4] = [
    (60.0, "the factor 60 between min and s"),
    (1.0 / 60.0, "the factor 1/60 between s and min"),
    (3600.0, "the factor 60² between min and s"),
    (1.0 / 3600.0, "the factor 1/60² between s and min"),
];
const DEGREES: [(f64, &str); 2] = [
    (180.0 / PI, "the factor 57.3 between rad and deg"),
    (PI / 180.0, "the factor 1/57.3 between deg and rad"),
];
/// Largest quotient of a ratio and such a factor: channels of one response agree within some ten per cent only, because
/// the response has more than one frequency.
const NEAR: f64 = 1.5;
/// Two channels have opposite signs if their correlation is below minus this.
const OPPOSITE: f64 = 0.7;
/// Fewest periods of the response, and fewest samples per period, for a comparison of signs: a monotone decay has an
/// acceleration of the sign of its displacement, and differences of coarse samples have any sign.
const FEWEST_PERIODS: f64 = 3.0;
const FEWEST_IN_A_PERIOD: f64 = 4.0;

/// Warnings about the record of an experiment.
pub fn of(entry: &Entry<'_>, record: &RawRecord) -> Vec<Finding> {
    let (file, spec) = (entry.at.file, entry.spec);
    let of_units = || {
        let spectra = ChannelSpectra::of(record);
        let mut warnings = unit_factors(spec, record, &spectra);
        warnings.extend(magnitudes(record, &spectra));
        warnings.extend(implied_mass(file, record));
        warnings.extend(opposite_signs(spec, record, &spectra));
        warnings
    };
    let of_motion = || {
        let mut warnings: Vec<Finding> = missing_codes(entry, record).into_iter().collect();
        if warnings.is_empty() {
            let outliers = record.channels.iter().filter_map(|c| outliers(entry, c));
            warnings.extend(outliers);
        }
        // The equation error simulates no response from an initial state.
        if !is_equation_error(file) {
            warnings.extend(rest_before_motion(spec, record));
        }
        warnings.extend(unmeasured_force(entry, record));
        warnings.extend(modes(entry, record));
        warnings.extend(excluded_frequency(file, record));
        warnings
    };
    let (mut warnings, others) = both(of_units, of_motion);
    warnings.extend(others);
    let each = warnings.into_iter();
    each.map(|warning| entry.placed(warning)).collect()
}

/// A constraint of the natural frequency that excludes the frequency of a free record.
fn excluded_frequency(file: &ModelFile, record: &RawRecord) -> Option<Finding> {
    let constraints = file.spec.constraints.iter().flatten();
    let mut ranges = constraints.filter_map(|constraint| constraint.frequency.as_ref());
    let channel = record.channels.first().filter(|_| record.is_free())?;
    let spectrum = Spectrum::of(&channel.values, channel.median_spacing)?;
    let frequency = spectrum.dominant();
    // A frequency is known to about the spacing of the spectrum.
    let error = spectrum.resolution();
    let range = ranges.find_map(|range| {
        let [min, max] = [range.min, range.max];
        let is_below = min.is_some_and(|min| frequency + error < min);
        let is_above = max.is_some_and(|max| frequency - error > max);
        (is_below || is_above).then_some([min, max])
    })?;
    let (channel, [min, max]) = (channel.kind.name(), range);
    let limits = match (min, max) {
        (Some(min), Some(max)) => format!("{min} to {max} Hz"),
        (Some(min), None) => format!("at least {min} Hz"),
        (None, max) => format!("at most {} Hz", max.unwrap_or_default()),
    };
    let text = format!(
        "the {channel} vibrates at {} Hz, which the constraint on the natural frequency ({limits}) excludes",
        significant(frequency, 3)
    );
    let found = json!({"channel": channel, "frequency": frequency, "min": min, "max": max});
    Some(Finding::having("frequency_excluded", text, found))
}

/// Spectra of the channels of a record, each computed where it is first needed.
struct ChannelSpectra<'a>(Vec<(&'a RawChannel, OnceCell<Option<Spectrum>>)>);

impl<'a> ChannelSpectra<'a> {
    fn of(record: &'a RawRecord) -> Self {
        let channels = record.channels.iter();
        Self(channels.map(|channel| (channel, OnceCell::new())).collect())
    }

    /// `None` for too few samples.
    fn at(&self, kind: ChannelKind) -> Option<&Spectrum> {
        let (channel, spectrum) = self.0.iter().find(|(channel, _)| channel.kind == kind)?;
        let of_channel = || Spectrum::of(&channel.values, channel.median_spacing);
        spectrum.get_or_init(of_channel).as_ref()
    }
}

/// Channels of one response, or a sample and the given state, that disagree by a [`SUSPICIOUS`] factor.
fn unit_factors(
    spec: &ExperimentSpec,
    record: &RawRecord,
    spectra: &ChannelSpectra,
) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut add = |ratio: f64, quantity: String| {
        if let Some(factor) = factor_near(ratio, record) {
            let times = significant(ratio, 4);
            let text =
                format!("{quantity} is {times} times its expected value, {factor}; check `units`");
            let of = json!({"quantity": quantity, "ratio": ratio, "factor": factor});
            found.push(Finding::having("suspicious_factor", text, of).rated(Severity::Check));
        }
    };
    let first = |kind: ChannelKind| record.channels.iter().find(|c| c.kind == kind);
    let displacement = first(ChannelKind::Displacement);
    if let (Some(channel), InitialSpec::Map(state)) = (displacement, &spec.initial)
        && let ScalarSpec::Known(start) = &state.displacement
        && *start != 0.0
    {
        let ratio = (channel.values[0] / start).abs();
        add(ratio, "the first displacement".to_owned());
    }
    for pair in [
        [ChannelKind::Displacement, ChannelKind::Velocity],
        [ChannelKind::Velocity, ChannelKind::Acceleration],
        [ChannelKind::Displacement, ChannelKind::Acceleration],
    ] {
        let [Some(low), Some(high)] = pair.map(first) else {
            continue;
        };
        let Some(spectrum) = spectra.at(low.kind) else {
            continue;
        };
        let omega = TAU * spectrum.dominant();
        let orders = pair[1] as i32 - pair[0] as i32;
        let ratio = standard_deviation(&high.values)
            / (omega.powi(orders) * standard_deviation(&low.values));
        if ratio.is_finite() && ratio > 0.0 {
            let [low, high] = pair.map(ChannelKind::name);
            add(ratio, format!("the {high} relative to the {low}"));
        }
    }
    found
}

/// The factor between two units that is nearest to a ratio, if one is near.
fn factor_near(ratio: f64, record: &RawRecord) -> Option<&'static str> {
    let is_angular = record.channels.iter().any(|c| c.unit.is_angular());
    let others = match is_angular {
        true => &DEGREES[..],
        false => &MINUTES[..],
    };
    let distance = |factor: f64| (ratio / factor).ln().abs();
    let near =
        (SUSPICIOUS.iter().chain(others)).filter(|(factor, _)| distance(*factor) < NEAR.ln());
    near.min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))
        .map(|(_, words)| *words)
}

/// Magnitudes outside the range of mechanical vibrations, and mains hum at a frequency that it has in another unit of time.
fn magnitudes(record: &RawRecord, spectra: &ChannelSpectra) -> Vec<Finding> {
    let Some(first) = record.channels.first() else {
        return Vec::new();
    };
    let all = record.channels.iter().filter(|c| !c.unit.is_arbitrary());
    let all: Vec<Magnitude> = all
        .filter_map(|c| Magnitude::of(c.kind.into(), c.unit, &c.values))
        .collect();
    let pairs = first
        .times
        .iter()
        .copied()
        .zip(first.values.iter().copied());
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let duration = first.span[1] - first.span[0];
    let oscillation = Oscillation::of(&pairs, first.median_spacing, duration);
    let frequencies = oscillation.frequencies();
    let found = frequencies.and_then(|both| implausible(both, first.time_unit, &all));
    if let Some(found) = found {
        let (magnitudes, reading) = (found.magnitudes, found.reading);
        let read = reading.as_ref().map(|reading| format!(": {reading}"));
        let read = read.unwrap_or_default();
        let text = format!("{magnitudes} is implausible{read}; check `units`");
        let found = json!({"magnitudes": magnitudes, "reading": reading});
        return vec![Finding::having("implausible_magnitudes", text, found).rated(Severity::Check)];
    }
    let hum = first
        .time_unit
        .and_then(|unit| mains_hum(spectra.at(first.kind)?, unit));
    let hum = hum.map(|(frequency, unit)| {
        let (channel, unit) = (first.kind.name(), unit.symbol());
        let text = format!(
            "the {channel} has a narrow line at {} Hz: mains hum, if the times are in {unit}; check `units: {{time: {unit}}}`",
            significant(frequency, 3)
        );
        let found = json!({"channel": channel, "frequency": frequency, "unit": unit});
        Finding::having("mains_hum", text, found).rated(Severity::Check)
    });
    hum.into_iter().collect()
}

/// The mass that the measured force and the first channel imply, where it differs from the stated one by the factor between two units.
fn implied_mass(file: &ModelFile, record: &RawRecord) -> Option<Finding> {
    let stated = match (file
        .spec
        .functions
        .as_ref()?
        .get(CoefficientKind::MASS)?
        .fixed)
        .as_ref()?
    {
        KnownValue::Number(number) => *number,
        KnownValue::Map(map) => map.value?,
        KnownValue::Unknown(_) | KnownValue::History(_) => return None,
    };
    let channel = record.channels.first()?;
    let spacing = channel.spacing?;
    let force = record.forces_at(&channel.times)?;
    let [implied, ..] = driven_oscillator(&force, &channel.values, spacing, channel.kind as i32)?;
    let (channel, ratio) = (channel.kind.name(), implied / stated);
    let factor = factor_near(ratio, record)?;
    let text = format!(
        "the force and the {channel} imply a mass of {} kg, {} times the stated one, {factor}; check `units` and the mass",
        significant(implied, 3),
        significant(ratio, 3)
    );
    let found = json!({"channel": channel, "implied": implied, "ratio": ratio, "factor": factor});
    Some(Finding::having("suspicious_mass", text, found).rated(Severity::Check))
}

/// Pairs of channels of one response with opposite signs.
fn opposite_signs(
    spec: &ExperimentSpec,
    record: &RawRecord,
    spectra: &ChannelSpectra,
) -> Vec<Finding> {
    let channels = &record.channels;
    let pairs = (channels.iter().enumerate())
        .flat_map(|(location, high)| channels[..location].iter().map(move |low| (low, high)));
    let opposite = pairs.filter(|(low, high)| {
        let gains = gain_sign(spec, low.kind).zip(gain_sign(spec, high.kind));
        gains.is_some_and(|(one, other)| {
            let correlation = correlation_with_estimate(low, high, spectra);
            one * other * correlation.unwrap_or_default() < -OPPOSITE
        })
    });
    let warnings = opposite.map(|pair| {
        let (low, high) = (pair.0.kind.name(), pair.1.kind.name());
        let text = format!(
            "{high} and {low} have opposite signs; if the {high} is reversed, add `sensors: {{{high}: {{gain: -1}}}}`"
        );
        Finding::having("opposite_sign", text, json!({"high": high, "low": low}))
    });
    warnings.collect()
}

/// Sign of a sensor's gain; `None` if the gain is estimated.
fn gain_sign(spec: &ExperimentSpec, kind: ChannelKind) -> Option<f64> {
    match sensor_of(spec, kind).and_then(|sensor| sensor.gain.as_ref()) {
        None => Some(1.0),
        Some(ScalarSpec::Known(gain)) => Some(gain.signum()),
        Some(_) => None,
    }
}

/// Correlation of the samples of `high` with their estimate from `low`: its slope, or for an acceleration and a
/// displacement the negative displacement, as for a harmonic response. `None` for too few periods or samples.
fn correlation_with_estimate(
    low: &RawChannel,
    high: &RawChannel,
    spectra: &ChannelSpectra,
) -> Option<f64> {
    let frequency = spectra.at(high.kind)?.dominant();
    let duration = high.times[high.times.len() - 1] - high.times[0];
    if frequency * duration < FEWEST_PERIODS
        || frequency * low.median_spacing * FEWEST_IN_A_PERIOD > 1.0
    {
        return None;
    }
    let values = Signal::new(
        high.times.to_vec(),
        high.values.to_vec(),
        Interpolation::Linear,
    )?;
    let around = low.times.windows(3).zip(low.values.windows(3));
    let inside = around.filter(|(t, _)| values.covers(t[1], t[1]));
    let (mut times, mut estimated, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    for (t, y) in inside {
        times.push(t[1]);
        measured.push(values.value(t[1]));
        estimated.push(match high.kind as i32 - low.kind as i32 {
            1 => (y[2] - y[0]) / (t[2] - t[0]),
            _ => -y[1],
        });
    }
    // Sensors drift.
    let [estimated, measured] = [estimated, measured].map(|values| detrended(&times, &values));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let correlation = product(&estimated, &measured)
        / (product(&estimated, &estimated) * product(&measured, &measured)).sqrt();
    correlation.is_finite().then_some(correlation)
}

/// A record without an input that a random force keeps up.
fn unmeasured_force(entry: &Entry<'_>, record: &RawRecord) -> Option<Finding> {
    let mut channels = record.channels.iter();
    let is_affected = |c: &&RawChannel| c.spacing.is_some_and(|s| is_kept_up(&c.values, s));
    let found = channels.find(|c| !has_input(entry.spec, record) && is_affected(c))?;
    let doubt = Doubt::KeptUp {
        experiment: entry.name(),
        channel: found.kind.name().to_owned(),
    };
    Some(doubt.into())
}

/// Codes for missing samples, which no statement of the model takes as such.
fn missing_codes(entry: &Entry<'_>, record: &RawRecord) -> Option<Finding> {
    let (mut channels, mut codes): (Vec<String>, Vec<f64>) = Default::default();
    for channel in record.channels.iter().filter(|c| c.loss == Loss::Squares) {
        // Digits of the file, without the rounding of the conversion to SI.
        let in_file = |x: &f64| significant(x / channel.unit.factor(), 12).parse();
        let values: Vec<f64> = (channel.values.iter())
            .filter_map(|x| in_file(x).ok())
            .collect();
        let found = codes_of_column(&values, false);
        if !found.is_empty() {
            channels.push(channel.kind.name().to_owned());
        }
        codes.extend(found.iter().map(|(code, _)| *code));
    }
    codes.sort_by(f64::total_cmp);
    codes.dedup();
    (!codes.is_empty()).then(|| {
        Finding::from(Doubt::MissingCodes {
            experiment: entry.name(),
            channels,
            codes,
        })
    })
}

/// A free record, or one with a measured force, in which two modes vibrate.
fn modes(entry: &Entry<'_>, record: &RawRecord) -> Option<Finding> {
    let spec = entry.spec;
    let of_channel = |c: &RawChannel| {
        if !has_input(spec, record) {
            return two_modes(&c.values, c.median_spacing);
        }
        let force = record.forces_at(&c.times)?;
        two_forced_modes(&force, &c.values, c.median_spacing, c.kind as i32)
    };
    let each = record.channels.iter().filter(|c| c.spacing.is_some());
    let mut found = each.filter_map(|c| Some((c, of_channel(c)?)));
    let (channel, frequencies) = found.next()?;
    let (channel, [first, second]) = (channel.kind.name(), frequencies);
    let text = format!(
        "two modes vibrate in the {channel}, at {} and {} Hz; the model has one; keep one by `band`, or measure at a node of the \
         other",
        significant(first, 3),
        significant(second, 3)
    );
    let found = json!({"channel": channel, "frequencies": frequencies});
    let finding = Finding::having("two_modes", text, found);
    Some(finding.about(Doubt::SecondMode {
        experiment: entry.name(),
        frequencies,
    }))
}

fn has_input(spec: &ExperimentSpec, record: &RawRecord) -> bool {
    !record.is_free() || spec.force.is_some() || spec.base.is_some()
}

/// A free record that begins at rest, before the release or the impact.
fn rest_before_motion(spec: &ExperimentSpec, record: &RawRecord) -> Option<Finding> {
    if has_input(spec, record) {
        return None;
    }
    let mut channels = record.channels.iter();
    let (channel, first) = channels.find_map(|c| Some((c, onset(&c.values, c.median_spacing)?)))?;
    let (start, channel) = (in_file(spec, channel, first), channel.kind.name());
    let text = format!(
        "the {channel} is at rest before {start} s; a free decay must begin after the release or impact: `window: {{min: \
         {start}}}`"
    );
    let found = json!({"channel": channel, "start": start});
    Some(Finding::having("at_rest", text, found))
}

/// Time of a sample on the time axis of its file, s.
fn in_file(spec: &ExperimentSpec, channel: &RawChannel, sample: usize) -> f64 {
    let zero = spec.time_zero.unwrap_or(0.0);
    round_time(channel.times[sample] + zero, channel.median_spacing)
}

/// Outliers of a channel with a quadratic loss.
fn outliers(entry: &Entry<'_>, channel: &RawChannel) -> Option<Finding> {
    if channel.loss != Loss::Squares {
        return None;
    }
    let level = median(channel.values.as_slice());
    let away: Vec<f64> = channel.values.iter().map(|value| value - level).collect();
    let far = outlier_indices(&away);
    let first = *far.first()?;
    let (kind, samples, unit) = (channel.kind.name(), far.len(), channel.unit.symbol());
    let value = channel.values[first] / channel.unit.factor();
    let time = in_file(entry.spec, channel, first);
    let [end, them] = if samples == 1 {
        ["", "it"]
    } else {
        ["s", "them"]
    };
    let with_sigma = match channel.weighting {
        Some(_) => "",
        None => ", with `sigma`",
    };
    let text = format!(
        "{samples} outlier{end} in the {kind}, the first {} {unit} at {time} s; delete {them} (empty fields) or use a \
         robust loss (`loss: {{{kind}: huber}}`{with_sigma})",
        significant(value, 4),
    );
    let found = json!({
        "channel": kind,
        "samples": samples,
        "first_value": value,
        "first_time": time,
        "unit": unit
    });
    let doubt = Doubt::Outliers {
        experiment: entry.name(),
        channel: kind.to_owned(),
    };
    let finding = Finding::having("outliers", text, found);
    Some(finding.about(doubt))
}
