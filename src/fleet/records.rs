//! Lists of records: files, patterns, or a table with a row for each record.

use crate::config::Override;
use crate::error::InputError;
use crate::text_io::{quote, read_text};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Column of a table that names the file.
const FILE: &str = "file";
/// Columns that are known coefficients.
const KNOWN: [&str; 3] = ["mass", "damping", "stiffness"];
/// Longest table of records, bytes.
const LONGEST: u64 = 1 << 32;

/// A record of a fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetRecord {
    /// Name: the path as given.
    pub name: String,
    /// The file; with a content a name whose ending states its format.
    pub path: PathBuf,
    /// Content of a record in memory.
    pub content: Option<Arc<[u8]>>,
    /// Values of its own for keys of the model.
    pub overrides: Vec<Override>,
    /// Values of the other columns of the table.
    pub columns: Vec<String>,
}

impl FleetRecord {
    /// A record without a table.
    pub fn of_file(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            path: name.into(),
            content: None,
            overrides: Vec::new(),
            columns: Vec::new(),
        }
    }
}

/// The records of a fleet in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordList {
    /// Records.
    pub records: Vec<FleetRecord>,
    /// Names of the other columns of the table.
    pub columns: Vec<String>,
}

impl RecordList {
    /// Reads the arguments of a command: files and patterns, or one table with a column `file`.
    ///
    /// # Errors
    /// A pattern without a match, a folder, two records of one name, an invalid table.
    pub fn read(arguments: &[String]) -> Result<Self, InputError> {
        if let [table] = arguments
            && let Some(list) = Self::of_table(Path::new(table))?
        {
            return list.checked();
        }
        let mut list = Self::default();
        for argument in arguments {
            let path = Path::new(argument);
            if path.is_dir() {
                return Err(InputError::file(path, "a folder in place of records")
                    .expected("files, or a pattern in quotes")
                    .hint(format!("\"{}\"", path.join("*.csv").display())));
            }
            match argument.contains(['*', '?', '[']) && !path.exists() {
                true => list.records.extend(matches(argument)?),
                // A file that does not exist is an error of its row.
                false => list.records.push(FleetRecord::of_file(argument)),
            }
        }
        list.checked()
    }

    /// Reads a text table with a column `file`; `None` for any other file.
    fn of_table(path: &Path) -> Result<Option<Self>, InputError> {
        let ending = path.extension().and_then(|e| e.to_str());
        let is_text = ending.is_some_and(|e| ["csv", "tsv", "txt"].contains(&&*e.to_lowercase()));
        if !is_text || !path.is_file() {
            return Ok(None);
        }
        // A record in another encoding is no table of records.
        let Ok(text) = read_text(path, "a table of records", LONGEST) else {
            return Ok(None);
        };
        let first = text.lines().next().unwrap_or_default();
        let delimiter = [',', ';', '\t'].into_iter().find(|d| first.contains(*d));
        let mut builder = csv::ReaderBuilder::new();
        builder
            .delimiter(delimiter.map_or(b',', |d| d as u8))
            .trim(csv::Trim::All)
            .flexible(true);
        let mut reader = builder.from_reader(text.as_bytes());
        let headings = reader.headers().cloned().unwrap_or_default();
        let at = |line: u64, problem: &str| InputError::line(path, line as usize, 1, problem);
        if !headings.iter().any(|heading| heading == FILE) {
            return Ok(None);
        }
        for (i, heading) in headings.iter().enumerate() {
            if headings.iter().take(i).any(|other| other == heading) {
                return Err(at(1, "two columns of one name")
                    .found(quote(heading))
                    .expected("every column once"));
            }
        }
        let mut list = Self {
            columns: headings
                .iter()
                .filter(|heading| is_other(heading))
                .map(str::to_owned)
                .collect(),
            ..Self::default()
        };
        // Of a text in UTF-8 whose rows may have any length every row is read.
        for row in reader.records().map_while(Result::ok) {
            let line = row.position().map_or(0, csv::Position::line);
            if row.len() != headings.len() {
                return Err(at(line, "a row of another length")
                    .found(format!("{} values", row.len()))
                    .expected(format!("{}, one for each column", headings.len())));
            }
            let record = record(path, &headings, &row).map_err(|error| InputError {
                location: at(line, "").location,
                ..error
            });
            list.records.push(record?);
        }
        Ok(Some(list))
    }

    /// The list, if it has records with a name of their own.
    ///
    /// # Errors
    /// No records, or two of one name.
    pub fn checked(self) -> Result<Self, InputError> {
        if self.records.is_empty() {
            return Err(InputError::argument("RECORDS", "no records")
                .expected("files, patterns in quotes, or a table with a column `file`"));
        }
        let mut seen = HashSet::new();
        if let Some(twice) = self.records.iter().find(|r| !seen.insert(r.name.as_str())) {
            return Err(
                InputError::argument("RECORDS", "two records have the same name")
                    .found(quote(&twice.name))
                    .expected("every record once"),
            );
        }
        Ok(self)
    }
}

/// True for a column that is kept beside the results.
fn is_other(heading: &str) -> bool {
    heading != FILE && !KNOWN.contains(&heading) && !heading.contains('.')
}

/// The record of a row of a table.
fn record(
    table: &Path,
    headings: &csv::StringRecord,
    row: &csv::StringRecord,
) -> Result<FleetRecord, InputError> {
    let mut record = FleetRecord::of_file("");
    for (heading, cell) in headings.iter().zip(row) {
        let number = || {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| {
                InputError::argument("", "not a number")
                    .found(format!("{} in the column `{heading}`", quote(cell)))
                    .expected("a number, or nothing")
            })
        };
        if heading == FILE {
            record.name = cell.to_owned();
            record.path = table
                .parent()
                .map_or_else(|| cell.into(), |folder| folder.join(cell));
        } else if is_other(heading) {
            record.columns.push(cell.to_owned());
        } else if cell.is_empty() {
            // The value of the model.
        } else {
            record
                .overrides
                .push(Override::parse(&match KNOWN.contains(&heading) {
                    true => format!("functions.{heading}={{fixed: {:?}}}", number()?),
                    false => format!("{heading}={cell}"),
                })?);
        }
    }
    if record.name.is_empty() {
        return Err(
            InputError::argument("", "a row without a file").expected("the path of a record")
        );
    }
    Ok(record)
}

/// The files of a pattern, in the order of their names.
fn matches(pattern: &str) -> Result<Vec<FleetRecord>, InputError> {
    let paths = glob::glob(pattern).into_iter().flatten();
    // A pattern finds names in UTF-8 only.
    let files = paths.filter_map(Result::ok).filter(|path| path.is_file());
    let records: Vec<FleetRecord> = files
        .filter_map(|path| Some(FleetRecord::of_file(path.to_str()?)))
        .collect();
    match records.is_empty() {
        true => Err(
            InputError::argument("RECORDS", "no file matches this pattern")
                .found(quote(pattern))
                .expected("a pattern such as \"records/*.csv\""),
        ),
        false => Ok(records),
    }
}
