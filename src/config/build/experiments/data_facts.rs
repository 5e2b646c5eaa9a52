//! Facts about the data of a record and what was done with them: repeated times, gaps, dropouts, spikes, saturation, quantisation and delays.

use crate::config::ModelFile;
use crate::error::InputError;
use crate::finding::Finding;
use crate::number_format::significant;
use crate::tables::{Table, TableFormat, lines_in_words};
use serde::Serialize;
use std::rc::Rc;
use thiserror::Error;

/// Most places that a fact lists.
pub const MOST_PLACES: usize = 1000;
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
    pub fn state(&mut self, experiment: &str, fact: &DataFact) {
        let text = format!("{experiment}: {fact}");
        let finding = Finding::of(fact, text).with("experiment", experiment);
        if !self.data.contains(&finding) {
            self.data.push(finding);
        }
    }
}

/// What was done with faulty samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DataAction {
    /// Used as they are.
    Used,
    /// Left out of the fit.
    Excluded,
    /// Equal rows were merged.
    Merged,
    /// The first of the rows is used.
    First,
    /// The mean of the rows is used.
    Mean,
    /// Treated as missing samples.
    Missing,
    /// The input is interpolated across the gap.
    Interpolated,
    /// Its variance was added to that of the stated sigma.
    AddedToSigma,
    /// Its standard deviation is the smallest one of an estimated sigma.
    LeastSigma,
    /// Times were shifted.
    Shifted,
}

impl DataAction {
    fn words(self) -> &'static str {
        match self {
            Self::Used => "used as they are",
            Self::Excluded => "left out",
            Self::Merged => "equal in every column, merged",
            Self::First => "the first row of each time is used",
            Self::Mean => "the mean of the rows of each time is used",
            Self::Missing => "treated as missing samples",
            Self::Interpolated => "interpolated",
            Self::AddedToSigma => "its variance, step^2/12, is added to that of sigma",
            Self::LeastSigma => "an estimated sigma is at least step/sqrt(12)",
            Self::Shifted => "shifted",
        }
    }
}

/// A gap in the times of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GapPlace {
    /// Last sample before the gap, s.
    pub from: f64,
    /// First sample after it, s.
    pub to: f64,
    /// Number of samples that it would have.
    pub samples: usize,
}

/// A fact about the data of one experiment. Times are those of the file, s; values are in the unit of the column.
#[derive(Debug, Clone, PartialEq, Serialize, Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DataFact {
    /// Rows that repeat a time.
    #[error("{count} {} a time ({}): {}", if *count == 1 { "row repeats" } else { "rows repeat" }, lines_in_words(lines, *count), action.words())]
    RepeatedTimes {
        count: usize,
        lines: Vec<usize>,
        action: DataAction,
    },
    /// Times that are equally spaced but for the rounding of their printed digits.
    #[error("times printed with {digits} decimals: taken as equally spaced, at {} Hz", significant(*rate, 9))]
    RoundedTimes { digits: usize, rate: f64 },
    /// Treatment of a file when it is read: common times, units of clocks, lines that are left out.
    #[error("{text}")]
    File { text: String },
    /// Gaps in the times or samples of a channel.
    #[error("{} in the {channel}, {}: {}", counted(*count, "gap"), gaps_in_words(places, *count), action.words())]
    Gaps {
        channel: String,
        count: usize,
        places: Vec<GapPlace>,
        action: DataAction,
    },
    /// Samples held at a constant value.
    #[error("{} of the {channel} held at a constant value, {}: {}", counted(*count, "sample"), spans_in_words(places), action.words())]
    Dropouts {
        channel: String,
        count: usize,
        places: Vec<[f64; 2]>,
        action: DataAction,
    },
    /// Single samples far from their neighbours.
    #[error("{} in the {channel}, at {} s: {}", counted(*count, "spike"), times_in_words(places, *count), action.words())]
    Spikes {
        channel: String,
        count: usize,
        places: Vec<f64>,
        action: DataAction,
    },
    /// Samples at an end of the range.
    #[error("{} of the {channel} at its extreme value {} {unit}: {}", counted(*count, "sample"), significant(*level, 4), action.words())]
    Saturation {
        channel: String,
        count: usize,
        level: f64,
        unit: String,
        action: DataAction,
    },
    /// Samples that are multiples of a step.
    #[error("{channel} quantised in steps of {} {unit}: {}", significant(*step, 3), action.words())]
    Quantisation {
        channel: String,
        step: f64,
        unit: String,
        /// Standard deviation of the error, step/sqrt(12), relative to that of the samples.
        share: f64,
        action: DataAction,
    },
    /// A stated delay.
    #[error("times of the {channel} {} by its delay of {} s", action.words(), significant(*seconds, 6))]
    Delay {
        channel: String,
        seconds: f64,
        action: DataAction,
    },
}

fn counted(count: usize, name: &str) -> String {
    match count {
        1 => format!("1 {name}"),
        _ => format!("{count} {name}s"),
    }
}

fn time(t: f64) -> String {
    significant(t, 6)
}

fn gaps_in_words(places: &[GapPlace], count: usize) -> String {
    let each = places.iter().take(IN_WORDS).map(|gap| {
        let (from, to) = (time(gap.from), time(gap.to));
        let length = significant(gap.to - gap.from, 3);
        format!(
            "{from} to {to} s ({length} s, {})",
            counted(gap.samples, "sample")
        )
    });
    listed(each.collect(), count)
}

fn spans_in_words(places: &[[f64; 2]]) -> String {
    let each = places.iter().take(IN_WORDS);
    let each = each.map(|[from, to]| format!("{} to {} s", time(*from), time(*to)));
    listed(each.collect(), places.len())
}

fn times_in_words(places: &[f64], count: usize) -> String {
    listed(
        places.iter().take(IN_WORDS).map(|t| time(*t)).collect(),
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
