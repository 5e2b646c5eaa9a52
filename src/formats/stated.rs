//! What attributes, properties and single numbers beside the samples state, by their names: the one table of these names.

use std::collections::BTreeSet;

use super::{Channel, Sampling, last_part};
use crate::quantity_names::quantity_of;
use crate::units::Quantity;

/// Meaning of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Sampling rate, Hz.
    Rate,
    /// Sampling interval, s.
    Interval,
    /// Time of the first sample, s.
    Start,
    Unit,
    /// Factor of counts, and what is added to their product.
    Factor,
    Offset,
    /// A scale that no convention defines: it is named, and not applied.
    Unapplied,
}

/// Names in small letters and without signs.
const NAMES: [(Meaning, &str); 7] = [
    (
        Meaning::Rate,
        "fs sr rate samplerate samplingrate samplefrequency samplingfrequency samplefreq samplingfreq \
         sampfreq actualrate fsamp sps samplespersecond sampleratehz samplingratehz fshz",
    ),
    (
        Meaning::Interval,
        "dt ts deltat deltax samplinginterval sampleinterval samplingperiod sampleperiod wfincrement \
         increment xincrement timestep dts",
    ),
    (
        Meaning::Start,
        "t0 x0 wfstartoffset startoffset tstart timeoffset",
    ),
    (
        Meaning::Unit,
        "unit units unitstring yunit yunits yunitlabel unitdescription engineeringunit engineeringunits \
         engunits eu uom unitofmeasure unitsymbol physicalunit",
    ),
    (Meaning::Factor, "scalefactor"),
    (Meaning::Offset, "addoffset"),
    (
        Meaning::Unapplied,
        "gain sensitivity calibration calibrationfactor calfactor cal scale scaling slope multiplier \
         offset zerooffset intercept conversionfactor convfactor calibrationoffset starttime fullscale",
    ),
];

/// The meaning of a name, if any.
pub(super) fn meaning(name: &str) -> Option<Meaning> {
    let letters = name.chars().filter(char::is_ascii_alphanumeric);
    let small: String = letters.map(|c| c.to_ascii_lowercase()).collect();
    let found = NAMES
        .iter()
        .find(|(_, names)| names.split(' ').any(|name| name == small));
    found.map(|(meaning, _)| *meaning)
}

/// What the attributes of samples state.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stated {
    step: Option<f64>,
    start: f64,
    /// Statements that are not applied: name and value.
    pub unapplied: Vec<String>,
}

impl Stated {
    /// Adds an attribute with its value as text; those of unknown names state nothing, and those that are applied elsewhere are left to it.
    pub fn add(&mut self, name: &str, value: &str) {
        let number = value
            .split_whitespace()
            .next()
            .and_then(|first| first.parse().ok());
        let positive = number.filter(|x: &f64| x.is_finite() && *x > 0.0);
        match (meaning(name), positive) {
            (Some(Meaning::Rate), Some(rate)) => self.step = Some(1.0 / rate),
            (Some(Meaning::Interval), Some(step)) => self.step = Some(step),
            (Some(Meaning::Start), _) => self.start = number.unwrap_or(0.0),
            (Some(Meaning::Unapplied), _) if number.is_some() && !is_neutral(name, number) => {
                self.unapplied.push(format!("{name} = {value}"));
            }
            _ => {}
        }
    }

    /// Times of the samples.
    pub fn sampling(&self) -> Option<Sampling> {
        Sampling::interval(self.start, self.step?)
    }
}

/// True for a factor of 1 and an offset of 0.
fn is_neutral(name: &str, value: Option<f64>) -> bool {
    let small = name.to_ascii_lowercase();
    let is_offset = ["offset", "intercept"]
        .iter()
        .any(|word| small.contains(word));
    small.contains("time") || value == Some(if is_offset { 0.0 } else { 1.0 })
}

/// Gives channels without times those that a single number beside them states: `fs`, `dt`, the nearest in the path. Returns a note.
pub(super) fn times_of_numbers(channels: &mut [Channel]) -> Option<String> {
    let group = |name: &str| match name.rsplit_once('.') {
        Some((group, _)) => format!("{group}."),
        None => String::new(),
    };
    let stated = |channel: &Channel| {
        let [value] = *channel.values else {
            return None;
        };
        let mut stated = Stated::default();
        stated.add(last_part(&channel.name), &value.to_string());
        let sampling = stated.sampling()?;
        Some((group(&channel.name), channel.name.clone(), sampling))
    };
    let is_time = |c: &&Channel| quantity_of(last_part(&c.name)) == Some(Quantity::Time);
    let timed: BTreeSet<usize> = channels
        .iter()
        .filter(is_time)
        .map(|c| c.values.len())
        .collect();
    let all: Vec<(String, String, Sampling)> = channels.iter().filter_map(stated).collect();
    let mut used: Option<String> = None;
    for channel in channels
        .iter_mut()
        .filter(|c| c.values.len() > 1 && c.sampling.is_none() && !timed.contains(&c.values.len()))
    {
        let near = all
            .iter()
            .filter(|(group, ..)| channel.name.starts_with(group));
        let Some((_, name, sampling)) = near.max_by_key(|(group, ..)| group.len()) else {
            continue;
        };
        channel.sampling = Some(*sampling);
        used.get_or_insert_with(|| name.clone());
    }
    let name = used?;
    Some(format!("sampling rate from `{name}`"))
}

/// Common part of channels with the same step whose first times differ by whole steps: they are cut to it. Returns a note.
pub(super) fn align(channels: &mut [Channel]) -> Option<String> {
    let axis = |channel: &Channel| match channel.sampling {
        Some(Sampling::Interval { start, step }) => Some((start, step, channel.values.len())),
        _ => None,
    };
    let axes: Vec<(f64, f64, usize)> = channels.iter().filter_map(axis).collect();
    let (first, step, _) = *axes.first()?;
    let end = |(start, _, count): &(f64, f64, usize)| start + step * (*count as f64 - 1.0);
    let from = axes.iter().fold(first, |most, axis| most.max(axis.0));
    let to = axes.iter().map(end).fold(f64::INFINITY, f64::min);
    let lag = |start: f64| (from - start) / step;
    let is_whole = |x: f64| (x - x.round()).abs() < ALIGNED;
    let is_common = axes
        .iter()
        .all(|axis| (axis.1 / step - 1.0).abs() < 1e-9 && axis.2 > 1 && is_whole(lag(axis.0)));
    let count = ((to - from) / step).round() + 1.0;
    let shortest = axes.iter().map(|axis| axis.2).min()? as f64;
    if axes.iter().all(|axis| axis.0 == first) || !is_common || count < 0.5 * shortest {
        return None;
    }
    for channel in channels.iter_mut() {
        let Some((start, ..)) = axis(channel) else {
            continue;
        };
        channel.values.drain(..lag(start).round() as usize);
        channel.values.truncate(count as usize);
        channel.sampling = Sampling::interval(from, step);
    }
    let span = axes
        .iter()
        .fold(0.0f64, |most, axis| most.max(from - axis.0));
    Some(format!(
        "the channels start up to {} s apart: the {count} samples at common times are used",
        crate::number_format::significant(span, 4)
    ))
}

/// Deviation from whole steps up to which samples are at the same times.
const ALIGNED: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, start: Option<f64>, values: &[f64]) -> Channel {
        Channel {
            name: name.to_owned(),
            sampling: start.and_then(|start| Sampling::interval(start, 0.5)),
            values: values.to_vec(),
            ..Channel::default()
        }
    }

    #[test]
    fn channels_are_cut_to_common_times() {
        let mut all = [
            channel("a", Some(1.0), &[1.0, 2.0, 3.0, 4.0]),
            channel("b", Some(2.0), &[5.0, 6.0, 7.0]),
        ];
        assert!(align(&mut all).is_some());
        assert_eq!(
            (&*all[0].values, &*all[1].values),
            (&[3.0, 4.0][..], &[5.0, 6.0][..])
        );
        assert_eq!(all[0].sampling, Sampling::interval(2.0, 0.5));
        // A fraction of a step, and records one after the other.
        for start in [2.2, 9.0] {
            all[1].sampling = Sampling::interval(start, 0.5);
            assert_eq!(align(&mut all), None);
        }
    }

    #[test]
    fn numbers_state_rates() {
        let mut all = [
            channel("run.acc", None, &[1.0, 2.0]),
            channel("run.ActualRate", None, &[4.0]),
            channel("dt", None, &[9.0]),
            channel("other", None, &[1.0, 2.0]),
        ];
        assert!(times_of_numbers(&mut all).is_some());
        assert_eq!(all[0].sampling, Sampling::interval(0.0, 0.25));
        assert_eq!(all[3].sampling, Sampling::interval(0.0, 9.0));
    }
}
