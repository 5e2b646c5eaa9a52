//! Detection of delimiter, decimal sign, and the rows of names, units and data of a table.
//!
//! Every pair of delimiter and decimal sign is scored on the first rows that have the most frequent number of fields:
//! numbers raise the score, text lowers it. The highest score wins; among equal scores, the more common pair.

use std::path::Path;
use std::rc::Rc;

use csv::StringRecord;

use super::field::{self, Field};
use super::format::TableFormat;
use super::rows::CsvText;
use crate::clock::Clock;
use crate::formats::{Meaning, meaning};
use crate::units::Unit;

/// Length of the examined beginning of a file, bytes: some thousand rows, more than any preamble.
const SAMPLE: usize = 1 << 16;

/// Delimiters, most common first; a blank denotes runs of blanks.
pub(super) const DELIMITERS: [char; 4] = [',', ';', '\t', ' '];

/// Delimiter, decimal sign, and rows of names, units and data of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    pub delimiter: char,
    pub decimal: char,
    /// Number of fields of the data rows, where there are any with numbers.
    pub width: Option<usize>,
    /// Rows, counted from 0 without comments and blank lines.
    pub header: Option<usize>,
    pub units: Option<usize>,
    pub data: usize,
    /// Order of dates with slashes.
    pub day_first: bool,
}

/// Detects every property that `format` does not give.
pub fn detect(path: &Path, text: &str, format: &TableFormat) -> Layout {
    let sample = beginning(text);
    let records = |delimiter| records(path, sample, format, delimiter);
    let (mut best, mut single): (Option<DialectCandidate>, Option<DialectCandidate>) = (None, None);
    let mut split: (Option<char>, Rc<[StringRecord]>) = (None, Rc::new([]));
    for (delimiter, decimal) in signs(format, sample.contains('"')) {
        if split.0 != Some(delimiter) {
            split = (Some(delimiter), records(delimiter).into());
        }
        let of_delimiter = Rc::clone(&split.1);
        let Some(candidate) = DialectCandidate::new(of_delimiter, delimiter, decimal) else {
            continue;
        };
        let guessed_comma =
            decimal == ',' && format.decimal.is_none() && format.delimiter.is_none();
        let position = match candidate.width {
            // Numbers with one comma are read as two columns rather than as decimal commas in one.
            1 if guessed_comma => continue,
            1 => &mut single,
            _ => &mut best,
        };
        // Blanks part the words of a preamble.
        let margin = if delimiter == ' ' { 1.1 } else { 1.0 };
        if (position.as_ref()).is_none_or(|p| candidate.score > margin * p.score) {
            *position = Some(candidate);
        }
    }
    // A single column is the last choice, unless all other candidates give hardly any numbers.
    let explains = |b: &DialectCandidate| single.as_ref().is_none_or(|s| 2.0 * b.score >= s.score);
    let found = match best.filter(explains) {
        Some(best) => Some(best),
        None => single,
    };
    match found.and_then(|candidate| candidate.layout(format)) {
        Some(layout) => layout,
        None => without_numbers(signs(format, false), records, format),
    }
}

/// First words of rows of statistics after the samples.
const STATISTICS: &str =
    "mean average avg mittelwert min minimum max maximum std stdev sd rms median sum total count";

/// The text without lines of words or statistics after the last row, where rows begin with a number or a time; and the number of these
/// lines.
pub(super) fn without_footer<'a>(text: &'a str, layout: &Layout) -> (&'a str, usize) {
    let is_word = |field: &str| {
        let field = field.trim().trim_matches('"');
        field::read(field, layout.decimal) == Field::Text && Clock::read(field, true).is_none()
    };
    // A row of data with a word in place of its first number is a mistake.
    let is_footer = |line: &'a str| {
        let fields = match layout.delimiter {
            ' ' => line.split_whitespace().collect::<Vec<_>>(),
            delimiter => line.split(delimiter).collect(),
        };
        let is_number =
            |field: &&str| matches!(field::read(field.trim(), layout.decimal), Field::Number(_));
        let is_row = layout.width == Some(fields.len())
            && (fields.len() == 1 || fields.iter().any(is_number));
        let is_statistic = |first: &str| {
            let first = first.trim().trim_matches('"').trim_end_matches([':', '.']);
            STATISTICS
                .split(' ')
                .any(|word| first.eq_ignore_ascii_case(word))
        };
        let is_text = |first: &str| is_word(first) && !is_row || is_statistic(first);
        line.starts_with('#') || fields.first().is_some_and(|first| is_text(first))
    };
    let begins = |line: &str| line.trim_start().chars().next().is_some();
    let (mut rest, mut count) = (text, 0);
    loop {
        let line = rest.trim_end().rsplit('\n').next().unwrap_or_default();
        match (begins(line), is_footer(line)) {
            (false, _) => return (text, 0),
            (true, true) => {}
            (true, false) => break,
        }
        count += 1;
        rest = &rest[..rest.trim_end().len() - line.len()];
    }
    // A quoted field can hold several lines.
    match rest.contains('"') && text[rest.len()..].contains('"') {
        true => (text, 0),
        false => (rest, count),
    }
}

/// Candidate delimiters and decimal signs; in quotes a comma can be both.
fn signs(format: &TableFormat, quoted: bool) -> impl Iterator<Item = (char, char)> + use<> {
    let delimiters = match format.delimiter {
        Some(delimiter) => vec![delimiter],
        None => DELIMITERS.to_vec(),
    };
    let decimals = match format.decimal {
        Some(decimal) => vec![decimal],
        None => vec!['.', ','],
    };
    delimiters.into_iter().flat_map(move |delimiter| {
        let decimals = decimals.clone().into_iter();
        decimals.filter_map(move |sign| (sign != delimiter || quoted).then_some((delimiter, sign)))
    })
}

/// The first lines of a text, one at least.
fn beginning(text: &str) -> &str {
    let Some(sample) = text.as_bytes().get(..SAMPLE) else {
        return text;
    };
    let last = sample.iter().rposition(|&b| b == b'\n');
    match last.or_else(|| text.find('\n')) {
        Some(end) => &text[..=end],
        None => text,
    }
}

fn records(path: &Path, sample: &str, format: &TableFormat, delimiter: char) -> Vec<StringRecord> {
    let source = CsvText::new(sample, format.skip.unwrap_or(0), delimiter);
    let mut rows = source.rows(path);
    let mut records = Vec::new();
    let mut record = StringRecord::new();
    while let Ok(Some(_)) = rows.read(&mut record) {
        records.push(record.clone());
    }
    records
}

/// Layout of a table without a row of numbers: names in the first row, at the delimiter that gives the most fields.
fn without_numbers(
    signs: impl Iterator<Item = (char, char)>,
    records: impl Fn(char) -> Vec<StringRecord>,
    format: &TableFormat,
) -> Layout {
    let mut widest: Option<(usize, char, char)> = None;
    for (delimiter, decimal) in signs {
        // The words of a sentence are not columns.
        let guessed_blank = delimiter == ' ' && format.delimiter.is_none();
        let width = match guessed_blank {
            true => 0,
            false => records(delimiter).first().map_or(0, StringRecord::len),
        };
        if widest.is_none_or(|(most, ..)| width > most) {
            widest = Some((width, delimiter, decimal));
        }
    }
    let (_, delimiter, decimal) = widest.unwrap_or((0, ',', '.'));
    let header = format.header.unwrap_or(true);
    let units = format.units_row.unwrap_or(false);
    Layout {
        delimiter,
        decimal,
        width: None,
        header: header.then_some(0),
        units: units.then_some(usize::from(header)),
        data: usize::from(header) + usize::from(units),
        day_first: false,
    }
}

/// Rows of a table at one delimiter and decimal sign, with their score.
struct DialectCandidate {
    delimiter: char,
    decimal: char,
    records: Rc<[StringRecord]>,
    width: usize,
    score: f64,
}

impl DialectCandidate {
    /// `None` where there is no number.
    fn new(records: Rc<[StringRecord]>, delimiter: char, decimal: char) -> Option<Self> {
        let counts: Vec<(usize, FieldCounts)> = records
            .iter()
            .map(|record| (record.len(), FieldCounts::of(record, decimal)))
            .collect();
        let widest = counts.iter().map(|(width, _)| *width).max()?;
        let mut numbers = vec![0; widest + 1];
        for (width, count) in &counts {
            numbers[*width] += count.numbers;
        }
        let (width, most) = (0..=widest).map(|w| (w, numbers[w])).max_by_key(|n| n.1)?;
        if most == 0 {
            return None;
        }
        let of_width = counts.iter().filter(|(w, _)| *w == width);
        let score = of_width.map(|(_, count)| count.score()).sum();
        Some(Self {
            delimiter,
            decimal,
            records,
            width,
            score,
        })
    }

    fn read(&self, record: &StringRecord, column: usize) -> Field {
        record
            .get(column)
            .map_or(Field::Missing, |text| field::read(text, self.decimal))
    }

    /// Numeric columns, judged in the last half of the rows with numbers, because the first ones can belong to the
    /// preamble.
    fn numeric(&self) -> Vec<usize> {
        let bears_numbers = |record: &&StringRecord| {
            record.len() == self.width && FieldCounts::of(record, self.decimal).numbers > 0
        };
        let rows: Vec<&StringRecord> = self.records.iter().filter(bears_numbers).collect();
        let is_numeric = |&column: &usize| {
            let (mut numbers, mut texts) = (0, 0);
            for row in &rows[rows.len() / 2..] {
                match self.read(row, column) {
                    Field::Number(_) => numbers += 1,
                    Field::Missing => {}
                    Field::Text | Field::Infinite => texts += 1,
                }
            }
            numbers > 0 && numbers >= texts
        };
        (0..self.width).filter(is_numeric).collect()
    }

    fn layout(&self, format: &TableFormat) -> Option<Layout> {
        let numeric = self.numeric();
        let lead = *numeric.first()?;
        let is_data = |record: &StringRecord| {
            let mut fields = numeric.iter().map(|&column| self.read(record, column));
            record.len() == self.width
                && fields.clone().any(|f| matches!(f, Field::Number(_)))
                && fields.all(|f| f != Field::Text)
        };
        let mut data = self.records.iter().position(is_data)?;
        // Rows before the first valid one that begin like data are data with an error.
        let begins_as_data = |record: &StringRecord| {
            let nothing = record.len() == self.width
                && record
                    .iter()
                    .all(|t| field::read(t, self.decimal) == Field::Missing);
            let number = matches!(self.read(record, lead), Field::Number(_))
                && (record.len() > 1 || self.width == 1);
            number || nothing
        };
        while data > 0 && begins_as_data(&self.records[data - 1]) {
            data -= 1;
        }
        // Rows such as `Scale,1,1` before the samples state something of these.
        let is_key = |record: &StringRecord| {
            record.get(0).is_some_and(|text| meaning(text).is_some())
                && FieldCounts::of(record, self.decimal).numbers > 0
        };
        let is_key = |row: usize| self.records.get(row).is_some_and(is_key);
        let mut top = data;
        while top > 1 && is_key(top - 1) {
            top -= 1;
        }
        let (header, units, mut data) = match format.skip {
            Some(_) => self.top(format, begins_as_data(self.records.first()?), data),
            None => {
                let (header, units, after) = self.head(format, top);
                (header, units, after.max(data))
            }
        };
        while header.is_some() && is_key(data) {
            data += 1;
        }
        Some(Layout {
            delimiter: self.delimiter,
            decimal: self.decimal,
            width: Some(self.width),
            header,
            units,
            data,
            day_first: false,
        })
    }

    /// Rows of names and units of a table without preamble, and the first data row.
    fn top(
        &self,
        format: &TableFormat,
        is_data: bool,
        data: usize,
    ) -> (Option<usize>, Option<usize>, usize) {
        let header = format.header.unwrap_or(!is_data);
        let looks_so = || header && data > 1 && self.names_and_units(0, 1);
        let units = format.units_row.unwrap_or_else(looks_so);
        let after_header = usize::from(header);
        (
            header.then_some(0),
            units.then_some(after_header),
            after_header + usize::from(units),
        )
    }

    /// Rows of names and units before the row `data`, and the first data row.
    fn head(&self, format: &TableFormat, data: usize) -> (Option<usize>, Option<usize>, usize) {
        // The row of the name of an index, as pandas writes it below names of several levels.
        let is_index = |record: &StringRecord| {
            record.iter().skip(1).all(str::is_empty)
                && record.get(0).is_some_and(|name| !name.is_empty())
        };
        let is_index = |row: usize| {
            self.records
                .get(row)
                .is_some_and(|record| record.len() > 1 && is_index(record))
        };
        let names = data - usize::from(data > 2 && is_index(data - 1));
        let above = names.checked_sub(1);
        let two_above = names.checked_sub(2);
        if format.header == Some(false) {
            let units = above.filter(|_| format.units_row == Some(true));
            return (None, units, data);
        }
        let has_units = match (format.units_row, above, two_above) {
            (Some(given), ..) => given,
            (None, Some(units), Some(names)) => self.names_and_units(names, units),
            _ => false,
        };
        if has_units {
            return (two_above, above, data);
        }
        match (format.header, above) {
            (Some(true), None) => (Some(0), None, 1),
            (Some(true), above) => (above, None, data),
            (_, above) => (above.filter(|&row| self.has_names(row)), None, data),
        }
    }

    /// True if the row before the data has the column names; else it is preamble.
    fn has_names(&self, row: usize) -> bool {
        let record = &self.records[row];
        if record.len() == self.width {
            return true;
        }
        if record
            .iter()
            .any(|text| matches!(field::read(text, self.decimal), Field::Number(_)))
        {
            return false;
        }
        if record.len() > 1 {
            // Blanks inside names split them, so names separated by blanks are not used.
            return self.delimiter != ' ';
        }
        // One name above two columns separated by commas suggests one column with decimal commas, which must not be
        // read as two.
        let name = record.get(0).unwrap_or_default();
        let is_name = name.chars().all(|c| c.is_alphanumeric() || c == '_');
        self.delimiter == ',' && self.width == 2 && is_name
    }

    /// True if row `names` has names and row `units` has units for them.
    fn names_and_units(&self, names: usize, units: usize) -> bool {
        let (names, units) = (&self.records[names], &self.records[units]);
        let is_number = |text| matches!(field::read(text, self.decimal), Field::Number(_));
        names.len() == units.len() && !names.iter().any(is_number) && are_units(units)
    }
}

/// True if all fields but a key before them are units or empty, and at least one is a unit.
fn are_units(record: &StringRecord) -> bool {
    let key = record
        .get(0)
        .filter(|text| meaning(text) == Some(Meaning::Unit));
    let mut texts =
        (record.iter().skip(usize::from(key.is_some()))).filter(|text| !matches!(*text, "" | "-"));
    record.iter().any(Unit::looks_like) && texts.all(Unit::looks_like)
}

/// Numbers of numeric and other fields of a row.
struct FieldCounts {
    numbers: usize,
    others: usize,
}

impl FieldCounts {
    fn of(record: &StringRecord, decimal: char) -> Self {
        let mut count = Self {
            numbers: 0,
            others: 0,
        };
        for text in record {
            match field::read(text, decimal) {
                Field::Number(_) => count.numbers += 1,
                Field::Missing => {}
                Field::Text | Field::Infinite => count.others += 1,
            }
        }
        count
    }

    /// Score of a row: increases with numbers, decreases with text, unaffected by missing samples.
    fn score(&self) -> f64 {
        match self.numbers {
            0 => 0.0,
            numbers => (numbers * numbers) as f64 / (numbers + self.others) as f64,
        }
    }
}
