//! Files of HDF5, and with it of MATLAB 7.3: groups, structs and cells by dotted path.
//!
//! Read are superblocks of versions 0 to 3 behind a user block, groups with symbol tables or links in their header, and data sets of
//! integers and floating point that are compact, contiguous or in chunks listed by a B-tree of version 1, with the filters deflate,
//! shuffle and Fletcher 32. Reference: The HDF Group, "HDF5 File Format Specification", version 3.0.

mod chunks;
mod data_type;
mod dataset;
mod file;
mod filters;
mod group;
mod object;

use std::path::Path;

use super::budget::Budget;
use super::{Channels, Format, mat_class, refused};
use crate::error::InputError;
use file::File;
pub(super) use file::SIGNATURE;
use group::Members;
use object::Object;

/// Deepest nesting of groups and cells.
const DEEPEST: usize = 32;
/// Groups of MATLAB with the targets of references and the data of objects.
const INTERNAL: [&str; 2] = ["#refs#", "#subsystem#"];
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
    let file = File::open(path, bytes)?;
    let mut reader = Reader {
        path,
        format,
        file: &file,
        budget,
        channels: Channels::default(),
    };
    reader.object(file.root, "", 0)?;
    Ok(reader.channels)
}

struct Reader<'a, 'b> {
    path: &'a Path,
    format: Format,
    file: &'b File<'b>,
    budget: &'b mut Budget<'a>,
    channels: Channels,
}

impl Reader<'_, '_> {
    /// Reads the group or data set whose header is at an address, under a dotted path; that of the root group is empty.
    fn object(&mut self, address: u64, name: &str, depth: usize) -> Result<(), InputError> {
        if depth > DEEPEST {
            return Err(refused::nested(self.path, name, DEEPEST));
        }
        let object = Object::read(self.file, address)?;
        let class = object.text(self.file, "MATLAB_class")?;
        if let Some(class) = class.as_deref()
            && !(NUMERIC.contains(&class) || ["struct", "cell"].contains(&class))
        {
            self.refuse_class(name, class);
            return Ok(());
        }
        if object.has_attribute(self.file, "MATLAB_sparse")? {
            let (content, hint) = mat_class::old(mat_class::SPARSE);
            self.channels.refuse(name, content, hint);
            return Ok(());
        }
        if group::is_group(&object) {
            return self.group(&object, name, depth);
        }
        self.dataset(&object, class.as_deref(), name, depth)
    }

    fn refuse_class(&mut self, name: &str, class: &str) {
        let (content, hint) = match class {
            "char" => mat_class::old(mat_class::CHAR),
            "function_handle" => mat_class::old(mat_class::FUNCTION),
            class => {
                let hint = mat_class::export(self.path, name, class);
                let content = mat_class::object(class);
                return self.channels.refuse(name, content, Some(&hint));
            }
        };
        self.channels.refuse(name, content, hint);
    }

    fn group(&mut self, object: &Object, name: &str, depth: usize) -> Result<(), InputError> {
        match group::members(self.file, object, name, self.budget)? {
            Members::Dense => {
                let name = if name.is_empty() { "/" } else { name };
                let content = "a group with a dense index of its members";
                self.refuse_new(name, content);
            }
            Members::Listed(members) => {
                for (own, address) in members {
                    if !(name.is_empty() && INTERNAL.contains(&own.as_str())) {
                        self.object(address, &joined(name, &own), depth + 1)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Refuses a structure of newer versions of HDF5, with the way to write an older one.
    fn refuse_new(&mut self, name: &str, content: &str) {
        let hint = match self.format {
            Format::Mat73 => mat_class::save_as_version_7(self.path),
            _ => "in Python: write it with `h5py.File(file, 'w', libver='earliest')`".to_owned(),
        };
        self.channels.refuse(name, content, Some(&hint));
    }
}

/// Dotted path of a member of a group.
fn joined(group: &str, own: &str) -> String {
    match group {
        "" => own.to_owned(),
        group => format!("{group}.{own}"),
    }
}
