//! Files of MATLAB, versions 5 to 7: nested structs and cells by dotted path.
//!
//! Layout: a header of 128 bytes, then elements, each with type, length and data, padded to 8 bytes; in version 7 every variable
//! is one element that is compressed by zlib. Reference: MathWorks, "MAT-File Format".

use std::path::Path;

use super::array::Array;
use super::budget::Budget;
use super::bytes::Bytes;
use super::number::{ByteOrder, NumberType};
use super::{Channels, mat_class, refused};
use crate::error::InputError;
use crate::text_io::quote;

/// Length of the header; its last two bytes state the byte order.
pub(super) const HEADER: usize = 128;

/// Types of elements beside numbers.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays.
const CELL: u32 = 1;
const STRUCT: u32 = 2;
const OPAQUE: u32 = 17;
const NUMERIC: std::ops::RangeInclusive<u32> = 6..=15;
/// Flag of complex numbers.
const COMPLEX: u32 = 0x0800;

/// Deepest nesting of structs and cells.
const DEEPEST: usize = 32;

pub(super) fn read<'a>(
    path: &'a Path,
    bytes: &[u8],
    budget: &mut Budget<'a>,
) -> Result<Channels, InputError> {
    let order = match bytes.get(HEADER - 2..HEADER) {
        Some(b"MI") => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let mut file = Bytes::new(path, bytes, order);
    file.take(HEADER as u64, "the header")?;
    let mut reader = Reader {
        path,
        budget,
        channels: Channels::default(),
    };
    while !file.is_empty() {
        let (kind, mut data) = element(&mut file, "a variable")?;
        match kind {
            COMPRESSED => {
                let inflated = reader.budget.inflate(data.rest(), "a variable")?;
                let mut inflated = Bytes::new(path, &inflated, order);
                let (kind, mut data) = element(&mut inflated, "a variable")?;
                if kind == MATRIX {
                    reader.matrix(&mut data, None, 0)?;
                }
            }
            MATRIX => reader.matrix(&mut data, None, 0)?,
            _ => {}
        }
    }
    Ok(reader.channels)
}

/// Type and data of the next element.
fn element<'a>(bytes: &mut Bytes<'a>, what: &str) -> Result<(u32, Bytes<'a>), InputError> {
    let tag = bytes.u32(what)?;
    // Up to 4 bytes stand in the tag itself, with their number in its upper half.
    let small = tag >> 16;
    if small != 0 {
        let data = bytes.part(u64::from(small), what)?;
        bytes.skip(4usize.saturating_sub(small as usize));
        return Ok((tag & 0xffff, data));
    }
    let length = bytes.u32(what)?;
    let data = bytes.part(u64::from(length), what)?;
    if tag != COMPRESSED {
        bytes.skip((length as usize).wrapping_neg() % 8);
    }
    Ok((tag, data))
}

/// An element of text; bytes beyond its first zero do not count.
fn text(bytes: &mut Bytes, what: &str) -> Result<String, InputError> {
    let (_, data) = element(bytes, what)?;
    Ok(text_of(data.rest()))
}

fn text_of(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    let text = bytes.get(..end.unwrap_or(bytes.len()));
    String::from_utf8_lossy(text.unwrap_or_default()).into_owned()
}

/// Longest text that states something, characters.
const LONGEST: usize = 200;

/// The letters of an array of characters: UTF-8, or numbers of 16 bits.
fn characters(kind: u32, bytes: Bytes) -> String {
    match number_type(kind) {
        Some(kind) => (0..(bytes.left() / kind.size()).min(LONGEST))
            .filter_map(|i| char::from_u32(kind.value_at(bytes.rest(), bytes.order, i) as u32))
            .collect(),
        None if kind == 17 => (0..(bytes.left() / 2).min(LONGEST))
            .filter_map(|i| {
                char::from_u32(NumberType::U16.value_at(bytes.rest(), bytes.order, i) as u32)
            })
            .collect(),
        None => text_of(bytes.rest()).chars().take(LONGEST).collect(),
    }
}

fn number_type(kind: u32) -> Option<NumberType> {
    Some(match kind {
        1 => NumberType::I8,
        2 => NumberType::U8,
        3 => NumberType::I16,
        4 => NumberType::U16,
        5 => NumberType::I32,
        6 => NumberType::U32,
        7 => NumberType::F32,
        9 => NumberType::F64,
        12 => NumberType::I64,
        13 => NumberType::U64,
        _ => return None,
    })
}

struct Reader<'a, 'b> {
    path: &'a Path,
    budget: &'b mut Budget<'a>,
    channels: Channels,
}

impl Reader<'_, '_> {
    /// Reads an array, at the given path within a struct or cell, else under its own name.
    fn matrix(
        &mut self,
        bytes: &mut Bytes,
        inner: Option<&str>,
        depth: usize,
    ) -> Result<(), InputError> {
        let what = match inner {
            Some(path) => format!("the variable {}", quote(path)),
            None => "a variable".to_owned(),
        };
        if bytes.is_empty() {
            if let Some(path) = inner {
                self.channels.refuse(path, "an empty array", None);
            }
            return Ok(());
        }
        let (_, mut flags) = element(bytes, &what)?;
        let flags = flags.u32(&what)?;
        let class = flags & 0xff;
        if class == OPAQUE {
            return self.opaque(bytes, inner, &what);
        }
        let (_, mut list) = element(bytes, &what)?;
        let mut dims = Vec::new();
        while !list.is_empty() {
            dims.push(u64::from(list.u32(&what)?));
        }
        let own = text(bytes, &what)?;
        let name = inner.map_or(own, str::to_owned);
        if name.is_empty() {
            // Data of objects, which stand behind the variables.
            return Ok(());
        }
        self.budget.name(&name)?;
        match class {
            CELL => self.cell(bytes, &name, &dims, depth),
            STRUCT => self.structure(bytes, &name, &dims, depth),
            class if NUMERIC.contains(&class) && flags & COMPLEX != 0 => {
                let hint = "save the real samples in time, for instance `real(x)`";
                self.channels.refuse(&name, "complex numbers", Some(hint));
                Ok(())
            }
            class if NUMERIC.contains(&class) => self.numbers(bytes, &name, &dims),
            class => {
                if let (mat_class::CHAR, Ok((kind, letters))) = (class, element(bytes, &what)) {
                    let text = characters(kind, letters);
                    let (group, own) = name.rsplit_once('.').unwrap_or(("", &name));
                    self.channels.state_group(group, own, vec![text]);
                }
                let (content, hint) = mat_class::old(class);
                self.channels.refuse(&name, content, hint);
                Ok(())
            }
        }
    }

    fn numbers(&mut self, bytes: &mut Bytes, name: &str, dims: &[u64]) -> Result<(), InputError> {
        let what = format!("the variable {}", quote(name));
        let &[rows, columns] = dims else {
            let content = format!("an array with {} dimensions", dims.len());
            let hint = "save arrays with two dimensions, for instance `squeeze(x)`";
            self.channels.refuse(name, content, Some(hint));
            return Ok(());
        };
        let (kind, data) = element(bytes, &what)?;
        let Some(kind) = number_type(kind) else {
            let error = self.budget.damaged(&what);
            return Err(error.found(format!("numbers of type {kind}")));
        };
        let stated = rows
            .saturating_mul(columns)
            .saturating_mul(kind.size() as u64);
        if stated != data.left() as u64 {
            let found = format!("{} bytes for {rows} x {columns} numbers", data.left());
            let error = self.budget.damaged(&what).found(found);
            return Err(error.expected(format!("{stated} bytes")));
        }
        let array = Array {
            rows: rows as usize,
            columns: columns as usize,
            column_major: true,
            value: &|i| kind.value_at(data.rest(), data.order, i),
        };
        array.add_to(&mut self.channels, name, self.budget)
    }

    /// Elements of a cell or of a struct: `name.1`, `name.2`, ...
    fn cell(
        &mut self,
        bytes: &mut Bytes,
        name: &str,
        dims: &[u64],
        depth: usize,
    ) -> Result<(), InputError> {
        let count = dims
            .iter()
            .fold(1, |product: u64, n| product.saturating_mul(*n));
        for i in 0..count {
            self.inner(bytes, &format!("{name}.{}", i + 1), depth)?;
        }
        Ok(())
    }

    /// Fields of a struct, `name.field`, or of several, `name.1.field`.
    fn structure(
        &mut self,
        bytes: &mut Bytes,
        name: &str,
        dims: &[u64],
        depth: usize,
    ) -> Result<(), InputError> {
        let what = format!("the struct {}", quote(name));
        let (_, mut length) = element(bytes, &what)?;
        let length = length.u32(&what)? as usize;
        let (_, names) = element(bytes, &what)?;
        let fields: Vec<String> = names.rest().chunks(length.max(1)).map(text_of).collect();
        let count = dims
            .iter()
            .fold(1, |product: u64, n| product.saturating_mul(*n));
        if fields.is_empty() {
            return Ok(());
        }
        for i in 0..count {
            for field in &fields {
                let path = match count {
                    1 => format!("{name}.{field}"),
                    _ => format!("{name}.{}.{field}", i + 1),
                };
                self.inner(bytes, &path, depth)?;
            }
        }
        Ok(())
    }

    /// The next element, an array at `path`.
    fn inner(&mut self, bytes: &mut Bytes, path: &str, depth: usize) -> Result<(), InputError> {
        if depth == DEEPEST {
            return Err(refused::nested(self.path, path, DEEPEST));
        }
        let (kind, mut data) = element(bytes, &format!("the variable {}", quote(path)))?;
        match kind {
            MATRIX => self.matrix(&mut data, Some(path), depth + 1),
            kind => Err(self
                .budget
                .damaged(&format!("the variable {}", quote(path)))
                .found(format!("an element of type {kind}"))
                .expected("an array")),
        }
    }

    /// An object of a class of MATLAB.
    fn opaque(
        &mut self,
        bytes: &mut Bytes,
        inner: Option<&str>,
        what: &str,
    ) -> Result<(), InputError> {
        let own = text(bytes, what)?;
        text(bytes, what)?;
        let class = text(bytes, what)?;
        let name = inner.map_or(own, str::to_owned);
        self.budget.name(&name)?;
        let hint = mat_class::export(self.path, &name, &class);
        let content = mat_class::object(&class);
        self.channels.refuse(&name, content, Some(&hint));
        Ok(())
    }
}
