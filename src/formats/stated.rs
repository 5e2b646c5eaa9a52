//! What attributes, properties and single numbers beside the samples state, by their names: the one table of these names.

use std::collections::BTreeSet;

use super::{Channel, Sampling, last_part};
use crate::quantity_names::quantity_of;
use crate::units::{Quantity, Unit};

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

/// Units of a rate, and their factors to Hz.
const RATES: [(&str, f64); 8] = [
    ("", 1.0),
    ("Hz", 1.0),
    ("hz", 1.0),
    ("1/s", 1.0),
    ("S/s", 1.0),
    ("sps", 1.0),
    ("kHz", 1e3),
    ("MHz", 1e6),
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
        let (first, unit) = value.trim().split_once(' ').unwrap_or((value.trim(), ""));
        let number: Option<f64> = first.parse().ok();
        let meaning = meaning(name);
        let factor = match meaning {
            Some(Meaning::Rate) => RATES
                .iter()
                .find(|(symbol, _)| *symbol == unit.trim())
                .map(|(_, factor)| *factor),
            Some(Meaning::Interval | Meaning::Start) if !unit.is_empty() => {
                Unit::recognise(Quantity::Time, unit).map(|unit| unit.factor())
            }
            _ => Some(1.0),
        };
        let Some(factor) = factor else {
            // A rate or time in a unit that is not known.
            if number.is_some() {
                self.unapplied.push(format!("{name} = {value}"));
            }
            return;
        };
        let number = number.map(|number| factor * number);
        let positive = number.filter(|x| x.is_finite() && *x > 0.0);
        match (meaning, positive) {
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
    let increases = |c: &&Channel| c.values.windows(2).all(|pair| pair[1] > pair[0]);
    let timed: BTreeSet<usize> = channels
        .iter()
        .filter(|c| is_time(c) && increases(c))
        .map(|c| c.values.len())
        .collect();
    let all: Vec<(String, String, Sampling)> = channels.iter().filter_map(stated).collect();
    let mut used: Option<String> = None;
    for channel in channels.iter_mut().filter(|c| c.values.len() > 1) {
        let near = all
            .iter()
            .filter(|(group, ..)| channel.name.starts_with(group));
        let near = near.max_by_key(|(group, ..)| group.len());
        let sampling = channel.sampling.or(near.map(|(.., sampling)| *sampling));
        // Times in the file take precedence.
        if timed.contains(&channel.values.len()) {
            channel.stated_step = sampling.map(Sampling::step);
            channel.sampling = None;
        } else if channel.sampling.is_none()
            && let Some((_, name, sampling)) = near
        {
            channel.sampling = Some(*sampling);
            used.get_or_insert_with(|| name.clone());
        }
    }
    let name = used?;
    Some(format!("sampling rate from `{name}`"))
}

/// Common part of channels with the same step: they are cut to it, and each keeps the rest of a step by which it is later. Returns a note.
pub(super) fn align(channels: &mut [Channel]) -> Option<String> {
    let axis = |channel: &Channel| match channel.sampling {
        Some(Sampling::Interval { start, step }) => Some((start, step, channel.values.len())),
        _ => None,
    };
    let axes: Vec<(f64, f64, usize)> = channels.iter().filter_map(axis).collect();
    let (first, step, _) = *axes.first()?;
    let from = axes.iter().fold(first, |most, axis| most.max(axis.0));
    let lag = |start: f64| ((from - start) / step).round();
    let has_step = |axis: &(f64, f64, usize)| (axis.1 / step - 1.0).abs() < 1e-9 && axis.2 > 1;
    let left = |axis: &(f64, f64, usize)| axis.2 as f64 - lag(axis.0);
    let count = axes.iter().map(left).fold(f64::INFINITY, f64::min);
    let shortest = axes.iter().map(|axis| axis.2).min()? as f64;
    if axes.iter().all(|axis| axis.0 == first)
        || !axes.iter().all(has_step)
        || count < 0.5 * shortest
    {
        return None;
    }
    let mut are_late = false;
    for channel in channels.iter_mut() {
        let Some((start, ..)) = axis(channel) else {
            continue;
        };
        let late = start + lag(start) * step - from;
        if late.abs() > ALIGNED * step {
            channel.late = late;
            are_late = true;
        }
        channel.values.drain(..lag(start) as usize);
        channel.values.truncate(count as usize);
        channel.sampling = Sampling::interval(from, step);
    }
    let span = axes
        .iter()
        .fold(0.0f64, |most, axis| most.max(from - axis.0));
    Some(format!(
        "the channels start up to {} s apart: the {count} samples at common times are used{}",
        crate::number_format::significant(span, 4),
        if are_late {
            ", to a fraction of a step that each channel keeps"
        } else {
            ""
        }
    ))
}

/// Deviation from whole steps by the rounding of times.
const ALIGNED: f64 = 1e-5;

/// Sampling interval, s, that a line before a table states, or with the next one: `Sampling rate: 500 Hz`, `dt:`.
pub(crate) fn step_of_line(line: &str, next: Option<&&str>) -> Option<f64> {
    let is_sign = |c: char| c.is_whitespace() || "#;%\",[]()".contains(c);
    let line = line.trim_matches(is_sign);
    let (name, value) = match line.split_once([':', '=', '\t', ';', ',']) {
        Some((name, "")) => (name, next?.split('\t').next()?),
        found => found?,
    };
    let (name, unit) = name.split_once(['(', '[']).unwrap_or((name, ""));
    let value = value.trim_start_matches(is_sign);
    let end = value.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c)));
    let (number, behind) = value.split_at(end.unwrap_or(value.len()));
    let unit = [unit, behind].map(|text| text.split(is_sign).find(|word| !word.is_empty()));
    let mut stated = Stated::default();
    let unit = unit.into_iter().flatten().next().unwrap_or_default();
    stated.add(name, &format!("{number} {unit}"));
    stated.step
}

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
        // Records one after the other, and a fraction of a step.
        all[1].sampling = Sampling::interval(9.0, 0.5);
        assert_eq!(align(&mut all), None);
        all[1].sampling = Sampling::interval(2.2, 0.5);
        assert!(align(&mut all).is_some());
        assert!((all[0].late + 0.2).abs() < 1e-12 && all[1].late == 0.0);
    }

    #[test]
    fn rates_and_steps_have_units() {
        let step = |name: &str, value: &str| {
            let mut stated = Stated::default();
            stated.add(name, value);
            (stated.step, stated.unapplied.len())
        };
        assert_eq!(step("fs", "2 kHz"), (Some(5e-4), 0));
        assert_eq!(step("sample rate", "500"), (Some(2e-3), 0));
        assert_eq!(step("dt", "0.5 ms"), (Some(5e-4), 0));
        assert_eq!(step("fs", "30 per minute"), (None, 1));
        assert_eq!(step("t0", "2024-01-10 10:00"), (None, 0));
        assert_eq!(step("_FillValue", "NaN"), (None, 0));
    }

    #[test]
    fn lines_state_rates() {
        for (line, step) in [
            ("Sampling rate: 500 Hz", 0.002),
            ("# fs = 500", 0.002),
            ("SAMPLING_RATE;500Hz", 0.002),
            (";SampleRate, 500,Hz", 0.002),
            ("Sample interval (ms)\t2.0", 0.002),
            ("Sampling frequency [kHz]: 0.5", 0.002),
            ("dt:\t", 0.002),
        ] {
            assert_eq!(
                step_of_line(line, Some(&"0.002\t0.002")),
                Some(step),
                "{line}"
            );
        }
        for line in ["time,acc", "Sampling rate: fast", "Rate: 1,000 Hz", ""] {
            assert_eq!(step_of_line(line, None), None, "{line}");
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
