//! Universal files (UFF, UNV): functions of data set 58 as text and 58b in binary, with units of data set 164.
//!
//! A data set stands between two lines `    -1`; its first line has its number. Other data sets are skipped. Reference: SDRC Universal
//! File Formats.

use std::path::Path;

use super::Channels;
use super::budget::Budget;
use super::bytes::Bytes;
use super::number::{ByteOrder, NumberType};
use super::uff_header::{FunctionHeader, LINES, UnitFactors, number};
use crate::error::InputError;
use crate::text_io::quote;

/// Line before and after a data set.
const MARK: &str = "-1";
/// Widths of numbers of single and double precision, columns.
const SINGLE: usize = 13;
const DOUBLE: usize = 20;
/// Floating-point format of 58b that is supported: IEEE 754.
const IEEE: u32 = 2;

/// True for bytes that begin like a universal file: a mark and the number of a data set.
pub(super) fn begins_so(bytes: &[u8]) -> bool {
    let head = bytes.get(..bytes.len().min(400)).unwrap_or_default();
    let head = String::from_utf8_lossy(head);
    let mut lines = head
        .lines()
        .map(str::trim)
        .skip_while(|line| line.is_empty());
    let number = |line: &str| line.starts_with(|c: char| c.is_ascii_digit());
    // pyuff writes two marks before a set.
    lines.next() == Some(MARK) && lines.find(|line| *line != MARK).is_some_and(number)
}

/// The lines of the file; binary data between them are skipped by `at`.
struct Lines<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    count: usize,
}

impl Lines<'_> {
    fn next(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|byte| *byte == b'\n');
        let line = rest.get(..end.unwrap_or(rest.len())).unwrap_or_default();
        self.at += line.len() + 1;
        self.count += 1;
        let text = String::from_utf8_lossy(line).into_owned();
        Some(text.trim_end().to_owned())
    }

    /// The next line of data set 58.
    fn within(&mut self) -> Result<String, InputError> {
        let (path, line) = (self.path, self.count);
        self.next().ok_or_else(|| {
            InputError::line(path, line.max(1), 1, "the file is truncated in data set 58")
                .found("the end of the file")
                .expected("the lines of the data set, and a line `-1`")
        })
    }

    fn error(&self, problem: &str) -> InputError {
        InputError::line(self.path, self.count.max(1), 1, problem)
    }
}

pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let mut lines = Lines {
        path,
        bytes,
        at: 0,
        count: 0,
    };
    let mut channels = Channels::default();
    // Sets before the first units have these as well.
    let mut search = Lines { ..lines };
    let mut is_begun = false;
    let mut is_units = |line: &String| {
        std::mem::replace(&mut is_begun, line.trim() == MARK) && line.trim() == "164"
    };
    let first = std::iter::from_fn(|| search.next()).find(|line| is_units(line));
    let mut units = first.and_then(|_| unit_factors(&mut search));
    while let Some(line) = lines.next() {
        if line.trim() != MARK {
            continue;
        }
        let first = std::iter::from_fn(|| lines.next()).find(|line| line.trim() != MARK);
        let Some(first) = first else { break };
        let mut words = first.split_whitespace();
        match words.next() {
            Some("58") => function(&mut lines, units, &mut channels, budget)?,
            Some("58b") => binary_function(&mut lines, &first, units, &mut channels, budget)?,
            Some("164") => units = unit_factors(&mut lines).or(units),
            _ => {}
        }
        while lines.next().is_some_and(|line| line.trim() != MARK) {}
    }
    Ok(channels)
}

/// The factors of data set 164: in its second line, after the number, the name and the mode of the units.
fn unit_factors(lines: &mut Lines) -> Option<UnitFactors> {
    lines.next()?;
    let factors = lines.next()?;
    let mut factors = factors.split_whitespace().map(number);
    let (length, force) = (factors.next()??, factors.next()??);
    (length > 0.0 && force > 0.0).then_some(UnitFactors { length, force })
}

fn header(lines: &mut Lines, units: Option<UnitFactors>) -> Result<FunctionHeader, InputError> {
    let first = lines.count + 1;
    let texts = (0..LINES).map(|_| lines.within());
    let texts: Vec<String> = texts.collect::<Result<_, _>>()?;
    FunctionHeader::read(&texts, units).map_err(|(index, expected)| {
        let found = texts.get(index).map_or("", String::as_str);
        InputError::line(
            lines.path,
            first + index,
            1,
            "invalid header of data set 58",
        )
        .found(quote(found))
        .expected(expected)
    })
}

/// A function with numbers as text.
fn function(
    lines: &mut Lines,
    units: Option<UnitFactors>,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let header = header(lines, units)?;
    if header.other.is_some() {
        return add(header, Vec::new(), channels, budget);
    }
    let width = if header.is_double { DOUBLE } else { SINGLE };
    // Abscissas have single precision.
    let widths = match header.is_uneven {
        true => [SINGLE, width],
        false => [width, width],
    };
    let count = header
        .count
        .saturating_mul(1 + usize::from(header.is_uneven));
    let mut numbers = budget.list(count)?;
    while numbers.len() < count {
        let line = lines.within()?;
        if line.trim() == MARK {
            return Err(lines
                .error("data set 58 has too few numbers")
                .found(format!("{} numbers", numbers.len()))
                .expected(format!("{count} numbers, as its header states")));
        }
        let Some(found) = split(&line, widths) else {
            return Err(lines
                .error("not a number in data set 58")
                .found(quote(line.trim()))
                .expected("numbers in columns of 13 (single precision) or 20 (double precision)"));
        };
        numbers.extend(found.into_iter().take(count - numbers.len()));
    }
    add(header, numbers, channels, budget)
}

/// The numbers of a line: separated by blanks or, where they touch, in columns of these widths in turn.
fn split(line: &str, widths: [usize; 2]) -> Option<Vec<f64>> {
    let separated: Option<Vec<f64>> = line.split_whitespace().map(number).collect();
    if separated.is_some() {
        return separated;
    }
    let (mut at, mut found) = (0, Vec::new());
    for width in widths.into_iter().cycle() {
        let end = (at + width).min(line.len());
        if at >= line.len() {
            break;
        }
        found.push(number(line.get(at..end)?)?);
        at = end;
    }
    Some(found)
}

/// A function with binary numbers; its first line has byte order, format of numbers, lines of the header and bytes.
fn binary_function(
    lines: &mut Lines,
    first: &str,
    units: Option<UnitFactors>,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let words = first.split_whitespace().skip(1).take(4);
    let words: Option<Vec<u64>> = words.map(|word| word.parse().ok()).collect();
    let Some(&[order, format, _, stated]) = words.as_deref() else {
        return Err(lines
            .error("invalid first line of data set 58b")
            .found(quote(first.trim()))
            .expected("byte order, format of numbers, lines of the header and bytes of the data"));
    };
    if format != u64::from(IEEE) {
        return Err(lines
            .error("numbers of a format that is not supported")
            .found(format!("format {format} (1 DEC VMS, 3 IBM 5/370)"))
            .expected(format!("{IEEE} (IEEE 754)")));
    }
    let header = header(lines, units)?;
    let kind = match header.is_double {
        true => NumberType::F64,
        false => NumberType::F32,
    };
    let size = kind.size();
    let rest = lines.bytes.get(lines.at..).unwrap_or_default();
    let order = match order {
        2 => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let mut rest = Bytes::new(lines.path, rest, order);
    let what = format!("the function {}", quote(&header.name));
    // pyuff states 8 bytes a sample also where they take 16: the set ends at its mark.
    let count = header.count;
    let value = if header.is_complex { 2 * size } else { size };
    let before: &[usize] = if header.is_uneven { &[4, 8] } else { &[0] };
    let lengths = before
        .iter()
        .map(|before| count.saturating_mul(before + value) as u64);
    let is_end = |length: &u64| {
        let from = usize::try_from(*length)
            .ok()
            .and_then(|length| lines.at.checked_add(length));
        let after = from
            .and_then(|from| lines.bytes.get(from..))
            .unwrap_or_default();
        after.trim_ascii_start().starts_with(MARK.as_bytes())
    };
    let length = std::iter::once(stated).chain(lengths).find(is_end);
    let data = rest.take(length.unwrap_or(stated), &what)?;
    lines.at += data.len();
    if header.other.is_some() {
        return add(header, Vec::new(), channels, budget);
    }
    // Abscissas have 4 or 8 bytes.
    let before = match header.is_uneven {
        true => [4, 8]
            .into_iter()
            .find(|before| count.saturating_mul(before + size) == data.len()),
        false => (count.saturating_mul(size) == data.len()).then_some(0),
    };
    let Some(before) = before else {
        return Err(lines
            .error("data set 58b has another length than its header states")
            .found(format!("{} bytes", data.len()))
            .expected(format!("{count} samples of {size} bytes")));
    };
    let mut numbers = budget.list(count * (1 + usize::from(header.is_uneven)))?;
    let abscissa = if before == 8 {
        NumberType::F64
    } else {
        NumberType::F32
    };
    for record in data.chunks_exact(before + size) {
        if header.is_uneven {
            numbers.push(abscissa.value(record, order));
        }
        let sample = record.get(before..).unwrap_or_default();
        numbers.push(kind.value(sample, order));
    }
    add(header, numbers, channels, budget)
}

/// Adds a function: its samples, with their times as a channel of their own where the spacing is uneven.
fn add(
    header: FunctionHeader,
    mut numbers: Vec<f64>,
    channels: &mut Channels,
    budget: &mut Budget,
) -> Result<(), InputError> {
    let ordinate = if header.is_uneven { 2 } else { 1 };
    let ordinates = numbers.iter_mut().skip(ordinate - 1).step_by(ordinate);
    ordinates.for_each(|x| *x *= header.scale);
    budget.name(&header.name)?;
    if let Some(other) = header.other {
        let hint = "kmcfit reads records in time: export the time histories";
        channels.refuse(&header.name, other, Some(hint));
        return Ok(());
    }
    if numbers.is_empty() {
        channels.refuse(&header.name, "no samples", None);
        return Ok(());
    }
    if header.is_uneven {
        let mut times = budget.list(numbers.len() / 2)?;
        let mut values = budget.list(numbers.len() / 2)?;
        for pair in numbers.chunks_exact(2) {
            times.extend(pair.first());
            values.extend(pair.last());
        }
        let is_there = |c: &super::FileChannel| c.name.starts_with("time") && c.values == times;
        if !channels.channels.iter().any(is_there) {
            let unit = Some(header.time_unit).filter(|unit| !unit.is_empty());
            channels.push("time", unit.or(Some("s".into())), None, times);
        }
        channels.push(&header.name, header.unit, None, values);
        return Ok(());
    }
    let from = channels.channels.len();
    channels.push(&header.name, header.unit, None, numbers);
    channels.state(from, "dt", vec![header.step.to_string()]);
    channels.state(from, "t0", vec![header.start.to_string()]);
    channels.state(from, "xunit", vec![header.time_unit]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_touch_are_split_at_columns() {
        let touching = "-1.00000E+000-2.50000E-001 3.00000E+000";
        assert_eq!(split(touching, [13, 13]), Some(vec![-1.0, -0.25, 3.0]));
        assert_eq!(split(" 1.0 2.0", [13, 13]), Some(vec![1.0, 2.0]));
        assert_eq!(split("1.0 x", [13, 13]), None);
        assert_eq!(split("é1.0é", [13, 13]), None);
        assert_eq!(split("", [13, 13]), Some(vec![]));
    }
}
