//! Text files of LabVIEW: measurement files (LVM).
//!
//! A header of the file, then for each segment a header with the units and first times of the channels and rows of numbers. Reference:
//! National Instruments, "Specification for the LabVIEW Measurement File".

use std::collections::BTreeMap;
use std::path::Path;

use super::Channels;
use super::budget::Budget;
use super::clocks::sampling_of;
use crate::error::InputError;
use crate::text_io::quote;

/// First line of a file.
pub(super) const MAGIC: &[u8] = b"LabVIEW Measurement";
const END: &str = "***End_of_Header***";

/// Columns of times.
#[derive(Clone, Copy, PartialEq)]
enum Times {
    /// None: first times and intervals stand in the header.
    None,
    /// One for all channels.
    One,
    /// One before each channel.
    Multi,
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().enumerate();
    let mut file = BTreeMap::new();
    let delimiter = if text.contains("Separator,Comma") {
        ','
    } else {
        '\t'
    };
    let fields = |line: &str| -> Vec<String> {
        line.split(delimiter).map(|f| f.trim().to_owned()).collect()
    };
    let mut channels = Channels::default();
    header(&mut lines, &fields, &mut file);
    let times = match file
        .get("X_Columns")
        .and_then(|value| value.first())
        .map(String::as_str)
    {
        Some("One") => Times::One,
        Some("Multi") => Times::Multi,
        _ => Times::None,
    };
    let decimal = file
        .get("Decimal_Separator")
        .and_then(|value| value.first())
        .cloned();
    let number = |text: &str| -> Option<f64> {
        match decimal.as_deref() {
            Some(",") => text.replace(',', ".").parse().ok(),
            _ => text.parse().ok(),
        }
    };
    loop {
        let mut stated = BTreeMap::new();
        header(&mut lines, &fields, &mut stated);
        let Some((_, names)) = lines.next() else {
            break;
        };
        // `Comment` is the last column, which rows may omit.
        let names: Vec<String> = fields(names)
            .into_iter()
            .filter(|name| name != "Comment")
            .collect();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        for (i, line) in lines.by_ref() {
            if line.trim().is_empty() {
                break;
            }
            let fields = fields(line);
            for (column, own) in columns.iter_mut().enumerate() {
                let text = fields.get(column).map_or("", String::as_str);
                match number(text) {
                    Some(value) => own.push(value),
                    // A missing sample, or the end of a shorter channel.
                    None if text.is_empty() => own.push(f64::NAN),
                    None => {
                        let name = names.get(column).map_or("", String::as_str);
                        return Err(InputError::line(path, i + 1, 1, "not a number")
                            .found(quote(text))
                            .expected(format!("a number of {}", quote(name))));
                    }
                }
            }
        }
        segment(times, &names, columns, &stated, &mut channels, budget)?;
    }
    Ok(channels)
}

/// Adds the keys of a header to `found`, up to its end, each with its values.
fn header<'a>(
    lines: &mut impl Iterator<Item = (usize, &'a str)>,
    fields: &impl Fn(&str) -> Vec<String>,
    found: &mut BTreeMap<String, Vec<String>>,
) {
    for (_, line) in lines {
        if line.trim_end().starts_with(END) {
            break;
        }
        let mut values = fields(line).into_iter();
        found.extend(values.next().map(|key| (key, values.collect())));
    }
}

/// Adds the channels of a segment.
fn segment(
    times: Times,
    names: &[String],
    columns: Vec<Vec<f64>>,
    stated: &BTreeMap<String, Vec<String>>,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let (mut channel, mut own) = (0, None);
    for (i, mut values) in columns.into_iter().enumerate() {
        let last = values.iter().rposition(|x| !x.is_nan());
        values.truncate(last.map_or(0, |last| last + 1));
        let is_time = match times {
            Times::None | Times::One => i == 0,
            Times::Multi => i % 2 == 0,
        };
        if values.is_empty() {
            continue;
        }
        budget.grow(&mut Vec::new(), values.len())?;
        if is_time && times != Times::None {
            // One rate for each channel where they have times of their own.
            let unit = stated
                .get("X_Unit_Label")
                .and_then(|units| units.get(channel));
            let unit = unit
                .filter(|unit| !unit.is_empty())
                .map_or("s", String::as_str);
            own = (times == Times::Multi)
                .then(|| sampling_of(&values, unit))
                .flatten();
            if own.is_none() {
                channels.push("time", Some(unit.to_owned()), None, values);
            }
            continue;
        }
        let name = names.get(i).filter(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("channel {}", channel + 1), String::clone);
        budget.name(&name)?;
        let from = channels.channels.len();
        channels.push(&name, None, own, values);
        for (key, of_channels) in stated
            .iter()
            .filter(|(key, _)| times == Times::None || key.as_str() == "Y_Unit_Label")
        {
            // The times of day of the first samples.
            let key = if key == "Time" { "start_time" } else { key };
            let text = of_channels.get(channel).filter(|text| !text.is_empty());
            let text = text.map(|text| {
                if key.starts_with("start") {
                    text.clone()
                } else {
                    text.replace(',', ".")
                }
            });
            channels.state(from, key, text.into_iter().collect());
        }
        channel += 1;
    }
    Ok(())
}
