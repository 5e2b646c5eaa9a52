//! Binary files of data loggers and numerical programs: recognition by the first bytes, and reading into channels.
//!
//! Each file reads one format. A reader compares every length with the bytes that remain before it allocates, and takes memory
//! for numbers from a `Budget`, which bounds what compressed files expand to.

mod array;
mod budget;
mod bytes;
mod clocks;
mod format;
mod hdf5;
mod hdf5_fields;
mod hdf5_guards;
mod hdf5_number;
mod lvm;
mod mat5;
mod mat_class;
mod names;
mod npy;
mod number;
mod recognise;
mod refused;
mod sampling;
mod series;
mod stated;
mod tdms;
mod tdms_meta;
mod tdms_scales;
mod uff;
mod uff_header;
mod wav;
mod zip;

use std::collections::BTreeMap;
use std::path::Path;

use budget::Budget;
pub(crate) use clocks::{align, own_times};
pub use format::Format;
pub(crate) use names::{Meaning, letters, meaning};
pub use recognise::{DATA_EXTENSIONS, has_data_extension, recognise};
pub use sampling::Sampling;
pub(crate) use stated::{Fact, Subject};
pub(crate) use zip::unpacked;

use crate::error::InputError;

/// One variable, array column or channel of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileChannel {
    /// Dotted path in the file, as in `test.force`; unique in the file.
    pub name: String,
    /// Unit as spelt in the file, or derived from its type codes.
    pub unit: Option<String>,
    /// Times of the samples, where the format has them beside the samples.
    pub sampling: Option<Sampling>,
    /// Samples; NaN for a missing one.
    pub values: Vec<f64>,
    /// Scales that the file states and that are not applied.
    pub unapplied: Vec<String>,
    /// Sampling interval that the file states beside times, s.
    pub stated_step: Option<f64>,
    /// Later than the sampling by this fraction of a step, s.
    pub late: f64,
    /// What the file states of the samples.
    pub(crate) stated: Vec<Fact>,
}

/// A variable or channel that holds no samples in time, and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unusable {
    /// Dotted path in the file.
    pub name: String,
    /// Content, as a noun: `complex numbers`.
    pub content: String,
    /// Remedy.
    pub hint: Option<String>,
}

/// Content of a binary file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channels {
    /// Usable channels, in the order of the file.
    pub channels: Vec<FileChannel>,
    /// All others.
    pub unusable: Vec<Unusable>,
    /// Treatment of the samples, a clause each.
    pub notes: Vec<String>,
    /// What the file states of the channels of a group, by its path.
    groups: BTreeMap<String, Vec<Fact>>,
}

impl Channels {
    fn push(
        &mut self,
        name: &str,
        unit: Option<String>,
        sampling: Option<Sampling>,
        values: Vec<f64>,
    ) {
        self.channels.push(FileChannel {
            name: name.to_owned(),
            unit: unit.filter(|unit| !unit.trim().is_empty()),
            sampling,
            values,
            ..FileChannel::default()
        });
    }

    fn refuse(&mut self, name: &str, content: impl Into<String>, hint: Option<&str>) {
        self.unusable.push(Unusable {
            name: name.to_owned(),
            content: content.into(),
            hint: hint.map(str::to_owned),
        });
    }
}

/// Reads a file of a given format; messages name `path`.
///
/// # Errors
/// When the file is truncated or damaged, states lengths that it does not have, expands beyond the limits of `Budget` or the
/// available memory, or is of a kind that is refused as a whole.
pub fn read(path: &Path, bytes: &[u8], format: Format) -> Result<Channels, InputError> {
    let mut budget = Budget::new(path, bytes.len());
    let mut channels = match format {
        Format::Npy => npy::read(path, bytes, &mut budget),
        Format::Npz => zip::read(path, bytes, &mut budget),
        Format::Wav => wav::read(path, bytes, &mut budget),
        Format::Uff => uff::read(path, bytes, &mut budget),
        Format::Mat5 => mat5::read(path, bytes, &mut budget),
        Format::Mat73 | Format::Hdf5 => hdf5::read(path, bytes, format, &mut budget),
        Format::Tdms => tdms::read(path, bytes, &mut budget),
        Format::Lvm => lvm::read(path, bytes, &mut budget),
        Format::Series => series::read(path, bytes, &mut budget),
        other => Err(refused::whole(path, other)),
    }?;
    channels.apply_statements(matches!(format, Format::Mat73 | Format::Hdf5));
    rename_repeated(&mut channels.channels);
    if channels.channels.is_empty() {
        return Err(refused::nothing(path, format, &channels.unusable));
    }
    Ok(channels)
}

/// Makes names unique: the second `force` becomes `force.2`.
fn rename_repeated(channels: &mut [FileChannel]) {
    let mut counts = BTreeMap::<String, usize>::new();
    let mut taken: std::collections::BTreeSet<String> =
        channels.iter().map(|c| c.name.clone()).collect();
    for channel in channels {
        let count = counts.entry(channel.name.clone()).or_default();
        *count += 1;
        while *count > 1 {
            let name = format!("{}.{count}", channel.name);
            if taken.insert(name.clone()) {
                channel.name = name;
                break;
            }
            *count += 1;
        }
    }
}

/// The last part of a dotted path that is no number: `force` for `test.force` and `test.force.2`.
pub fn last_part(path: &str) -> &str {
    let is_number = |part: &&str| part.bytes().all(|b| b.is_ascii_digit());
    let mut parts = path.rsplit('.').skip_while(is_number);
    parts.next().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_parts_are_names() {
        for (path, last) in [
            ("test.force", "force"),
            ("test.2.force.1", "force"),
            ("force", "force"),
            ("1.2", "1.2"),
            ("", ""),
        ] {
            assert_eq!(last_part(path), last, "{path}");
        }
    }

    #[test]
    fn repeated_names_become_unique() {
        let mut channels = Channels::default();
        for name in ["a", "a", "a.2", "a", "b"] {
            channels.push(name, None, None, vec![0.0]);
        }
        rename_repeated(&mut channels.channels);
        let names: Vec<&str> = channels.channels.iter().map(|c| &*c.name).collect();
        assert_eq!(names, ["a", "a.3", "a.2", "a.4", "b"]);
    }
}
