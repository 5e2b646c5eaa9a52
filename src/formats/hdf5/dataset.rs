//! Data sets: dimensions, storage, and their elements as channels or references.

use std::borrow::Cow;

use super::super::array::Array;
use super::super::bytes::Bytes;
use super::super::number::ByteOrder;
use super::chunks::Chunked;
use super::data_type::{Content, DataType};
use super::filters;
use super::object::{DATA_SPACE, DATA_TYPE, FILTERS, LAYOUT, Object};
use super::{Reader, joined};
use crate::error::InputError;
use crate::text_io::quote;

/// Elements, or the reason why they are not read.
enum Elements<'a> {
    Bytes(Cow<'a, [u8]>),
    Refused(String),
    /// A structure of newer versions of HDF5.
    New(&'static str),
}

impl<'b> Reader<'_, 'b> {
    /// A data set, of a class of MATLAB.
    pub(super) fn dataset(
        &mut self,
        object: &Object<'b>,
        class: Option<&str>,
        name: &str,
        depth: usize,
    ) -> Result<(), InputError> {
        let what = format!("the variable {}", quote(name));
        let parts = (
            object.first(DATA_SPACE),
            object.first(DATA_TYPE),
            object.first(LAYOUT),
        );
        let (Some(space), Some(mut kind), Some(layout)) = parts else {
            self.channels
                .refuse(name, "an object without data of its own", None);
            return Ok(());
        };
        let kind = DataType::read(self.file, &mut kind)?;
        let is_empty = object.has_attribute(self.file, "MATLAB_empty")?;
        let dims = dimensions(self, space, &what)?;
        let hint = match kind.content {
            Content::Text => return self.unusable(name, "texts", None),
            Content::Other(content) => return self.unusable(name, content, None),
            Content::Complex => {
                let hint = "save the real samples in time, for instance `real(x)`";
                return self.unusable(name, "complex numbers", Some(hint));
            }
            Content::Number(..) | Content::Reference => {
                "save arrays with two dimensions, for instance `squeeze(x)`"
            }
        };
        let Some(dims) = dims.filter(|dims| !is_empty && !dims.contains(&0)) else {
            return self.unusable(name, "an empty array", None);
        };
        let (rank, dims) = match *dims {
            [] => (0, [1, 1]),
            [n] => (1, [1, n]),
            [rows, columns] => (2, [rows, columns]),
            _ => {
                let content = format!("an array with {} dimensions", dims.len());
                return self.unusable(name, &content, Some(hint));
            }
        };
        let bytes = match self.elements(object, layout, rank, dims, kind.size, &what)? {
            Elements::Bytes(bytes) => bytes,
            Elements::Refused(content) => return self.unusable(name, &content, None),
            Elements::New(content) => {
                self.refuse_new(name, content);
                return Ok(());
            }
        };
        match kind.content {
            Content::Number(number, order) => {
                let unit = match object.text(self.file, "units")? {
                    Some(unit) => Some(unit),
                    None => object.text(self.file, "unit")?,
                };
                let first = self.channels.channels.len();
                // MATLAB states columns before rows: these are the adjacent elements.
                let is_matlab = class.is_some();
                let [rows, columns] = if is_matlab { [dims[1], dims[0]] } else { dims };
                let array = Array {
                    bytes: &bytes,
                    kind: number,
                    order,
                    rows,
                    columns,
                    column_major: is_matlab,
                };
                array.add_to(&mut self.channels, name, None, self.budget)?;
                for channel in self.channels.channels.iter_mut().skip(first) {
                    channel.unit = unit.clone();
                }
                Ok(())
            }
            _ => self.references(&bytes, kind.size, class == Some("cell"), name, depth),
        }
    }

    fn unusable(
        &mut self,
        name: &str,
        content: &str,
        hint: Option<&str>,
    ) -> Result<(), InputError> {
        self.channels.refuse(name, content, hint);
        Ok(())
    }

    /// Objects that a cell, `name.1`, or a field of several structs, `struct.1.field`, refers to.
    fn references(
        &mut self,
        bytes: &[u8],
        size: usize,
        is_cell: bool,
        name: &str,
        depth: usize,
    ) -> Result<(), InputError> {
        for (i, reference) in bytes.chunks_exact(size.max(1)).enumerate() {
            let path = match name.rsplit_once('.') {
                Some((group, field)) if !is_cell => format!("{group}.{}.{field}", i + 1),
                _ => joined(name, &(i + 1).to_string()),
            };
            self.budget.name(&path)?;
            let what = "a reference";
            let mut reference = Bytes::new(self.path, reference, ByteOrder::Little);
            let address = self.file.address(&mut reference, what)?;
            match address == 0 {
                true => self.channels.refuse(&path, "an empty array", None),
                false => self.object(address, &path, depth + 1)?,
            }
        }
        Ok(())
    }

    /// The bytes of all elements, in the order of rows.
    fn elements(
        &mut self,
        object: &Object<'b>,
        mut layout: Bytes<'b>,
        rank: usize,
        dims: [usize; 2],
        size: usize,
        what: &str,
    ) -> Result<Elements<'b>, InputError> {
        const UNWRITTEN: &str = "an array of which a part was never written";
        let stated = dims[0].saturating_mul(dims[1]).saturating_mul(size);
        let version = layout.uint(1, what)?;
        let class = layout.uint(1, what)?;
        let bytes = match (version, class) {
            (3 | 4, 0) => {
                let length = layout.uint(2, what)?;
                layout.take(length, what)?
            }
            (3 | 4, 1) => {
                let address = self.file.address(&mut layout, what)?;
                if self.file.is_undefined(address) {
                    return Ok(Elements::Refused(UNWRITTEN.to_owned()));
                }
                let length = self.file.length(&mut layout, what)?;
                self.file.at(address, what)?.take(length, what)?
            }
            (3, 2) => {
                let filters = match object.first(FILTERS) {
                    Some(message) => filters::list(message)?,
                    None => Vec::new(),
                };
                if let Some(content) = filters::refused(&filters) {
                    return Ok(Elements::Refused(content));
                }
                let count = layout.uint(1, what)?;
                let tree = self.file.address(&mut layout, what)?;
                if count != rank as u64 + 1 {
                    let found = format!("chunks with {count} dimensions");
                    let error = self.file.damaged(what).found(found);
                    return Err(error.expected(format!("{}", rank + 1)));
                }
                let mut chunk = [1; 2];
                for side in chunk.iter_mut().skip(2 - rank) {
                    *side = layout.uint(4, what)? as usize;
                }
                let chunked = Chunked {
                    tree,
                    dims,
                    chunk,
                    rank,
                    size,
                    filters: &filters,
                    what,
                };
                return Ok(match chunked.read(self.file, self.budget)? {
                    Some(bytes) => Elements::Bytes(Cow::Owned(bytes)),
                    None => Elements::Refused(UNWRITTEN.to_owned()),
                });
            }
            (4, 2) => return Ok(Elements::New("data with a newer index of their chunks")),
            _ => {
                return Ok(Elements::Refused(format!(
                    "data stored by layout {version}.{class}"
                )));
            }
        };
        if bytes.len() == stated {
            return Ok(Elements::Bytes(Cow::Borrowed(bytes)));
        }
        let [rows, columns] = dims;
        let found = format!("{} bytes for {rows} x {columns} elements", bytes.len());
        let error = self.file.damaged(what).found(found);
        Err(error.expected(format!("{stated} bytes")))
    }
}

/// Dimensions of a data set; `None` for one that has no elements by definition.
fn dimensions(
    reader: &Reader,
    mut space: Bytes,
    what: &str,
) -> Result<Option<Vec<usize>>, InputError> {
    let version = space.uint(1, what)?;
    let rank = space.uint(1, what)?;
    space.skip(1);
    let kind = space.uint(1, what)?;
    space.skip(if version == 1 { 4 } else { 0 });
    if version > 1 && kind == 2 {
        return Ok(None);
    }
    let mut dims = Vec::new();
    for _ in 0..rank {
        let dim = reader.file.length(&mut space, what)?;
        dims.push(usize::try_from(dim).unwrap_or(usize::MAX));
    }
    Ok(Some(dims))
}
