//! Files of HDF5, and with it of netCDF-4 and MATLAB 7.3: groups, structs, cells and tables by dotted path.
//!
//! `hdf5-pure` finds the bytes; their numbers are converted here, since its own conversion leaves samples out without a word. Chunks
//! that were never written are missing samples, and what the file states of counts (`scale_factor`, `add_offset`, `_FillValue`) is
//! applied.

use std::collections::BTreeSet;
use std::path::Path;

use hdf5_pure::{AttrValue, Dataset, File, Group, Layout, Object};

use super::array::Array;
use super::budget::{Budget, damaged};
use super::hdf5_fields::{
    Attributes, Unread, content, fields, is_text, numbers, one_line, statements,
};
use super::hdf5_guards::{Missing, remove_soft_links};
use super::{Channels, Format, mat_class, refused};
use crate::error::InputError;
use crate::text_io::quote;

/// First bytes of a file without a block of the user's.
pub(super) const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Value of floating-point samples of netCDF that were never written.
const FILL: f64 = 9.969_209_968_386_869e36;
/// Longest text that states something, bytes.
const LONGEST: u64 = 1000;
/// Deepest nesting of groups and cells: hard links can form circles.
const DEEPEST: usize = 32;
/// Beginnings of groups of MATLAB with the targets of references and the data of objects, and of PyTables with the orders of columns.
const INTERNAL: [&str; 3] = ["#refs#", "#subsystem#", "_i_"];
/// Classes of MATLAB whose data are numbers.
const NUMERIC: [&str; 11] = [
    "double", "single", "logical", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32",
    "uint64",
];

pub(super) fn read<'a>(
    path: &'a Path,
    bytes: &[u8],
    format: Format,
    budget: &mut Budget<'a>,
) -> Result<Channels, InputError> {
    let mut own = bytes.to_vec();
    remove_soft_links(&mut own);
    let file = File::from_bytes(own)
        .map_err(|error| damaged(path, "its structure").found(one_line(&error)))?;
    let mut reader = Reader {
        path,
        format,
        budget,
        channels: Channels::default(),
    };
    reader.members(&file.root(), "", 0)?;
    Ok(reader.channels)
}

struct Reader<'a, 'b> {
    path: &'a Path,
    format: Format,
    budget: &'b mut Budget<'a>,
    channels: Channels,
}

/// What MATLAB says of a variable.
struct Class<'a> {
    name: Option<&'a str>,
    is_empty: bool,
}

impl Reader<'_, '_> {
    /// All members of a group, in the order of their names.
    fn members(&mut self, group: &Group, name: &str, depth: usize) -> Result<(), InputError> {
        if depth > DEEPEST {
            return Err(refused::nested(self.path, name, DEEPEST));
        }
        for (own, values) in statements(&group.attrs().unwrap_or_default()) {
            self.channels.state_group(name, own, values);
        }
        let members = match listed(group) {
            Ok(members) => members,
            Err(error) => {
                let name = if name.is_empty() { "/" } else { name };
                return self.report(name, Unread::from(error));
            }
        };
        for (own, member) in members {
            if !INTERNAL.iter().any(|internal| own.starts_with(internal)) {
                let path = joined(name, &own);
                self.budget.name(&path)?;
                self.object(&member, &path, depth)?;
            }
        }
        Ok(())
    }

    fn object(&mut self, object: &Object, name: &str, depth: usize) -> Result<(), InputError> {
        let attributes = match object {
            Object::Dataset(set) => set.attrs(),
            Object::Group(group) => group.attrs(),
            _ => return Ok(()),
        };
        let attributes = match attributes {
            Ok(attributes) => attributes,
            Err(error) => return self.report(name, Unread::from(error)),
        };
        let class = Class {
            name: attributes.get("MATLAB_class").and_then(AttrValue::as_str),
            is_empty: attributes.contains_key("MATLAB_empty"),
        };
        match class.name {
            Some("char") => {
                if let Object::Dataset(set) = object {
                    self.state_text(set, name);
                }
                return self.old_class(name, mat_class::CHAR);
            }
            Some("function_handle") => return self.old_class(name, mat_class::FUNCTION),
            Some(class) if !(NUMERIC.contains(&class) || ["struct", "cell"].contains(&class)) => {
                let hint = mat_class::export(self.path, name, class);
                let content = mat_class::object(class);
                self.channels.refuse(name, content, Some(&hint));
                return Ok(());
            }
            _ => {}
        }
        if attributes.contains_key("MATLAB_sparse") {
            return self.old_class(name, mat_class::SPARSE);
        }
        match object {
            Object::Group(group) => self.members(group, name, depth + 1),
            Object::Dataset(set) => match self.dataset(set, &attributes, &class, name, depth) {
                Ok(()) => Ok(()),
                Err(unread) => self.report(name, unread),
            },
            _ => Ok(()),
        }
    }

    /// States a short text: a data set of texts, or of the letters of MATLAB.
    fn state_text(&mut self, set: &Dataset, name: &str) {
        let count = set.shape().map_or(u64::MAX, |shape| shape.iter().product());
        let size = set.element_size().unwrap_or(u64::MAX);
        if count.saturating_mul(size) > LONGEST {
            return;
        }
        let texts = match set.datatype() {
            Ok(kind) if is_text(&kind) => set.read_string().unwrap_or_default(),
            _ => {
                let letters = set.read_raw().unwrap_or_default();
                let pairs = letters
                    .chunks_exact(2)
                    .map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
                vec![String::from_utf16_lossy(&pairs.collect::<Vec<_>>())]
            }
        };
        let (group, own) = name.rsplit_once('.').unwrap_or(("", name));
        self.channels.state_group(group, own, texts);
    }

    fn old_class(&mut self, name: &str, class: u32) -> Result<(), InputError> {
        let (content, hint) = mat_class::old(class);
        self.channels.refuse(name, content, hint);
        Ok(())
    }

    /// Lists an object as unusable.
    fn report(&mut self, name: &str, unread: Unread) -> Result<(), InputError> {
        match unread {
            Unread::File(error) => return Err(error),
            Unread::Content(content, hint) => self.channels.refuse(name, content, hint),
            Unread::Library(error) => {
                let hint = match self.format {
                    Format::Mat73 => mat_class::save_as_version_7(self.path),
                    _ => "in Python: write it with `h5py.File(file, 'w', libver='earliest')`"
                        .to_owned(),
                };
                let content = format!("data that cannot be read ({error})");
                self.channels.refuse(name, content, Some(&hint));
            }
        }
        Ok(())
    }

    fn dataset(
        &mut self,
        set: &Dataset,
        attributes: &Attributes,
        class: &Class,
        name: &str,
        depth: usize,
    ) -> Result<(), Unread> {
        let kind = set.datatype()?;
        if is_text(&kind) {
            self.state_text(set, name);
        }
        let shape = set.shape()?;
        let fields = fields(&kind)?;
        if class.is_empty || shape.contains(&0) {
            return Err(content("an empty array", None));
        }
        let [rows, columns] = match *shape {
            [] => [1, 1],
            [n] => [1, n],
            [rows, columns] => [rows, columns],
            _ => {
                let noun = format!("an array with {} dimensions", shape.len());
                let hint = "save arrays with two dimensions, for instance `squeeze(x)`";
                return Err(Unread::Content(noun, Some(hint)));
            }
        }
        .map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let size = usize::try_from(set.element_size()?).unwrap_or(usize::MAX);
        let length = rows.saturating_mul(columns).saturating_mul(size);
        let what = format!("the variable {}", quote(name));
        self.budget.expand(length, &what)?;
        let missing = self.missing(set, &shape, size, &what)?;
        let Some(fields) = fields else {
            return Ok(self.references(
                set.dereference()?,
                class.name == Some("cell"),
                name,
                depth,
            )?);
        };
        let bytes = set.read_raw()?;
        if bytes.len() != length || size == 0 {
            return Err(Unread::Library(format!(
                "{} bytes in place of {length}",
                bytes.len()
            )));
        }
        let mut fill = vec![FILL];
        for key in ["_FillValue", "missing_value"] {
            fill.extend(attributes.get(key).map(numbers).unwrap_or_default());
        }
        let unsigned = attributes.get("_Unsigned").and_then(AttrValue::as_str) == Some("true");
        let before = self.channels.channels.len();
        for (field, number, at) in &fields {
            let value = |i: usize| {
                let own = bytes.get(i * size + at..).unwrap_or_default();
                let value = number.value(own);
                if fill.contains(&value) || missing.contains([i / columns, i % columns]) {
                    return f64::NAN;
                }
                match unsigned && value < 0.0 {
                    true => value + 256f64.powi(number.size as i32),
                    false => value,
                }
            };
            // MATLAB states columns before rows: these are the adjacent elements.
            let is_matlab = class.name.is_some();
            let array = Array {
                rows: if is_matlab { columns } else { rows },
                columns: if is_matlab { rows } else { columns },
                column_major: is_matlab,
                value: &value,
            };
            let name = match field {
                Some(field) => joined(name, field),
                None => name.to_owned(),
            };
            array.add_to(&mut self.channels, &name, self.budget)?;
        }
        // One value for the fields of a table is as one of a group.
        let is_table = matches!(&*fields, [(Some(_), ..), ..]);
        for (own, values) in statements(attributes) {
            match is_table && values.len() == 1 && !own.starts_with("FIELD_") {
                true => self.channels.state_group(name, own, values),
                false => self.channels.state(before, own, values),
            }
        }
        Ok(())
    }

    /// The chunks of a data set that were never written.
    fn missing(
        &mut self,
        set: &Dataset,
        shape: &[u64],
        size: usize,
        what: &str,
    ) -> Result<Missing, Unread> {
        let unwritten = || content("an array that was never written", None);
        let chunk = match set.layout()? {
            Layout::Contiguous { address: None, .. } => return Err(unwritten()),
            Layout::Chunked { chunk_shape, .. } => chunk_shape,
            _ => return Ok(Missing::default()),
        };
        let written = set.chunks()?;
        if written.is_empty() {
            return Err(unwritten());
        }
        let chunk: Vec<u64> = chunk.iter().copied().take(shape.len()).collect();
        if chunk.len() != shape.len() || chunk.contains(&0) {
            return Err(Unread::Library("chunks without elements".to_owned()));
        }
        let product = |lengths: &mut dyn Iterator<Item = u64>| lengths.fold(1, u64::saturating_mul);
        // Each chunk is expanded whole.
        let expanded = product(&mut chunk.iter().copied())
            .saturating_mul(size as u64)
            .saturating_mul(written.len() as u64);
        let expanded = usize::try_from(expanded).unwrap_or(usize::MAX);
        self.budget.expand(expanded, what)?;
        let counts = shape
            .iter()
            .zip(&chunk)
            .map(|(n, chunk)| n.div_ceil(*chunk));
        let all = product(&mut counts.clone());
        let location = |offset: &[u64]| {
            let mut numbers = offset.iter().zip(&chunk).map(|(from, chunk)| from / chunk);
            let last = |numbers: &mut dyn DoubleEndedIterator<Item = u64>| numbers.next_back();
            let column = last(&mut numbers).unwrap_or(0);
            [last(&mut numbers).unwrap_or(0) as usize, column as usize]
        };
        let written: BTreeSet<[usize; 2]> = written.iter().map(|c| location(&c.offset)).collect();
        if written.len() as u64 == all {
            return Ok(Missing::default());
        }
        let width = |from_end: usize| {
            let location = chunk.len().checked_sub(from_end);
            location
                .and_then(|i| chunk.get(i))
                .map_or(1, |n| *n as usize)
        };
        Ok(Missing {
            written: Some(written),
            chunk: [width(2), width(1)],
        })
    }

    /// Objects that a cell, `name.1`, or a field of several structs, `struct.1.field`, refers to.
    fn references(
        &mut self,
        objects: Vec<Object>,
        is_cell: bool,
        name: &str,
        depth: usize,
    ) -> Result<(), InputError> {
        if depth > DEEPEST {
            return Err(refused::nested(self.path, name, DEEPEST));
        }
        for (i, object) in objects.iter().enumerate() {
            let path = match name.rsplit_once('.') {
                Some((group, field)) if !is_cell => format!("{group}.{}.{field}", i + 1),
                _ => joined(name, &(i + 1).to_string()),
            };
            self.budget.name(&path)?;
            self.object(object, &path, depth + 1)?;
        }
        Ok(())
    }
}

/// The members of a group in the order of their names.
fn listed(group: &Group) -> Result<Vec<(String, Object)>, hdf5_pure::Error> {
    let sets = group.iter_datasets()?;
    let sets = sets.map(|(own, set)| (own, Object::Dataset(Box::new(set))));
    let groups = group.iter_groups()?;
    let groups = groups.map(|(own, group)| (own, Object::Group(group)));
    let mut members: Vec<_> = sets.chain(groups).collect();
    members.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(members)
}

/// Dotted path of a member of a group.
fn joined(group: &str, own: &str) -> String {
    match group {
        "" => own.to_owned(),
        group => format!("{group}.{own}"),
    }
}
