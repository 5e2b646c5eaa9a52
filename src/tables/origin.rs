//! Source of a table, text or the channels of a binary file, and its columns.

use std::sync::Arc;

use super::format::Detected;
use crate::clock::Clock;
use crate::error::InputError;
use crate::formats::{Format, Sampling, Unusable};

/// Source of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    /// A text file of this format.
    Text(Detected),
    /// Channels of a binary file.
    Channels(ChannelOrigin),
}

/// Samples of a column, NaN if missing, up to the first invalid field.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ColumnValues {
    pub samples: Vec<f64>,
    /// The first field that is not a finite number.
    pub unnumbered: Option<InputError>,
    /// The first field that is neither a finite number nor missing.
    pub unreadable: Option<InputError>,
    /// Scales that the file states and that are not applied.
    pub unapplied: Vec<String>,
    /// Of times of day or dates: the first.
    pub clock: Option<Clock>,
    /// True where a date with slashes has the other order.
    pub has_other_dates: bool,
    /// Later than the times of the table by this fraction of a step, s.
    pub late: f64,
}

/// The channels of a file.
#[derive(Debug, PartialEq)]
pub(super) struct ChannelFile {
    pub format: Format,
    /// Names of all usable channels, in the order of the file, and the index of the set of each.
    pub names: Vec<(String, usize)>,
    /// Number of samples and sampling of each set.
    pub sets: Vec<(usize, Option<Sampling>)>,
    pub unusable: Vec<Unusable>,
    pub notes: Vec<String>,
}

/// Source of a table of channels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChannelOrigin {
    pub file: Arc<ChannelFile>,
    pub set: usize,
    /// Number of each column in the file, from 1; 0 for times made from a sampling rate or interval.
    pub numbers: Vec<usize>,
}

impl ChannelOrigin {
    pub fn format(&self) -> Format {
        self.file.format
    }
}
