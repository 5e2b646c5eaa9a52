//! Values of the compact protocol of Apache Thrift, in which metadata are written.

use super::super::bytes::Bytes;
use crate::error::InputError;

/// Deepest nesting of structs and lists.
const DEEPEST: usize = 16;

/// A value.
#[derive(Debug)]
pub(super) enum Value<'a> {
    Integer(i64),
    Text(&'a [u8]),
    List(Vec<Self>),
    /// Fields with their numbers.
    Struct(Vec<(i64, Self)>),
    /// A map or a floating point number, which are not used.
    Other,
}

impl<'a> Value<'a> {
    /// A field of a struct.
    pub fn field(&self, number: i64) -> Option<&Self> {
        match self {
            Self::Struct(fields) => fields.iter().find(|(n, _)| *n == number).map(|(_, v)| v),
            _ => None,
        }
    }

    /// An integer that is a field of a struct.
    pub fn integer(&self, number: i64) -> Option<i64> {
        match self.field(number) {
            Some(Self::Integer(value)) => Some(*value),
            _ => None,
        }
    }

    /// A count or position that is a field of a struct.
    pub fn count(&self, number: i64) -> Option<usize> {
        usize::try_from(self.integer(number)?).ok()
    }

    /// A text that is a field of a struct.
    pub fn text(&self, number: i64) -> Option<String> {
        match self.field(number) {
            Some(Self::Text(text)) => Some(String::from_utf8_lossy(text).into_owned()),
            _ => None,
        }
    }

    /// A list that is a field of a struct; empty without one.
    pub fn list(&self, number: i64) -> &[Self] {
        match self.field(number) {
            Some(Self::List(list)) => list,
            _ => &[],
        }
    }
}

/// Reads a struct.
///
/// # Errors
/// When it is truncated, nested too deeply or of another protocol.
pub(super) fn read<'a>(bytes: &mut Bytes<'a>, what: &str) -> Result<Value<'a>, InputError> {
    value(bytes, 12, 0, what)
}

/// Unsigned integer of 7 bits per byte, lowest first.
pub(super) fn varint(bytes: &mut Bytes, what: &str) -> Result<u64, InputError> {
    let mut sum = 0;
    for i in 0..10 {
        let byte = bytes.uint(1, what)?;
        sum |= (byte & 0x7f).checked_shl(7 * i).unwrap_or(0);
        if byte < 0x80 {
            break;
        }
    }
    Ok(sum)
}

/// Integer with its sign in the lowest bit.
fn zigzag(bytes: &mut Bytes, what: &str) -> Result<i64, InputError> {
    let bits = varint(bytes, what)?;
    Ok((bits >> 1) as i64 ^ -((bits & 1) as i64))
}

fn value<'a>(
    bytes: &mut Bytes<'a>,
    kind: u64,
    depth: usize,
    what: &str,
) -> Result<Value<'a>, InputError> {
    Ok(match kind {
        _ if depth > DEEPEST => return Err(bytes.error("the metadata are nested too deeply")),
        // True and false of a field; within a list a byte.
        1 | 2 => Value::Integer(i64::from(kind == 1)),
        3 => Value::Integer(i64::from(bytes.uint(1, what)? as u8 as i8)),
        4..=6 => Value::Integer(zigzag(bytes, what)?),
        7 => {
            bytes.take(8, what)?;
            Value::Other
        }
        8 => {
            let length = varint(bytes, what)?;
            Value::Text(bytes.take(length, what)?)
        }
        9 | 10 => list(bytes, depth, what)?,
        11 => {
            map(bytes, depth, what)?;
            Value::Other
        }
        12 => fields(bytes, depth, what)?,
        _ => {
            let error = bytes.error(&format!("the file is damaged: {what}"));
            return Err(error.found(format!("a value of type {kind}")));
        }
    })
}

/// A value in a list or map, where truth values take a byte.
fn element<'a>(
    bytes: &mut Bytes<'a>,
    kind: u64,
    depth: usize,
    what: &str,
) -> Result<Value<'a>, InputError> {
    value(bytes, if kind < 3 { 3 } else { kind }, depth + 1, what)
}

fn list<'a>(bytes: &mut Bytes<'a>, depth: usize, what: &str) -> Result<Value<'a>, InputError> {
    let head = bytes.uint(1, what)?;
    let count = match head >> 4 {
        15 => varint(bytes, what)?,
        count => count,
    };
    let mut items = Vec::new();
    for _ in 0..count {
        items.push(element(bytes, head & 15, depth, what)?);
    }
    Ok(Value::List(items))
}

fn map(bytes: &mut Bytes, depth: usize, what: &str) -> Result<(), InputError> {
    let count = varint(bytes, what)?;
    if count > 0 {
        let kinds = bytes.uint(1, what)?;
        for _ in 0..count {
            element(bytes, kinds >> 4, depth, what)?;
            element(bytes, kinds & 15, depth, what)?;
        }
    }
    Ok(())
}

fn fields<'a>(bytes: &mut Bytes<'a>, depth: usize, what: &str) -> Result<Value<'a>, InputError> {
    let mut fields = Vec::new();
    let mut number: i64 = 0;
    loop {
        let head = bytes.uint(1, what)?;
        if head == 0 {
            return Ok(Value::Struct(fields));
        }
        number = match head >> 4 {
            0 => zigzag(bytes, what)?,
            step => number.saturating_add(step as i64),
        };
        fields.push((number, value(bytes, head & 15, depth + 1, what)?));
    }
}
