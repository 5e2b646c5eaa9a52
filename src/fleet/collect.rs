//! The rows of all shards in the order of the records: tables, statistics and the page.

use super::fit::TIME_LIMIT;
use super::folder::FleetFolder;
use super::journal::{LineName, curve_files, journals};
use super::parquet::{Cell, ColumnKind, ParquetWriter};
use super::records::RecordList;
use super::row::{Curve, Row};
use super::statistics::{Distribution, Statistics};
use super::trend::Trend;
use crate::error::InputError;
use crate::results::{complete_lines, write_stream, write_whole};
use kmcfit_core::internals::assessment::VerdictLevel;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Files that [`collect`] writes.
pub const ROWS: &str = "rows.parquet";
/// Coefficients that vary.
pub const CURVES: &str = "curves.parquet";
/// Statistics.
pub const SUMMARY: &str = "summary.json";

/// What was collected.
#[derive(Debug, Clone)]
pub struct Collected {
    /// Statistics of the rows.
    pub statistics: Statistics,
    /// The records.
    pub list: RecordList,
    /// Verdict of each record.
    pub verdicts: Vec<Option<VerdictLevel>>,
    /// Errors of the first records that have one.
    pub errors: Vec<(String, String)>,
}

/// Most different reasons that are counted.
const MOST_REASONS: usize = 1000;
/// Most errors that are kept.
const MOST_ERRORS: usize = 1000;

/// Joins the shards of a fleet on the records `list`: writes its tables and its statistics over the axis `trend`.
///
/// # Errors
/// If a file cannot be read or written.
pub fn collect(
    folder: &FleetFolder,
    list: RecordList,
    trend: &Trend,
) -> Result<Collected, InputError> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |error: io::Error| {
            InputError::file(&path, "the fleet cannot be collected").found(error)
        }
    };
    let positions = list.positions();
    let mut rows = Lines::default();
    let mut curves = Lines::default();
    let mut gathered = Gathered::new(list.records.len());
    for path in journals(&folder.path)? {
        rows.read(&path, &positions).map_err(at(&path))?;
    }
    for path in curve_files(&folder.path)? {
        curves.read(&path, &positions).map_err(at(&path))?;
    }
    drop(positions);
    rows.keep_one_each();
    curves.places.sort_unstable();
    for place in 0..rows.count() {
        let line = rows.line(place).map_err(at(&folder.path))?;
        let index = rows.places[place].record as usize;
        gathered.add(index, &line).map_err(at(&folder.path))?;
    }
    let names = |i: usize| list.records[i].name.clone();
    let mut statistics = gathered.statistics;
    statistics.distributions = gathered
        .estimates
        .into_iter()
        .filter_map(|estimate| {
            Distribution::of(estimate.name, estimate.unit, estimate.values, &trend.values)
        })
        .collect();
    statistics.outliers = Statistics::find_outliers(&statistics.distributions, &names);
    statistics.reasons = gathered.reasons.into_iter().collect();
    (statistics.reasons).sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    statistics.records = list.records.len();
    statistics.missing = statistics.records - rows.count();
    let path = folder.path.join(ROWS);
    write_rows(&path, &list, &mut rows, &statistics.distributions).map_err(at(&path))?;
    let path = folder.path.join(CURVES);
    write_curves(&path, &mut curves, &rows).map_err(at(&path))?;
    let path = folder.path.join(SUMMARY);
    let text = serde_json::to_string_pretty(&statistics).unwrap_or_default() + "\n";
    write_whole(&path, &text).map_err(at(&path))?;
    Ok(Collected {
        statistics,
        list,
        verdicts: gathered.verdicts,
        errors: gathered.errors,
    })
}

/// Place of the line of a record, in the order of records, files and lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    record: u32,
    file: u32,
    position: u64,
    is_error: bool,
}

/// Places of the lines of records in files.
#[derive(Default)]
struct Lines {
    files: Vec<PathBuf>,
    open: Vec<BufReader<File>>,
    places: Vec<Place>,
}

impl Lines {
    /// Adds the lines of a file.
    fn read(&mut self, path: &Path, positions: &HashMap<&str, usize>) -> io::Result<()> {
        let number = self.files.len() as u32;
        complete_lines(path, |position, line| {
            let name = LineName::of(line)?;
            let Some(index) = positions.get(&*name.record) else {
                return Err(io::Error::other(format!(
                    "a record of another fleet: {}",
                    name.record
                )));
            };
            self.places.push(Place {
                record: *index as u32,
                file: number,
                position,
                is_error: name.is_error(),
            });
            Ok(())
        })?;
        self.files.push(path.to_path_buf());
        self.open.push(BufReader::new(File::open(path)?));
        Ok(())
    }

    /// Keeps one line of each record: the first one with estimates, which shards of another number may have written twice, or else the last error.
    fn keep_one_each(&mut self) {
        let rank = |place: &Place| match place.is_error {
            false => (false, place.file, place.position),
            true => (true, u32::MAX - place.file, u64::MAX - place.position),
        };
        self.places
            .sort_unstable_by_key(|place| (place.record, rank(place)));
        self.places.dedup_by_key(|place| place.record);
    }

    fn count(&self) -> usize {
        self.places.len()
    }

    fn has(&self, index: u32) -> bool {
        self.places
            .binary_search_by_key(&index, |place| place.record)
            .is_ok()
    }

    fn line(&mut self, place: usize) -> io::Result<String> {
        let Place { file, position, .. } = self.places[place];
        let reader = &mut self.open[file as usize];
        reader.seek(SeekFrom::Start(position))?;
        let mut line = String::new();
        reader.read_line(&mut line)?;
        Ok(line)
    }
}

/// An estimate in all records.
struct Column {
    name: String,
    unit: String,
    values: Vec<f64>,
}

struct Gathered {
    count: usize,
    estimates: Vec<Column>,
    reasons: HashMap<String, usize>,
    verdicts: Vec<Option<VerdictLevel>>,
    errors: Vec<(String, String)>,
    statistics: Statistics,
}

impl Gathered {
    fn new(count: usize) -> Self {
        Self {
            count,
            estimates: Vec::new(),
            reasons: HashMap::new(),
            verdicts: vec![None; count],
            errors: Vec::new(),
            statistics: Statistics::default(),
        }
    }

    /// Adds the row of a record.
    fn add(&mut self, index: usize, line: &str) -> io::Result<()> {
        let row: Row = serde_json::from_str(line)?;
        self.statistics.seconds += row.seconds;
        if let Some(error) = row.error {
            self.statistics.errors += 1;
            self.statistics.time_limits += usize::from(error.starts_with(TIME_LIMIT));
            if self.errors.len() < MOST_ERRORS {
                self.errors.push((row.record, error));
            }
            return Ok(());
        }
        if let Some(level) = row.verdict {
            self.statistics.verdicts[level as usize] += 1;
        }
        self.verdicts[index] = row.verdict;
        if row.verdict != Some(VerdictLevel::Adequate)
            && let Some(reason) = row.warnings.into_iter().next()
            && (self.reasons.len() < MOST_REASONS || self.reasons.contains_key(&reason))
        {
            *self.reasons.entry(reason).or_default() += 1;
        }
        for (name, estimate) in row.estimates.0 {
            let known = self.estimates.iter().position(|column| column.name == name);
            let column = known.unwrap_or_else(|| {
                self.estimates.push(Column {
                    name,
                    unit: estimate.unit,
                    values: vec![f64::NAN; self.count],
                });
                self.estimates.len() - 1
            });
            self.estimates[column].values[index] = estimate.value;
        }
        Ok(())
    }
}

/// Writes the rows as a table: record, columns of its table, estimates with their intervals, verdict, warnings, time, error.
fn write_rows(
    path: &Path,
    list: &RecordList,
    rows: &mut Lines,
    distributions: &[Distribution],
) -> io::Result<()> {
    let mut names = vec![("record".to_owned(), ColumnKind::Text)];
    let kinds: Vec<ColumnKind> = (0..list.columns.len()).map(|i| kind_of(list, i)).collect();
    let of_table = list.columns.iter().zip(&kinds);
    names.extend(of_table.map(|(name, kind)| (format!("table_{name}"), *kind)));
    for distribution in distributions {
        let name = &distribution.name;
        let ends = ["", "_low", "_high"].map(|end| (format!("{name}{end}"), ColumnKind::Number));
        names.extend(ends);
    }
    for (name, kind) in [
        ("verdict", ColumnKind::Text),
        ("warnings", ColumnKind::Text),
        ("seconds", ColumnKind::Number),
        ("error", ColumnKind::Text),
    ] {
        names.push((name.to_owned(), kind));
    }
    write_stream(path, |out| {
        let mut table = ParquetWriter::begin(out, names)?;
        for place in 0..rows.count() {
            let index = rows.places[place].record as usize;
            let row: Row = serde_json::from_str(&rows.line(place)?)?;
            let mut cells = vec![Cell::Text(row.record)];
            let of_table = list.records[index].columns.iter().zip(&kinds);
            cells.extend(of_table.map(|(text, kind)| match kind {
                ColumnKind::Text => Cell::Text(text.clone()),
                ColumnKind::Number => Cell::Number(text.parse().unwrap_or(f64::NAN)),
            }));
            for distribution in distributions {
                let estimate = row.estimates.get(&distribution.name);
                let ci95 = estimate.and_then(|e| e.ci95).unwrap_or([f64::NAN; 2]);
                let value = estimate.map_or(f64::NAN, |e| e.value);
                cells.extend([value, ci95[0], ci95[1]].map(Cell::Number));
            }
            let text = |text: Option<String>| text.map_or(Cell::Null, Cell::Text);
            cells.push(text(row.verdict.map(level_name)));
            cells.push(text(
                (!row.warnings.is_empty()).then(|| row.warnings.join("\n")),
            ));
            cells.push(Cell::Number(row.seconds));
            cells.push(text(row.error));
            table.row(cells)?;
        }
        table.end()
    })
}

/// Numbers where all cells of a column of the table are numbers or empty.
fn kind_of(list: &RecordList, column: usize) -> ColumnKind {
    let cells = list
        .records
        .iter()
        .map(|record| record.columns[column].as_str());
    let mut filled = cells.filter(|cell| !cell.is_empty()).peekable();
    match filled.peek().is_some() && filled.all(|cell| cell.parse::<f64>().is_ok()) {
        true => ColumnKind::Number,
        false => ColumnKind::Text,
    }
}

/// The level as in a row.
fn level_name(level: VerdictLevel) -> String {
    match level {
        VerdictLevel::Adequate => "adequate",
        VerdictLevel::Check => "check",
        VerdictLevel::Inadequate => "inadequate",
    }
    .to_owned()
}

/// Writes the curves of the records that have a row, one time in each row of the table.
fn write_curves(path: &Path, curves: &mut Lines, rows: &Lines) -> io::Result<()> {
    let names = [
        ("record", ColumnKind::Text),
        ("function", ColumnKind::Text),
        ("t_s", ColumnKind::Number),
        ("value", ColumnKind::Number),
        ("low", ColumnKind::Number),
        ("high", ColumnKind::Number),
    ];
    let names = names.map(|(name, kind)| (name.to_owned(), kind)).to_vec();
    write_stream(path, |out| {
        let mut table = ParquetWriter::begin(out, names)?;
        // The lines of a process that was killed before it wrote the row are there once more.
        let mut written: (u32, Vec<String>) = (u32::MAX, Vec::new());
        for place in 0..curves.count() {
            let index = curves.places[place].record;
            if !rows.has(index) {
                continue;
            }
            let curve: Curve = serde_json::from_str(&curves.line(place)?)?;
            if written.0 != index {
                written = (index, Vec::new());
            }
            if written.1.contains(&curve.function) {
                continue;
            }
            let limit = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(f64::NAN);
            for (i, (t, value)) in curve.t.iter().zip(&curve.value).enumerate() {
                let numbers = [*t, *value, limit(&curve.low, i), limit(&curve.high, i)];
                let texts = [curve.record.clone(), curve.function.clone()].map(Cell::Text);
                table.row(texts.into_iter().chain(numbers.map(Cell::Number)))?;
            }
            written.1.push(curve.function);
        }
        table.end()
    })
}
