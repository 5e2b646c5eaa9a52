//! Types of the elements of a data set.

use super::super::bytes::Bytes;
use super::super::number::{ByteOrder, NumberType};
use super::file::File;
use crate::error::InputError;

const TYPE: &str = "the type of an array";

/// Kind of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    Number(NumberType, ByteOrder),
    /// Text of fixed length.
    Text,
    /// Address of another object.
    Reference,
    /// Numbers with the fields `real` and `imag`.
    Complex,
    /// Content, as a noun.
    Other(&'static str),
}

/// Type of the elements of a data set or attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DataType {
    /// Bytes of an element.
    pub size: usize,
    pub content: Content,
}

impl DataType {
    /// Reads the message of a type.
    ///
    /// # Errors
    /// When it is truncated, or its elements have no bytes.
    pub fn read(file: &File, bytes: &mut Bytes) -> Result<Self, InputError> {
        let class = bytes.uint(1, TYPE)? & 0x0f;
        let flags = bytes.uint(3, TYPE)?;
        let size = bytes.uint(4, TYPE)? as usize;
        if size == 0 {
            return Err(file.damaged(TYPE).found("elements of 0 bytes"));
        }
        let content = match class {
            0 => integer(flags, size, bytes.uint(4, TYPE)?),
            1 => floating(flags, size, bytes.take(8, TYPE)?),
            3 => Content::Text,
            6 if is_complex(bytes.rest()) => Content::Complex,
            6 => Content::Other("records of several fields"),
            7 if flags & 0x0f == 0 => Content::Reference,
            // An enumeration, as of true and false: its integers.
            8 if bytes.rest().first().is_some_and(|byte| byte & 0x0f == 0) => {
                return Self::read(file, bytes);
            }
            9 if flags & 0x0f == 1 => Content::Other("texts"),
            _ => Content::Other("data of another type than numbers"),
        };
        Ok(Self { size, content })
    }
}

fn order(flags: u64) -> ByteOrder {
    match flags & 1 {
        0 => ByteOrder::Little,
        _ => ByteOrder::Big,
    }
}

/// An integer; `bits` has the offset of its bits in the lower half, and their number in the upper one.
fn integer(flags: u64, size: usize, bits: u64) -> Content {
    let is_signed = flags & 8 != 0;
    let kind = match (size, is_signed) {
        (1, true) => NumberType::I8,
        (1, false) => NumberType::U8,
        (2, true) => NumberType::I16,
        (2, false) => NumberType::U16,
        (3, true) => NumberType::I24,
        (4, true) => NumberType::I32,
        (4, false) => NumberType::U32,
        (8, true) => NumberType::I64,
        (8, false) => NumberType::U64,
        _ => return Content::Other("integers of an unusual length"),
    };
    match bits == (8 * size as u64) << 16 {
        true => Content::Number(kind, order(flags)),
        false => Content::Other("integers with unused bits"),
    }
}

/// A number of IEEE 754; `properties` are offset and number of its bits, then position and number of those of the exponent and of the
/// fraction.
fn floating(flags: u64, size: usize, properties: &[u8]) -> Content {
    const UNUSUAL: Content = Content::Other("floating point numbers of an unusual layout");
    let (kind, expected) = match size {
        2 => (NumberType::F16, [0, 0, 16, 0, 10, 5, 0, 10]),
        4 => (NumberType::F32, [0, 0, 32, 0, 23, 8, 0, 23]),
        8 => (NumberType::F64, [0, 0, 64, 0, 52, 11, 0, 52]),
        _ => return UNUSUAL,
    };
    match properties == expected && flags & 0x40 == 0 {
        true => Content::Number(kind, order(flags)),
        false => UNUSUAL,
    }
}

/// True for the fields of a complex number of MATLAB or h5py, by the name of the first one.
fn is_complex(fields: &[u8]) -> bool {
    fields.starts_with(b"real\0") || fields.starts_with(b"r\0")
}
