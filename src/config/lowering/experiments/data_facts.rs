//! Facts about the data of a record and what was done with them: repeated times, gaps, dropouts, spikes, saturation, quantisation and delays.

use crate::config::ModelFile;
use crate::error::InputError;
use crate::tables::{Table, TableFormat};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::number_format::{count as counted, significant};
use serde::Serialize;
use serde_json::Value;
use std::rc::Rc;

/// Most places that a fact lists.
pub const MOST_PATHS: usize = 1000;
/// Most places in a sentence.
const IN_WORDS: usize = 3;

/// Notes on the records of a model: warnings, and facts about the data.
#[derive(Debug, Default)]
pub struct RecordNotes {
    /// Warnings.
    pub warnings: Vec<Finding>,
    /// What was found in the data and done with it.
    pub data: Vec<Finding>,
    /// The file that was read last: its channels follow each other.
    last_file: Option<(String, TableFormat, Rc<[Table]>)>,
}

impl RecordNotes {
    /// The tables of a data file, by its name in the model; it is read once for columns that follow each other.
    ///
    /// # Errors
    /// As [`Table::read_all`].
    pub fn tables(
        &mut self,
        file: &ModelFile,
        name: &str,
        format: &TableFormat,
    ) -> Result<Rc<[Table]>, InputError> {
        if let Some((last, of, tables)) = &self.last_file
            && last == name
            && of == format
        {
            return Ok(Rc::clone(tables));
        }
        self.close_file();
        let tables: Rc<[Table]> = file.tables(name, format)?.into();
        self.last_file = Some((name.to_owned(), *format, Rc::clone(&tables)));
        Ok(tables)
    }

    /// Frees the tables of the last file.
    pub fn close_file(&mut self) {
        self.last_file = None;
    }

    /// Adds a fact, unless another channel of the same file has stated it.
    pub fn state(&mut self, experiment: &str, fact: Finding) {
        let sentence = format!("{experiment}: {}", fact.sentence);
        let fact = Finding { sentence, ..fact }.with("experiment", experiment);
        if !self.data.contains(&fact) {
            self.data.push(fact);
        }
    }
}

/// What was done with samples: its name, and in words.
pub type Action = (&'static str, &'static str);
pub const USED: Action = ("used", "used as they are");
pub const EXCLUDED: Action = ("excluded", "left out");
pub const MERGED: Action = ("merged", "equal in every column, merged");
pub const FIRST: Action = ("first", "the first row of each time is used");
pub const MEAN: Action = ("mean", "the mean of the rows of each time is used");
pub const MISSING: Action = ("missing", "treated as missing samples");
pub const INTERPOLATED: Action = ("interpolated", "interpolated");
/// The variance of a quantisation error in that of a stated sigma, and its standard deviation as the smallest of an estimated one.
pub const ADDED_TO_SIGMA: Action = (
    "added_to_sigma",
    "its variance, step^2/12, is added to that of sigma",
);
pub const LEAST_SIGMA: Action = (
    "least_sigma",
    "an estimated sigma is at least step/sqrt(12)",
);

/// A fact about the data of one experiment, and what was done. Times are those of the file, s; values are in the unit of the column.
pub fn fact(kind: &str, text: &str, action: Action, quantities: Value) -> Finding {
    let (name, words) = action;
    let fact = Finding::having(kind, format!("{text}: {words}"), quantities).with("action", name);
    let severity = match action == USED {
        true => Severity::Detail,
        false => Severity::Note,
    };
    Finding { severity, ..fact }
}

/// A gap in the times of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GapLocation {
    /// Last sample before the gap, s.
    pub from: f64,
    /// First sample after it, s.
    pub to: f64,
    /// Number of samples that it would have.
    pub samples: usize,
}

/// A time, s.
pub fn time(t: f64) -> String {
    significant(t, 6)
}

/// The first gaps of all.
pub fn gaps_in_words(positions: &[GapLocation], count: usize) -> String {
    let each = positions.iter().take(IN_WORDS).map(|gap| {
        let (from, to) = (time(gap.from), time(gap.to));
        let length = significant(gap.to - gap.from, 3);
        format!(
            "{from} to {to} s ({length} s, {})",
            counted(gap.samples, "sample")
        )
    });
    listed(each.collect(), count)
}

/// The first spans of all.
pub fn spans_in_words(positions: &[[f64; 2]]) -> String {
    let each = positions.iter().take(IN_WORDS);
    let each = each.map(|[from, to]| format!("{} to {} s", time(*from), time(*to)));
    listed(each.collect(), positions.len())
}

/// The first times of all.
pub fn times_in_words(positions: &[f64], count: usize) -> String {
    listed(
        positions.iter().take(IN_WORDS).map(|t| time(*t)).collect(),
        count,
    )
}

fn listed(each: Vec<String>, count: usize) -> String {
    let more = count.saturating_sub(each.len());
    match more {
        0 => each.join(", "),
        _ => format!("{} and {more} more", each.join(", ")),
    }
}
