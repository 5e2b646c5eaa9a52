//! Lists of records: files, patterns, or a table with a row for each record.

use crate::config::Override;
use crate::digest::digest;
use crate::error::InputError;
use crate::spelling::nearest;
use crate::text_io::{one_of, quote, read_text};
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Column of a table that names the file.
const FILE: &str = "file";
/// Columns that are known coefficients.
const KNOWN: [&str; 3] = ["mass", "damping", "stiffness"];
/// Columns of the first and last time that is used.
const WINDOW: [&str; 2] = ["start", "end"];
/// Column of the system to which a record belongs.
const SYSTEM: &str = "system";
/// First names of keys of a model: a column such as `experiments.0.sigma.displacement` overrides a key.
const KEYS: [&str; 6] = [
    "experiments",
    "functions",
    "fit",
    "grid",
    "constraints",
    "parameters",
];
/// Beginning of the path of a record of arrays.
const IN_MEMORY: &str = "sha256:";
/// Headings that are meant as [`FILE`].
const LIKE_FILE: [&str; 5] = ["file", "files", "filename", "file_name", "path"];
/// Longest line of headings, bytes.
const LONGEST_HEADING: u64 = 1 << 16;
/// Longest table of records, bytes.
const LONGEST: u64 = 1 << 32;

/// A record of a fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Name: the path as given.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// Values of its own for keys of the model.
    pub overrides: Vec<Override>,
    /// The system to which it belongs; empty where none is stated.
    pub system: String,
    /// Values of the other columns of the table.
    pub columns: Vec<String>,
}

impl Record {
    /// A record without a table.
    pub fn of_file(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            path: name.into(),
            overrides: Vec::new(),
            system: String::new(),
            columns: Vec::new(),
        }
    }

    /// True for a record of arrays: its path is the digest of its content.
    pub fn is_in_memory(&self) -> bool {
        self.path.to_string_lossy().starts_with(IN_MEMORY)
    }
}

/// The records of a fleet in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordList {
    /// Records.
    pub records: Vec<Record>,
    /// Names of the other columns of the table.
    pub columns: Vec<String>,
    /// What the columns of the table are used for, one clause for each.
    pub uses: Vec<String>,
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
        let mut records = Vec::new();
        for argument in arguments {
            let path = Path::new(argument);
            if path.is_dir() {
                return Err(InputError::file(path, "a folder in place of records")
                    .expected("files, or a pattern in quotes")
                    .hint(format!("\"{}\"", path.join("*.csv").display())));
            }
            if Headings::of(path).is_some_and(|headings| headings.has(FILE)) {
                return Err(
                    InputError::file(path, "a table of records among several arguments")
                        .expected("one table of records alone, or files and patterns"),
                );
            }
            let is_pattern = argument.contains(['*', '?', '[']) && !path.exists();
            match is_pattern {
                true => records.extend(matches(argument)?),
                // A file that does not exist is an error of its row.
                false => records.push(Record::of_file(argument)),
            }
        }
        let list = Self {
            records,
            ..Self::default()
        };
        list.checked()
    }

    /// Reads a table with a column `file`; `None` for any other file.
    ///
    /// # Errors
    /// An invalid table.
    pub fn of_table(path: &Path) -> Result<Option<Self>, InputError> {
        let Some(headings) = Headings::of(path) else {
            return Ok(None);
        };
        if headings.has(FILE) {
            let text = read_text(path, "a table of records", LONGEST)?;
            let reader = TableReader::new(path, headings.delimiter);
            return reader.read(&text).map(Some);
        }
        let is_meant = |name: &&String| LIKE_FILE.contains(&name.to_lowercase().as_str());
        match headings.names.iter().find(is_meant) {
            Some(name) => {
                Err(
                    InputError::line(path, 1, 1, "a table of records without the column `file`")
                        .found(quote(name))
                        .expected("the column `file`, with the paths of the records"),
                )
            }
            None => Ok(None),
        }
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
        let mut seen: HashMap<&str, usize> = HashMap::with_capacity(self.records.len());
        for (i, record) in self.records.iter().enumerate() {
            if let Some(first) = seen.insert(&record.name, i) {
                return Err(
                    InputError::argument("RECORDS", "two records have the same name")
                        .found(format!(
                            "{} as number {} and number {}",
                            quote(&record.name),
                            first + 1,
                            i + 1
                        ))
                        .expected("every record once"),
                );
            }
        }
        Ok(self)
    }

    /// The SHA-256 digest of the list.
    pub fn digest(&self) -> String {
        let line = |r: &Record| {
            let overrides: Vec<String> = r.overrides.iter().map(Override::to_string).collect();
            let place = match r.is_in_memory() {
                true => r.path.clone(),
                // Files of one name in two folders are two records.
                false => std::path::absolute(&r.path).unwrap_or_else(|_| r.path.clone()),
            };
            format!("{:?}\n", (&r.name, place, overrides, &r.system, &r.columns))
        };
        let text: String = self.records.iter().map(line).collect();
        digest(text.as_bytes())
    }

    /// Positions of the records by their names.
    pub fn positions(&self) -> HashMap<&str, usize> {
        let pairs = self.records.iter().enumerate();
        pairs.map(|(i, record)| (record.name.as_str(), i)).collect()
    }
}

/// The first line of a table.
struct Headings {
    delimiter: char,
    names: Vec<String>,
}

impl Headings {
    /// Of a text table by its ending; `None` for any other file.
    fn of(path: &Path) -> Option<Self> {
        let ending = path.extension().and_then(|e| e.to_str())?.to_lowercase();
        (["csv", "tsv", "txt"].contains(&ending.as_str()) && path.is_file()).then_some(())?;
        let mut line = Vec::new();
        let file = std::fs::File::open(path).ok()?;
        let mut reader = BufReader::new(file.take(LONGEST_HEADING));
        reader.read_until(b'\n', &mut line).ok()?;
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_start_matches('\u{feff}');
        let delimiter = [',', ';', '\t'].into_iter().find(|d| text.contains(*d));
        let delimiter = delimiter.unwrap_or(',');
        let names = text.split(delimiter);
        let names = names.map(|name| name.trim().trim_matches('"').to_owned());
        Some(Self {
            delimiter,
            names: names.collect(),
        })
    }

    fn has(&self, name: &str) -> bool {
        self.names.iter().any(|own| own == name)
    }
}

/// The files of a pattern, in the order of their names.
fn matches(pattern: &str) -> Result<Vec<Record>, InputError> {
    let wrong = |problem: &str| {
        InputError::argument("RECORDS", problem)
            .found(quote(pattern))
            .expected("a pattern such as \"records/*.csv\"")
    };
    let paths = glob::glob(pattern)
        .map_err(|error| wrong("the pattern cannot be read").hint(error.to_string()))?;
    // A pattern finds names in UTF-8 only.
    let files = paths.filter_map(Result::ok).filter(|path| path.is_file());
    let records: Vec<Record> = files
        .filter_map(|path| Some(Record::of_file(path.to_str()?)))
        .collect();
    match records.is_empty() {
        true => Err(wrong("no file matches this pattern")),
        false => Ok(records),
    }
}

/// What a column of a table of records is used for.
enum Use {
    File,
    Known(&'static str),
    Window(usize),
    Key(String),
    System,
    Other(usize),
}

/// Reader of a table of records.
struct TableReader<'a> {
    path: &'a Path,
    delimiter: char,
}

impl<'a> TableReader<'a> {
    fn new(path: &'a Path, delimiter: char) -> Self {
        Self { path, delimiter }
    }

    fn read(&self, text: &str) -> Result<RecordList, InputError> {
        let mut builder = csv::ReaderBuilder::new();
        let delimiter = u8::try_from(self.delimiter).unwrap_or(b',');
        let mut reader = builder
            .delimiter(delimiter)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let headings = reader.headers().cloned().unwrap_or_default();
        let mut list = RecordList::default();
        let mut uses = Vec::new();
        for heading in &headings {
            uses.push(self.use_of(heading, &uses, &mut list.columns)?);
        }
        list.uses = headings
            .iter()
            .zip(&uses)
            .map(|(h, u)| in_words(h, u))
            .collect();
        // Of a text in UTF-8 whose rows may have any length every row is read.
        for row in reader.records().map_while(Result::ok) {
            let line = row.position().map_or(0, csv::Position::line);
            let line = usize::try_from(line).unwrap_or(usize::MAX);
            if row.iter().all(str::is_empty) {
                continue;
            }
            if row.len() != headings.len() {
                return Err(self
                    .at(line, "a row of another length")
                    .found(format!("{} values", row.len()))
                    .expected(format!("{}, one for each column", headings.len())));
            }
            list.records
                .push(self.record(&row, &uses, line, list.columns.len())?);
        }
        Ok(list)
    }

    fn at(&self, line: usize, problem: &str) -> InputError {
        InputError::line(self.path, line, 1, problem)
    }

    fn repeated(&self, heading: &str) -> InputError {
        self.at(1, "two columns of one name")
            .found(quote(heading))
            .expected("every column once")
    }

    fn use_of(
        &self,
        heading: &str,
        before: &[Use],
        columns: &mut Vec<String>,
    ) -> Result<Use, InputError> {
        let is_repeated = |is: fn(&Use) -> bool| before.iter().any(is);
        if heading == FILE {
            return match is_repeated(|u| matches!(u, Use::File)) {
                true => Err(self.at(1, "two columns `file`").expected("one")),
                false => Ok(Use::File),
            };
        }
        if let Some(known) = KNOWN.into_iter().find(|known| *known == heading) {
            return match before
                .iter()
                .any(|u| matches!(u, Use::Known(name) if *name == known))
            {
                true => Err(self.repeated(heading)),
                false => Ok(Use::Known(known)),
            };
        }
        if let Some(end) = WINDOW.iter().position(|name| *name == heading) {
            return Ok(Use::Window(end));
        }
        if heading == SYSTEM {
            return Ok(Use::System);
        }
        let first = heading.split(['.', '[']).next().unwrap_or_default();
        if heading.contains('.') {
            return match KEYS.contains(&first) {
                true => Ok(Use::Key(heading.to_owned())),
                false => Err(self
                    .at(1, "a column with the name of no key")
                    .found(quote(heading))
                    .expected(format!(
                        "a key that begins with {}, or a name without a point",
                        one_of(KEYS)
                    ))
                    .hint_if(nearest(first, KEYS).map(|near| format!("did you mean `{near}`?")))),
            };
        }
        if columns.iter().any(|known| known == heading) {
            return Err(self.repeated(heading));
        }
        columns.push(heading.to_owned());
        Ok(Use::Other(columns.len() - 1))
    }

    fn record(
        &self,
        row: &csv::StringRecord,
        uses: &[Use],
        line: usize,
        others: usize,
    ) -> Result<Record, InputError> {
        let mut record = Record::of_file("");
        record.columns = vec![String::new(); others];
        let mut window: [Option<f64>; 2] = [None; 2];
        let set = |text: String| {
            Override::parse(&text).map_err(|error| InputError {
                place: self.at(line, "").place,
                ..error
            })
        };
        for (cell, column) in row.iter().zip(uses) {
            match column {
                Use::File => {
                    record.name = cell.to_owned();
                    record.path = match self.path.parent() {
                        Some(folder) => folder.join(cell),
                        None => cell.into(),
                    };
                }
                Use::System => record.system = cell.to_owned(),
                Use::Other(index) => record.columns[*index] = cell.to_owned(),
                _ if cell.is_empty() => {}
                Use::Known(name) => {
                    let value = self.number(cell, line, name)?;
                    record
                        .overrides
                        .push(set(format!("functions.{name}={{fixed: {value:?}}}"))?);
                }
                Use::Window(end) => window[*end] = Some(self.number(cell, line, WINDOW[*end])?),
                Use::Key(key) => record.overrides.push(set(format!("{key}={cell}"))?),
            }
        }
        if record.name.is_empty() {
            return Err(self
                .at(line, "a row without a file")
                .expected("the path of a record"));
        }
        if window != [None; 2] {
            let limits = ["min", "max"].into_iter().zip(window);
            let limits = limits.filter_map(|(name, limit)| Some(format!("{name}: {:?}", limit?)));
            let limits: Vec<String> = limits.collect();
            let text = format!("experiments.0.window={{{}}}", limits.join(", "));
            record.overrides.push(set(text)?);
        }
        Ok(record)
    }

    fn number(&self, cell: &str, line: usize, heading: &str) -> Result<f64, InputError> {
        let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| {
            self.at(line, "not a number")
                .found(format!("{} in the column `{heading}`", quote(cell)))
                .expected("a number, or nothing")
        })
    }
}

fn in_words(heading: &str, column: &Use) -> String {
    match column {
        Use::File => format!("`{heading}` names the record"),
        Use::Known(name) => format!("`{heading}` is the known {name}"),
        Use::Window(0) => format!("`{heading}` is the first time used"),
        Use::Window(_) => format!("`{heading}` is the last time used"),
        Use::Key(_) => format!("`{heading}` overrides that key"),
        Use::System => format!("`{heading}` groups records of one system"),
        Use::Other(_) => format!("`{heading}` is kept for the summary"),
    }
}
