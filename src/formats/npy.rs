//! Arrays of NumPy: `.npy`, format versions 1 to 3.
//!
//! Layout: magic, version, length of the header, header (a Python dictionary with the type, order and shape), numbers.
//! Reference: numpy.lib.format.

use std::path::Path;

use serde::Deserialize;
use serde_yaml::Value;

use super::Channels;
use super::array::Array;
use super::budget::Budget;
use super::bytes::Bytes;
use super::number::{ByteOrder, NumberType};
use crate::error::InputError;
use crate::text_io::quote;

/// First bytes of a file.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Remedy for arrays of Python objects.
const NO_OBJECTS: &str = "Python objects are stored as pickles, which can run code: save the numbers with `numpy.savez(file, force=force.astype(float))`";

/// Reads a file with one array, which is named as the file.
pub(super) fn read(path: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Channels, InputError> {
    let name = path.file_stem().map(|stem| stem.to_string_lossy());
    let mut channels = Channels::default();
    add(
        path,
        bytes,
        &name.unwrap_or_default(),
        budget,
        &mut channels,
    )?;
    Ok(channels)
}

/// Adds the channels of an array with a name.
pub(super) fn add(
    path: &Path,
    bytes: &[u8],
    name: &str,
    budget: &mut Budget,
    channels: &mut Channels,
) -> Result<(), InputError> {
    let what = format!("the array {}", quote(name));
    let mut bytes = Bytes::new(path, bytes, ByteOrder::Little);
    let header = header(path, &mut bytes, &what)?;
    budget.name(name)?;
    let (rows, columns) = match *header.shape {
        [] => (1, 1),
        [rows] => (rows, 1),
        [rows, columns] => (rows, columns),
        _ => {
            let content = format!("an array with {} dimensions", header.shape.len());
            channels.refuse(
                name,
                content,
                Some("save arrays with one or two dimensions"),
            );
            return Ok(());
        }
    };
    let count = rows.saturating_mul(columns);
    match header.descr {
        Descr::Type(descr) => match (ticks(&descr), number(&descr)) {
            (Some((unit, order)), _) => {
                let data = bytes.take(count.saturating_mul(8), &what)?;
                let mut values = budget.list(count as usize)?;
                values.extend(since_first(data, order, 0, 8));
                channels.push(name, Some(unit), None, values);
                Ok(())
            }
            (None, Ok((kind, order))) => {
                let length = count.saturating_mul(kind.size() as u64);
                let data = bytes.take(length, &what)?;
                let array = Array {
                    rows: rows as usize,
                    columns: columns as usize,
                    column_major: header.fortran_order,
                    value: &|i| kind.value_at(data, order, i),
                };
                array.add_to(channels, name, budget)
            }
            (None, Err((content, hint))) => {
                channels.state_group("", name, texts(&descr, bytes.rest(), count));
                channels.refuse(name, content, hint);
                Ok(())
            }
        },
        Descr::Fields(fields) => structured(name, &fields, bytes, count, budget, channels),
    }
}

/// Most texts of an array that states something, and the most letters of one.
const TEXTS: u64 = 1000;

/// The texts of an array of the type `<U5` or `|S5`.
fn texts(descr: &str, data: &[u8], count: u64) -> Vec<String> {
    let order = if descr.starts_with('>') {
        ByteOrder::Big
    } else {
        ByteOrder::Little
    };
    let kind = descr.trim_start_matches(['<', '>', '=', '|']);
    let letter = match kind.get(..1) {
        Some("U") => NumberType::U32,
        Some("S") => NumberType::U8,
        _ => return Vec::new(),
    };
    let length = kind[1..].parse::<u64>().unwrap_or(0).min(TEXTS) as usize * letter.size();
    let text = |bytes: &[u8]| -> String {
        let letters =
            (0..bytes.len() / letter.size()).map(|i| letter.value_at(bytes, order, i) as u32);
        letters
            .take_while(|letter| *letter > 0)
            .filter_map(char::from_u32)
            .collect()
    };
    data.chunks_exact(length.max(1))
        .take(count.min(TEXTS) as usize)
        .map(text)
        .collect()
}

/// A header, as NumPy writes it.
#[derive(Debug, Deserialize)]
struct Header {
    descr: Descr,
    fortran_order: bool,
    shape: Vec<u64>,
}

/// The type of an array, or the fields of a structured one.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Descr {
    Type(String),
    Fields(Vec<Vec<Value>>),
}

fn header(path: &Path, bytes: &mut Bytes, what: &str) -> Result<Header, InputError> {
    let start = bytes.take(8, what)?;
    if !start.starts_with(MAGIC) {
        return Err(invalid(path, what, "no magic of NumPy"));
    }
    let version = start.get(6).copied().unwrap_or_default();
    let length = match version {
        1 => u64::from(bytes.u16(what)?),
        2 | 3 => u64::from(bytes.u32(what)?),
        _ => {
            return Err(invalid(
                path,
                what,
                &format!("version {version} of the format"),
            ));
        }
    };
    let text = bytes.take(length, what)?;
    let text = match version {
        3 => String::from_utf8_lossy(text).into_owned(),
        // Latin-1.
        _ => text.iter().map(|byte| char::from(*byte)).collect(),
    };
    parse_header(&text)
        .ok_or_else(|| invalid(path, what, &format!("the header {}", quote(text.trim()))))
}

/// Longest header, bytes: that of the most channels of a file.
const LONGEST: usize = 1 << 20;

/// Reads a literal of Python, which is YAML but for round brackets and the `L` of Python 2.
fn parse_header(text: &str) -> Option<Header> {
    if text.len() > LONGEST || text.contains('\\') {
        return None;
    }
    let (mut yaml, mut quote) = (String::new(), None);
    for c in text.chars() {
        match quote {
            Some(open) if open == c => quote = None,
            None if matches!(c, '\'' | '"') => quote = Some(c),
            // Aliases of YAML stand for any amount of text.
            None if matches!(c, '&' | '*') => return None,
            _ => {}
        }
        yaml.push(match (quote, c) {
            (None, '(') => '[',
            (None, ')') => ']',
            (None, 'L') => ' ',
            _ => c,
        });
    }
    #[expect(clippy::disallowed_methods, reason = "without aliases")]
    let header = serde_yaml::from_str(&yaml);
    header.ok()
}

fn invalid(path: &Path, what: &str, found: &str) -> InputError {
    InputError::file(path, format!("invalid header of {what}"))
        .found(found)
        .expected("the header of a NumPy array, version 1 to 3, with `descr`, `fortran_order` and `shape`")
}

/// Type and byte order of `<f8` and the like; otherwise the content as a noun, and a remedy.
fn number(descr: &str) -> Result<(NumberType, ByteOrder), (String, Option<&'static str>)> {
    let (order, code) = match descr.split_at_checked(1) {
        Some((">", code)) => (ByteOrder::Big, code),
        Some(("<" | "|" | "=", code)) => (ByteOrder::Little, code),
        _ => (ByteOrder::Little, descr),
    };
    let kind = match code {
        "b1" | "?" | "u1" | "B" => NumberType::U8,
        "i1" | "b" => NumberType::I8,
        "i2" => NumberType::I16,
        "i4" => NumberType::I32,
        "i8" => NumberType::I64,
        "u2" => NumberType::U16,
        "u4" => NumberType::U32,
        "u8" => NumberType::U64,
        "f2" => NumberType::F16,
        "f4" => NumberType::F32,
        "f8" => NumberType::F64,
        _ => return Err(no_number(descr, code)),
    };
    Ok((kind, order))
}

fn no_number(descr: &str, code: &str) -> (String, Option<&'static str>) {
    match code.chars().next() {
        Some('O') => ("Python objects".to_owned(), Some(NO_OBJECTS)),
        Some('c') => (
            "complex numbers".to_owned(),
            Some("save the real samples in time"),
        ),
        Some('U' | 'S' | 'a') => ("texts".to_owned(), None),
        Some('M' | 'm') => (
            "dates without a unit of time".to_owned(),
            Some("save seconds: `(t - t[0]) / numpy.timedelta64(1, 's')`"),
        ),
        _ => (
            format!("numbers of the type {}", quote(descr)),
            Some("save them as double precision: `x.astype(float)`"),
        ),
    }
}

/// Unit and byte order of `<M8[ns]` or `<m8[25us]`: numbers of 8 bytes.
fn ticks(descr: &str) -> Option<(String, ByteOrder)> {
    let order = match descr.split_at_checked(1)? {
        (">", _) => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let kind = descr.trim_start_matches(['<', '>', '=', '|']);
    let unit = kind
        .strip_prefix("M8[")
        .or(kind.strip_prefix("m8["))?
        .strip_suffix(']')?;
    let name = unit.trim_start_matches(|c: char| c.is_ascii_digit());
    let name = match name {
        "s" | "ms" | "us" | "ns" | "h" => name,
        "m" => "min",
        "D" => "day",
        _ => return None,
    };
    // Multiples of a unit are rare.
    (!unit.starts_with(|c: char| c.is_ascii_digit())).then(|| (name.to_owned(), order))
}

/// Ticks since the first; NaN for `NaT`, the least number.
fn since_first(
    data: &[u8],
    order: ByteOrder,
    offset: usize,
    stride: usize,
) -> impl Iterator<Item = f64> + '_ {
    let ticks = move |record: &[u8]| {
        let own: [u8; 8] = record
            .get(offset..offset + 8)
            .and_then(|own| own.try_into().ok())
            .unwrap_or_default();
        match order {
            ByteOrder::Little => i64::from_le_bytes(own),
            ByteOrder::Big => i64::from_be_bytes(own),
        }
    };
    let first = data
        .chunks_exact(stride.max(1))
        .map(ticks)
        .find(|t| *t != i64::MIN)
        .unwrap_or(0);
    data.chunks_exact(stride.max(1))
        .map(ticks)
        .map(move |t| match t {
            i64::MIN => f64::NAN,
            t => t.wrapping_sub(first) as f64,
        })
}

/// Adds the fields of a structured array, each as a channel `name.field`.
fn structured(
    name: &str,
    fields: &[Vec<Value>],
    mut bytes: Bytes,
    count: u64,
    budget: &mut Budget,
    channels: &mut Channels,
) -> Result<(), InputError> {
    let mut stride = 0;
    let mut used = Vec::new();
    for field in fields {
        let simple = match field.as_slice() {
            [Value::String(field), Value::String(descr)] => Some((field, descr)),
            _ => None,
        };
        let Some((field, (descr, size))) =
            simple.and_then(|(field, descr)| Some((field, (descr, size_of_type(descr)?))))
        else {
            channels.refuse(
                name,
                "a structured array with nested fields or objects",
                Some("save its fields as arrays: `numpy.savez(file, force=a['force'])`"),
            );
            return Ok(());
        };
        // Padding has no name.
        if !field.is_empty() {
            used.push((field, descr, stride));
        }
        stride += size;
    }
    let stride = stride as usize;
    let data = bytes.take(
        count.saturating_mul(stride as u64),
        &format!("the array {}", quote(name)),
    )?;
    for (field, descr, offset) in used {
        let path = format!("{name}.{field}");
        budget.name(&path)?;
        match (ticks(descr), number(descr)) {
            _ if count == 0 => channels.refuse(&path, "an empty array", None),
            (Some((unit, order)), _) => {
                let mut values = budget.list(count as usize)?;
                values.extend(since_first(data, order, offset as usize, stride));
                channels.push(&path, Some(unit), None, values);
            }
            (None, Ok((kind, order))) => {
                let mut values = budget.list(count as usize)?;
                values.extend(kind.values(data, order, offset as usize, stride));
                channels.push(&path, None, None, values);
            }
            (None, Err((content, hint))) => channels.refuse(&path, content, hint),
        }
    }
    Ok(())
}

/// Bytes of a field of type `<f8`, `|S12`, `<U5` or `|V4`; `None` for objects and others.
fn size_of_type(descr: &str) -> Option<u64> {
    if ticks(descr).is_some() {
        return Some(8);
    }
    let digits = descr.trim_start_matches(|c: char| !c.is_ascii_digit());
    let size: u64 = digits.parse().ok().filter(|size| *size <= 1 << 20)?;
    match descr.contains('O') {
        true => None,
        // A letter takes four bytes.
        false => Some(size * if descr.contains('U') { 4 } else { 1 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_numpy() {
        let text = "{'descr': [('t (s)', '<f8'), (\"y's\", '<i2', (3,))], 'fortran_order': False, 'shape': (7, 2L), }  \n";
        let header = parse_header(text).expect("a header");
        assert_eq!((header.shape, header.fortran_order), (vec![7, 2], false));
        let Descr::Fields(fields) = header.descr else {
            panic!("no fields");
        };
        assert_eq!(fields[0], ["t (s)", "<f8"].map(Value::from));
        assert_eq!((fields[1][0].as_str(), fields[1].len()), (Some("y's"), 3));
        let scalar = parse_header("{'descr': '<f8', 'fortran_order': True, 'shape': ()}");
        assert!(scalar.is_some_and(|header| header.shape.is_empty()));
        for text in [
            "{'descr': &a '<f8', 'fortran_order': False, 'shape': (1,)}",
            "",
            "{",
            "{'descr': '<f8'}",
            "{'descr': '\\x41', 'fortran_order': False, 'shape': (1,)}",
        ] {
            assert!(parse_header(text).is_none(), "{text}");
        }
    }
}
