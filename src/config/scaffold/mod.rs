//! A commented model file for a table of samples, as `kmcfit init` writes it.
//!
//! Columns are assigned by options, then by units, then by names. Where nothing determines the mass, the model states that it is unknown.

mod columns;
mod functions;
mod record_summary;
mod roles;
mod sensors;
mod statements;

use crate::error::InputError;
use crate::memory;
use crate::tables::{self, Table, TableFormat};
use crate::text_io::{listed, quote};
pub(super) use columns::ColumnAssignment;
pub use columns::{rate, recognised};
use kmcfit_core::number_format::{count, significant};
use record_summary::RecordSummary;
pub use roles::Role;
use sensors::sensors;
pub use statements::Statements;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Memory for each row beside the table, bytes: times, samples and spectrum. Measured: 150 bytes per row in total for a
/// million rows of two columns.
const PER_ROW: u64 = 200;

/// A record: its file, or its content in memory, and its name in the model file.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Path.
    pub path: PathBuf,
    /// Name in the model file.
    pub name: String,
    /// Content in place of the file.
    pub content: Option<Arc<[u8]>>,
}

impl Source {
    /// A file, by its path and its name in the model file.
    pub fn file(path: impl Into<PathBuf>, name: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            name: name.into(),
            content: None,
        }
    }

    /// A content in memory, by its name in the model file.
    pub fn in_memory(name: &str, content: impl Into<Arc<[u8]>>) -> Self {
        Self {
            content: Some(content.into()),
            ..Self::file(name, name)
        }
    }

    /// All its tables.
    fn tables(&self) -> Result<Vec<Table>, InputError> {
        let format = TableFormat::default();
        match &self.content {
            Some(content) => Table::parse_all(&self.path, &**content, &format),
            None => Table::read_all(&self.path, &format),
        }
    }
}

/// A model file and the findings that it is based on.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaffold {
    /// The text of the model file.
    pub text: String,
    /// Findings on each table, one sentence each, with its path.
    pub found: Vec<(PathBuf, Vec<String>)>,
    /// True if nothing determines the mass.
    pub has_unknown_mass: bool,
}

/// A record with its columns.
struct FileRecord<'a> {
    source: &'a Source,
    table: Table,
    columns: ColumnAssignment,
    /// Codes that stand for missing samples, in the unit of the file, with their numbers.
    codes: Vec<(f64, usize)>,
    summary: RecordSummary,
}

/// A model file for tables, one experiment each, with the statements of the options.
///
/// # Errors
/// When a table cannot be read, has no times or no measured response, or a column cannot be converted to samples; when a statement
/// concerns no column.
pub fn scaffold(sources: &[Source], statements: &Statements) -> Result<Scaffold, InputError> {
    let records = read(sources, statements)?;
    let found = records
        .iter()
        .map(|record| (record.source.path.clone(), findings(record)));
    Ok(Scaffold {
        found: found.collect(),
        has_unknown_mass: functions::is_unknown(&records, statements),
        text: text(&records, statements),
    })
}

fn read<'a>(
    sources: &'a [Source],
    statements: &Statements,
) -> Result<Vec<FileRecord<'a>>, InputError> {
    let mut is_used: Vec<bool> = Vec::new();
    let mut records = Vec::new();
    for source in sources {
        for (table, columns, used) in records_of(source, statements)? {
            memory::check_file(&source.path, table.rows() as u64 * PER_ROW)?;
            is_used = match is_used.is_empty() {
                true => used,
                false => is_used.iter().zip(used).map(|(a, b)| *a || b).collect(),
            };
            let codes = tables::codes(&table, columns.measured());
            let summary = RecordSummary::of(&table, &columns, &codes)?;
            records.push(FileRecord {
                source,
                table,
                columns,
                codes,
                summary,
            });
        }
    }
    let tables: Vec<&Table> = records.iter().map(|record| &record.table).collect();
    statements.check_used(&is_used, &tables)?;
    Ok(records)
}

/// Findings on a table, one sentence each.
fn findings(record: &FileRecord) -> Vec<String> {
    let FileRecord {
        table,
        columns,
        summary,
        codes,
        ..
    } = record;
    let mut found = Vec::new();
    if !codes.is_empty() {
        let each = codes.iter();
        let each = each.map(|(code, found)| format!("{} of {code}", count(*found, "value")));
        let each: Vec<String> = each.collect();
        found.push(format!(
            "{} taken as missing samples: far outside the others (`missing`)",
            each.join(" and ")
        ));
    }
    if let Some(begins) = summary.begins {
        found.push(format!("at rest before {begins} s: excluded by `window`"));
    }
    if summary.is_kept_up {
        found.push(
            "no force is measured and the motion does not decay: the record gives the natural frequency alone"
                .to_owned(),
        );
    }
    if let Some([from, to]) = summary.known {
        found.push(format!(
            "the input has missing values; {from} to {to} s is the longest part without: chosen by `window`"
        ));
    }
    found.push(format!(
        "{} samples over {} s, {}",
        summary.samples,
        short(summary.duration),
        summary.spacing_in_words()
    ));
    found.extend_from_slice(table.notes());
    found.extend(columns.in_words(table));
    let others: Vec<String> = table.channels_of_other_times().map(quote).collect();
    if !others.is_empty() {
        let others = listed(others.iter().map(String::as_str));
        found.push(format!("not used, of another length or rate: {others}"));
    }
    for other in table.unusable() {
        found.push(format!("not usable: `{}`, {}", other.name, other.content));
    }
    if let Some(lines) = &summary.repeated {
        found.push(format!(
            "times are repeated in {lines}: the model uses the first row of each time (`duplicates: first`)"
        ));
    }
    if let Some((outliers, first)) = summary.outliers {
        let outliers = count(outliers, "outlier");
        found.push(format!(
            "{outliers} (first: {}): if these stand for missing samples, use empty fields; the model has a robust loss",
            significant(first / summary.channel.1, 4)
        ));
    }
    found.push(match summary.frequency {
        Some(frequency) => format!(
            "dominant frequency {} Hz: {} in the record",
            short(frequency),
            count(summary.periods().round() as usize, "period")
        ),
        None => "no dominant frequency was found".into(),
    });
    found
}

/// The table of a file with its columns: of several sets of channels the only one with times and a measured response, and each run of a
/// text table with runs side by side.
fn records_of(
    source: &Source,
    statements: &Statements,
) -> Result<Vec<(Table, ColumnAssignment, Vec<bool>)>, InputError> {
    let mut tables = source.tables()?;
    let has_samples = tables.iter().any(|table| table.rows() > 1);
    tables.retain(|table| !has_samples || table.rows() > 1);
    if let [table] = tables.as_slice() {
        let (columns, is_used) = ColumnAssignment::of(table, statements)?;
        return Ok(vec![(tables.remove(0), columns, is_used)]);
    }
    if tables.iter().all(|table| table.text_format().is_some()) {
        let runs = tables.into_iter().map(|table| {
            let (columns, is_used) = ColumnAssignment::of(&table, statements)?;
            Ok((table, columns, is_used))
        });
        return runs.collect();
    }
    let mut found = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let columns =
            ColumnAssignment::as_in_run(table, statements.sample_rate, Vec::new(), Vec::new());
        let is_record = |columns: &ColumnAssignment| columns.channels().next().is_some();
        if columns.is_ok_and(|columns| is_record(&columns)) {
            found.push(i);
        }
    }
    let [only] = found.as_slice() else {
        return Err(Table::several(&tables));
    };
    let table = tables.remove(*only);
    let (columns, is_used) = ColumnAssignment::of(&table, statements)?;
    Ok(vec![(table, columns, is_used)])
}

fn text(records: &[FileRecord], statements: &Statements) -> String {
    let title = records
        .first()
        .map_or(String::new(), |record| stem(record.source));
    let mut text = format!(
        "# yaml-language-server: $schema=kmcfit.schema.json\n\
         # Model file written by `kmcfit init`. Check it with `kmcfit check`, fit it with `kmcfit fit`;\n\
         # `kmcfit explain KEY` explains a key.\n\
         format: 1\n\
         title: {}\n\
         experiments:\n",
        quoted(&title),
    );
    for (i, record) in records.iter().enumerate() {
        let name = match records {
            [_] => "record 1".to_owned(),
            _ => format!("record {}: {}", i + 1, stem(record.source)),
        };
        text += &format!(
            "  - name: {}\n    data: {}\n",
            quoted(&name),
            quoted(&record.source.name)
        );
        // The functions are shared: all records begin at the same time.
        let others = records
            .iter()
            .any(|other| other.summary.from != records[0].summary.from);
        for (key, value, comment) in keys(record, others) {
            if let Some(value) = value {
                text += &commented(&format!("{key}: {value}"), &comment);
            }
        }
    }
    text += &commented(
        "grid: {nodes: auto}",
        "chosen from the spectrum of the record",
    );
    text + &functions::functions(records, statements)
        + &commented(
            "# truth: {data: truth.csv}",
            "the true functions, where they are known",
        )
        + &match records.iter().all(|record| record.summary.is_kept_up) {
            true => commented(
                "fit: {method: equation-error}",
                "no force is measured and none of the motion decays: the natural frequency alone follows",
            ),
            false => commented(
                "fit: {method: gauss-newton, stop: {iterations: 100, tolerance: 1.0e-8}}",
                "",
            ),
        }
}

/// Name of a file without its extension.
fn stem(source: &Source) -> String {
    let stem = Path::new(&source.name).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The keys of a record, each with its value and a comment.
fn keys(
    FileRecord {
        table,
        columns,
        summary: record,
        codes,
        ..
    }: &FileRecord,
    begins_at_zero: bool,
) -> Vec<(&'static str, Option<String>, String)> {
    let sigmas: Vec<String> = (columns.channels())
        .map(|role| format!("{}: estimate", role.key()))
        .collect();
    let has_base = columns.has(Role::BaseAcceleration) || columns.has(Role::BaseDisplacement);
    let between = |between: &str| Some(format!("{{interpolation: {between}}}"));
    let or = "between samples: or hold, linear, cubic";
    // A displacement is differentiated twice.
    let (of_base, or_base) = match columns.has(Role::BaseDisplacement) {
        true => ("cubic", "between samples"),
        false => (record.between, or),
    };
    let (sensors, why) = sensors(columns, table, record, codes);
    let repeated = record.repeated.as_deref().unwrap_or_default();
    let repeated = format!("times are repeated in {repeated}; or `mean`");
    let robust = format!("{{{}: huber}}", record.channel.0.key());
    let keys = [
        (
            "    columns",
            Some(columns.named(table)),
            "by name or by number from 1",
        ),
        (
            "    sample_rate",
            columns.sample_rate.map(|r| r.to_string()),
            "Hz",
        ),
        ("    units", columns.units(), "converted to SI"),
        (
            "    # units",
            columns.assumed_units(),
            "ASSUMED, the file states none: enter others under `units`",
        ),
        (
            "    duplicates",
            record.repeated.as_ref().map(|_| "first".to_owned()),
            &repeated,
        ),
        (
            "    missing",
            (!codes.is_empty()).then(|| {
                let each: Vec<String> = codes.iter().map(|(code, _)| format!("{code:?}")).collect();
                format!("[{}]", each.join(", "))
            }),
            "values that stand for missing samples: far outside the others",
        ),
        (
            "    window",
            record.begins.map(|begins| format!("{{min: {begins}}}")),
            "s; at rest before (not yet released or struck)",
        ),
        (
            "    window",
            (record.known).map(|[from, to]| format!("{{min: {from}, max: {to}}}")),
            "s; the longest part in which no value of the input is missing",
        ),
        (
            "    time_zero",
            begins_at_zero.then(|| format!("{:?}", record.from)),
            "s; this time of the file becomes 0, as all records share the functions",
        ),
        (
            "    force",
            between(record.between).filter(|_| columns.has(Role::Force)),
            or,
        ),
        ("    base", between(of_base).filter(|_| has_base), or_base),
        (
            "    sigma",
            Some(format!("{{{}}}", sigmas.join(", "))),
            "standard deviation of a sample, SI; give a number if it is known",
        ),
        (
            "    loss",
            record.outliers.map(|_| robust),
            "robust against outliers; or `squares`",
        ),
        (
            "    sensors",
            (!sensors.is_empty()).then(|| format!("{{{}}}", sensors.join(", "))),
            &why.join("; "),
        ),
        (
            "    initial",
            Some("estimate".into()),
            "or {displacement: …, velocity: …} in m and m/s",
        ),
    ];
    let owned = keys.map(|(key, value, comment)| (key, value, comment.to_owned()));
    owned.into()
}

/// A line followed by a comment, aligned where the line is short enough.
fn commented(line: &str, comment: &str) -> String {
    match comment {
        "" => format!("{line}\n"),
        _ => format!("{line:<48}  # {comment}\n"),
    }
}

/// Four significant digits. A power of ten has a decimal point, without which YAML 1.1 reads a text.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    let text = format!("{rounded:?}");
    match text.split_once('e') {
        Some((digits, power)) if !digits.contains('.') => format!("{digits}.0e{power}"),
        _ => text.trim_end_matches(".0").to_owned(),
    }
}

/// A text quoted for YAML where necessary, also inside a list or map.
fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_/.- ".contains(c);
    let begins = text.starts_with(char::is_alphabetic) || text.starts_with("../");
    let word = matches!(
        text.to_ascii_lowercase().as_str(),
        "true" | "false" | "null" | "yes" | "no" | "on" | "off" | "estimate"
    );
    let plain = begins && !word && text.chars().all(is_plain) && !text.ends_with(' ');
    match plain {
        true => text.to_owned(),
        false => serde_json::Value::from(text).to_string(),
    }
}
