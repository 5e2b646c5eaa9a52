//! Text with one series in rows of several numbers, whose header states length and rate: PEER (AT2), COSMOS, SLIST, K-NET.

use std::path::Path;

use super::budget::Budget;
use super::{Channels, Sampling};
use crate::error::InputError;
use crate::quantity_names::quantity_of;
use crate::text_io::quote;
use crate::units::{Measurand, Unit};

/// Length of the examined beginning of a file, bytes.
const BEGINNING: usize = 1 << 14;
/// Line of K-NET with the sampling rate, that with the scale, and the last of the header.
const KNET: [&str; 3] = ["Sampling Freq", "Scale Factor", "Memo."];

/// What a line of a header states of the series after it.
#[derive(Debug, Clone, PartialEq)]
struct Head {
    /// Number of samples; `None` for all that follow.
    count: Option<usize>,
    /// Sampling interval, s.
    step: f64,
}

/// Length and interval stated in a line: `NPTS= 600, DT= .005 SEC`, `600 .005 NPTS, DT`, `600 points … at .005 sec`, `600 samples, 40 sps`.
fn head(line: &str) -> Option<Head> {
    let small = line.to_lowercase();
    let is_sign = |c: char| c.is_whitespace() || ",=:;()".contains(c);
    let words: Vec<&str> = small
        .split(is_sign)
        .filter(|word| !word.is_empty())
        .collect();
    let number = |i: usize| {
        words
            .get(i)?
            .parse::<f64>()
            .ok()
            .filter(|x| x.is_finite() && *x > 0.0)
    };
    let location = |names: &[&str]| words.iter().position(|word| names.contains(word));
    let before = |names: &[&str]| number(location(names)?.checked_sub(1)?);
    let after = |names: &[&str]| number(location(names)? + 1);
    if let (Some(count), Some(step), Some("npts"), Some("dt")) = (
        number(0),
        number(1),
        words.get(2).copied(),
        words.get(3).copied(),
    ) {
        let count = Some(count as usize);
        return Some(Head { count, step });
    }
    let count = after(&["npts"]).or_else(|| before(&["points", "samples", "pts", "npts"]))?;
    let step = after(&["dt", "at"])
        .or_else(|| before(&["sps", "hz", "samples/sec"]).map(|rate| 1.0 / rate))?;
    Some(Head {
        count: (count.fract() == 0.0).then_some(count as usize)?.into(),
        step,
    })
}

/// The numbers of a line: parted by blanks or, where they touch, in columns of the `width` that a Fortran format states.
fn numbers(line: &str, width: Option<usize>) -> Option<Vec<f64>> {
    let number = |text: &str| text.trim().replace(['D', 'd'], "E").parse::<f64>().ok();
    let parted = |line: &str| {
        line.split_whitespace()
            .map(number)
            .collect::<Option<Vec<f64>>>()
    };
    // Numbers can touch at their signs.
    let at_signs = || {
        let mut text = String::new();
        for c in line.chars() {
            let is_sign = matches!(c, '-' | '+');
            if is_sign && text.ends_with(|before: char| before.is_ascii_digit() || before == '.') {
                text.push(' ');
            }
            text.push(c);
        }
        parted(&text)
    };
    parted(line).or_else(at_signs).or_else(|| {
        let bytes = line
            .trim_end()
            .as_bytes()
            .chunks(width.filter(|width| *width > 0)?);
        bytes
            .map(|field| number(std::str::from_utf8(field).ok()?))
            .collect()
    })
}

/// Width of the numbers of a Fortran format such as `(8f10.5)`.
fn width(line: &str) -> Option<usize> {
    let format = line.rsplit_once('(')?.1.to_ascii_lowercase();
    let format = format.trim_start_matches(|c: char| c.is_ascii_digit());
    format
        .strip_prefix(['f', 'e'])?
        .split('.')
        .next()?
        .parse()
        .ok()
}

/// What the lines of a header state: the last one, or all together.
fn stated(lines: &[&str]) -> Option<Head> {
    lines
        .last()
        .and_then(|line| head(line))
        .or_else(|| head(&lines.join(" ")))
}

fn width_of(lines: &[&str]) -> Option<usize> {
    lines.iter().rev().find_map(|line| width(line))
}

/// True for a text with such a header whose series has another number of rows.
pub(super) fn begins_so(bytes: &[u8]) -> bool {
    let beginning = bytes.get(..bytes.len().min(BEGINNING)).unwrap_or_default();
    if beginning.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(beginning);
    if text.starts_with("Origin Time") && text.contains(KNET[0]) {
        return true;
    }
    let lines: Vec<&str> = text.lines().collect();
    let (mut begin, mut stated_width) = (0, None);
    // A header of numbers can stand before that of the series.
    let found = (1..lines.len()).find_map(|i| {
        let header = lines.get(begin..i)?;
        stated_width = lines
            .get(i - 1)
            .and_then(|line| width(line))
            .or(stated_width);
        let width = stated_width;
        let is_row = |line: &str| numbers(line, width).is_some_and(|row| !row.is_empty());
        if !is_row(lines[i]) || is_row(lines[i - 1]) {
            return None;
        }
        let found = stated(header).and_then(|head| Some((i, head.count?, width)));
        (begin, stated_width) = (i, None);
        found
    });
    let Some((first, count, width)) = found else {
        return false;
    };
    // A table has as many rows as samples.
    let text = String::from_utf8_lossy(bytes);
    let rows = text.lines().skip(first);
    let rows = rows.map_while(|line| numbers(line, width).filter(|row| !row.is_empty()));
    let (mut total, mut last) = (0, 0);
    for row in rows {
        last = row.len();
        total += last;
    }
    (count..count + last.max(1)).contains(&total) && total > 0
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().enumerate().peekable();
    let mut channels = Channels::default();
    let mut texts: Vec<&str> = Vec::new();
    let (mut rate, mut scale) = (None, None);
    while let Some((i, line)) = lines.next() {
        texts.push(line);
        let value = |key: &str| {
            line.strip_prefix(key)
                .map(|rest| rest.trim_start_matches("(Hz)").trim())
        };
        rate = rate
            .or(value(KNET[0])
                .and_then(|rate| rate.trim_end_matches("Hz").trim().parse::<f64>().ok()));
        scale = scale.or(value(KNET[1]).and_then(scale_of));
        let of_knet = rate.filter(|_| line.starts_with(KNET[2]));
        let of_knet = of_knet.map(|rate| Head {
            count: None,
            step: 1.0 / rate,
        });
        let width = width_of(&texts);
        let is_row = |line: &str| numbers(line, width).is_some_and(|row| !row.is_empty());
        let is_last = lines.peek().is_some_and(|(_, next)| is_row(next)) && !is_row(line);
        let Some(head) = stated(&texts).filter(|_| is_last).or(of_knet) else {
            continue;
        };
        let mut values = budget.list(head.count.unwrap_or(0))?;
        while head.count.is_none_or(|count| values.len() < count) {
            let Some((i, line)) = lines.next() else { break };
            let row = numbers(line, width).ok_or_else(|| {
                InputError::line(path, i + 1, 1, "not a row of numbers")
                    .found(quote(line.trim()))
                    .expected("the numbers of a series, as the header states")
            })?;
            values.extend(row);
        }
        if let Some(count) = head.count {
            if values.len() < count {
                return Err(
                    InputError::line(path, i + 1, 1, "the series has too few numbers")
                        .found(format!("{} numbers", values.len()))
                        .expected(format!("{count}, as the header states")),
                );
            }
            values.truncate(count);
        }
        let (factor, unit) = match scale.take() {
            Some((factor, unit)) => (factor, Some(unit)),
            None => (1.0, texts.iter().rev().find_map(|text| unit_of(text))),
        };
        values.iter_mut().for_each(|x| *x *= factor);
        let quantity = texts
            .iter()
            .rev()
            .find_map(|text| quantity_of(text).or_else(|| unit_kind(unit.as_deref()?)));
        let name = match line.split_once(',') {
            Some((id, _)) if id.starts_with("TIMESERIES") => id["TIMESERIES".len()..].trim(),
            _ => quantity.map_or("series", |quantity| quantity.name()),
        };
        budget.name(name)?;
        channels.push(name, unit, Sampling::interval(0.0, head.step), values);
        texts.clear();
    }
    Ok(channels)
}

/// The quantity of a unit other than a time.
fn unit_kind(unit: &str) -> Option<Measurand> {
    let is_of =
        |kind: &Measurand| *kind != Measurand::Time && Unit::recognise(*kind, unit).is_some();
    Measurand::ALL.into_iter().find(is_of)
}

/// Factor and unit of `3920(gal)/6182761`.
fn scale_of(text: &str) -> Option<(f64, String)> {
    let (above, below) = text.split_once('/')?;
    let (above, unit) = above.split_once('(')?;
    let factor = above.trim().parse::<f64>().ok()? / below.trim().parse::<f64>().ok()?;
    Some((factor, unit.trim_end_matches([')', ' ']).to_owned()))
}

/// The unit that a line of a header states: `IN UNITS OF G`, `in cm/sec2`, or the last field of a line with commas.
fn unit_of(line: &str) -> Option<String> {
    let small = line.to_lowercase();
    let behind = ["units of ", "units:", "units =", " in "]
        .iter()
        .find_map(|word| Some(small.find(word)? + word.len()));
    let field = |text: &str| -> Option<String> {
        let text = text
            .split([',', ';', '('])
            .next()?
            .trim()
            .trim_end_matches(['.', ')']);
        Unit::any(text).map(|_| text.to_owned())
    };
    let of_list = || {
        small
            .contains(',')
            .then(|| line.rsplit(',').next().and_then(field))
            .flatten()
    };
    behind
        .and_then(|at| field(line.get(at..)?))
        .or_else(of_list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_state_length_and_interval() {
        let stated = |line| head(line).map(|head| (head.count, head.step));
        for (line, count, step) in [
            ("NPTS=    600, DT=   .0050 SEC", 600, 0.005),
            ("NPTS=  600, DT= .01000", 600, 0.01),
            ("  4000    0.0050   NPTS, DT", 4000, 0.005),
            (
                " 4000 points of accel data equally spaced at  .005 sec, in cm/sec2.   (8f10.5)",
                4000,
                0.005,
            ),
            (
                "TIMESERIES NL_HGN_00_BHZ_R, 12 samples, 40 sps, 2003-05-29T02:13:22, SLIST, INTEGER, Counts",
                12,
                0.025,
            ),
        ] {
            assert_eq!(stated(line), Some((Some(count), step)), "{line}");
        }
        for line in ["time,acc", "NPTS= x, DT= 1", "12 samples", "at 5 sec"] {
            assert_eq!(stated(line), None, "{line}");
        }
        assert_eq!(
            unit_of("ACCELERATION TIME SERIES IN UNITS OF G").as_deref(),
            Some("G")
        );
        assert_eq!(
            unit_of("12 points at .005 sec, in cm/sec2.   (8f10.5)").as_deref(),
            Some("cm/sec2")
        );
        assert_eq!(
            scale_of("3920(gal)/6182761"),
            Some((3920.0 / 6_182_761.0, "gal".to_owned()))
        );
        assert_eq!(
            numbers("  -1.00000   2.00000-3.00000", Some(10)),
            Some(vec![-1.0, 2.0, -3.0])
        );
    }
}
