//! Descriptions of objects in the segments of a TDMS file: paths, types of raw data, and properties.

use std::collections::BTreeMap;

use super::bytes::Bytes;
use super::names;
use super::number::{ByteOrder, NumberType};
use crate::error::InputError;

/// Index of raw data: none, and as in the segment before.
const NONE: u32 = u32::MAX;
const SAME: u32 = 0;
/// Indices of raw data of NI-DAQmx.
const DAQMX: [u32; 3] = [0x1269, 0x126a, 0x1369];

/// Types.
const TEXT: u32 = 0x20;
const TIMESTAMP: u32 = 0x44;

/// Beginning of the names of properties that are used, beside those that have a meaning of their own.
const USED: [&str; 2] = ["wf_start_time", "NI_"];

/// Type of the samples of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SampleType {
    Number(NumberType),
    /// Fractions of a second of 2^-64, and seconds.
    Timestamp,
    /// Content that is no number, and the bytes of one.
    Other(&'static str, u64),
}

impl SampleType {
    /// Bytes of a sample; 0 for texts, whose length is stated for all.
    pub fn size(self) -> u64 {
        match self {
            Self::Number(kind) => kind.size() as u64,
            Self::Timestamp => 16,
            Self::Other(_, size) => size,
        }
    }
}

/// Samples of a channel in each chunk of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RawIndex {
    pub kind: SampleType,
    pub count: u64,
    /// Bytes.
    pub size: u64,
}

/// Raw data of an object in a segment.
pub(super) enum RawData {
    None,
    Same,
    New(RawIndex),
    /// Raw samples of NI-DAQmx.
    Daqmx,
}

/// Value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
    /// Whole seconds, and fraction of a second.
    Time(i64, f64),
    Other,
}

impl Property {
    /// The value as text; of a time the seconds since another.
    fn text(&self, since: (i64, f64)) -> Option<String> {
        match self {
            Self::Number(number) => Some(number.to_string()),
            Self::Text(text) => Some(text.clone()),
            Self::Time(seconds, fraction) => {
                let whole = seconds.wrapping_sub(since.0) as f64;
                Some((whole + (fraction - since.1)).to_string())
            }
            Self::Other => None,
        }
    }
}

/// What properties state beside scales: names and values; times in seconds since another.
pub(super) fn statements(
    properties: &Properties,
    since: (i64, f64),
) -> impl Iterator<Item = (&str, Vec<String>)> {
    let others = properties
        .iter()
        .filter(|(name, _)| !name.starts_with("NI_Scal"));
    others.filter_map(move |(name, value)| Some((name.as_str(), vec![value.text(since)?])))
}

/// Properties by name.
pub(super) type Properties = BTreeMap<String, Property>;

/// An object of a segment.
pub(super) struct Object {
    pub path: String,
    pub raw: RawData,
    pub properties: Properties,
}

/// The next object.
pub(super) fn object(bytes: &mut Bytes) -> Result<Object, InputError> {
    let path = text(bytes)?;
    let what = "the description of a channel";
    let raw = match bytes.u32(what)? {
        NONE => RawData::None,
        SAME => RawData::Same,
        index if DAQMX.contains(&index) => RawData::Daqmx,
        length => RawData::New(raw_index(bytes, length)?),
    };
    let mut properties = Properties::new();
    if matches!(raw, RawData::Daqmx) {
        // The rest of this index has another layout; the file is refused.
        return Ok(Object {
            path,
            raw,
            properties,
        });
    }
    for _ in 0..bytes.u32(what)? {
        let name = text(bytes)?;
        let value = property(bytes)?;
        if names::read(&name).is_some() || USED.iter().any(|used| name.starts_with(used)) {
            properties.insert(name, value);
        }
    }
    Ok(Object {
        path,
        raw,
        properties,
    })
}

fn raw_index(bytes: &mut Bytes, length: u32) -> Result<RawIndex, InputError> {
    let what = "the description of a channel";
    let code = bytes.u32(what)?;
    let kind = known_type(bytes, code)?;
    bytes.take(4, what)?;
    let count = bytes.u64(what)?;
    let size = match (code, length) {
        (TEXT, _) => bytes.u64(what)?,
        _ => count.saturating_mul(kind.size()),
    };
    Ok(RawIndex { kind, count, size })
}

fn number_type(code: u32) -> Option<NumberType> {
    Some(match code {
        1 => NumberType::I8,
        2 => NumberType::I16,
        3 => NumberType::I32,
        4 => NumberType::I64,
        5 | 0x21 => NumberType::U8,
        6 => NumberType::U16,
        7 => NumberType::U32,
        8 => NumberType::U64,
        9 | 0x19 => NumberType::F32,
        10 | 0x1a => NumberType::F64,
        _ => return None,
    })
}

/// The type with this code.
///
/// # Errors
/// For an unknown one: the length of its samples is not known, so that nothing behind it can be read.
fn known_type(bytes: &Bytes, code: u32) -> Result<SampleType, InputError> {
    Ok(match (code, number_type(code)) {
        (_, Some(kind)) => SampleType::Number(kind),
        (TIMESTAMP, _) => SampleType::Timestamp,
        (TEXT, _) => SampleType::Other("texts", 0),
        (0x08_000c, _) => SampleType::Other("complex numbers", 8),
        (0x10_000d, _) => SampleType::Other("complex numbers", 16),
        (11 | 0x1b, _) => SampleType::Other("numbers of extended precision", 16),
        _ => {
            return Err(bytes
                .error("a type of samples that is not supported")
                .found(format!("type {code:#x}"))
                .expected("integers, floating-point numbers, texts or timestamps"));
        }
    })
}

fn property(bytes: &mut Bytes) -> Result<Property, InputError> {
    let what = "a property";
    let code = bytes.u32(what)?;
    if code == TEXT {
        return text(bytes).map(Property::Text);
    }
    match known_type(bytes, code)? {
        SampleType::Number(kind) => bytes.number(kind, what).map(Property::Number),
        SampleType::Timestamp => {
            let [first, second] = [bytes.u64(what)?, bytes.u64(what)?];
            let (fraction, seconds) = match bytes.order {
                ByteOrder::Little => (first, second),
                ByteOrder::Big => (second, first),
            };
            Ok(Property::Time(
                seconds as i64,
                fraction as f64 / 2f64.powi(64),
            ))
        }
        other @ SampleType::Other(..) => {
            bytes.take(other.size(), what)?;
            Ok(Property::Other)
        }
    }
}

fn text(bytes: &mut Bytes) -> Result<String, InputError> {
    let what = "a name";
    let length = bytes.u32(what)?;
    Ok(String::from_utf8_lossy(bytes.take(u64::from(length), what)?).into_owned())
}

/// The dotted path of a channel, `group.channel`, and true; that of a group, and false.
///
/// In the file it is `/'group'/'channel'`, with quotes doubled.
pub(super) fn dotted(path: &str) -> Option<(String, bool)> {
    let mut parts = Vec::new();
    let mut rest = path;
    while let Some(quoted) = rest.strip_prefix("/'") {
        let mut part = String::new();
        let mut after = quoted;
        loop {
            let (text, behind) = after.split_once('\'')?;
            part += text;
            match behind.strip_prefix('\'') {
                Some(more) => {
                    part.push('\'');
                    after = more;
                }
                None => {
                    rest = behind;
                    break;
                }
            }
        }
        parts.push(part);
    }
    Some((parts.join("."), parts.len() > 1))
}

#[cfg(test)]
mod tests {
    use super::dotted;

    #[test]
    fn paths_are_dotted() {
        for (path, expected) in [
            (
                "/'Group'/'FileChannel 1'",
                Some(("Group.FileChannel 1", true)),
            ),
            ("/'it''s'/'a/b'", Some(("it's.a/b", true))),
            ("/'Group'", Some(("Group", false))),
            ("/", Some(("", false))),
            ("/'a'/'b", None),
            ("", Some(("", false))),
        ] {
            let expected = expected.map(|(path, is_channel)| (path.to_owned(), is_channel));
            assert_eq!(dotted(path), expected, "{path}");
        }
    }
}
