//! A commented model file for a table of samples, as `kmcfit init` writes it.
//!
//! Columns are assigned by units, then by names; the start value of the stiffness follows from the dominant frequency.
//! Quantities that the table does not determine (the mass in a free decay) get a placeholder and a comment.

mod calibration;
mod columns;
mod record_summary;

use crate::error::InputError;
use crate::memory;
use crate::number_format::significant;
use crate::tables::{Table, TableFormat};
use crate::text_io::{listed, quote};
pub(super) use columns::ColumnAssignment;
pub use columns::{Role, rate, recognised};
use record_summary::RecordSummary;
use std::path::Path;

/// Start value of the damping ratio: that of a lightly damped structure.
const DAMPING_RATIO: f64 = 0.02;
/// Periods of the response below which the stiffness is constant: fewer do not show how it varies.
const FEWEST_PERIODS: f64 = 4.0;

/// Relative difference below which two sampling rates are equal.
const SAME_RATE: f64 = 0.01;

/// Memory for each row beside the table, bytes: times, samples and spectrum. Measured: 150 bytes per row in total for a
/// million rows of two columns.
const PER_ROW: u64 = 200;

/// A model file and the findings that it is based on.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaffold {
    /// The text of the model file.
    pub text: String,
    /// Findings on the table, one sentence each.
    pub found: Vec<String>,
}

/// A model file for the table at `csv`, under the name `data`. `sample_rate` is the sampling rate in Hz of a table
/// without a column of times; `units` has the value and unit of the full scale of each channel of a file without units,
/// separated by commas.
///
/// # Errors
/// When the table cannot be read, has no times or no measured response, or a column cannot be converted to samples.
pub fn scaffold(
    csv: &Path,
    data: &str,
    sample_rate: Option<f64>,
    units: Option<&str>,
) -> Result<Scaffold, InputError> {
    let (table, columns) = record(csv, sample_rate, units)?;
    memory::check_file(csv, table.rows() as u64 * PER_ROW)?;
    let record = RecordSummary::of(&table, &columns, sample_rate)?;
    let mut found = vec![format!(
        "{} samples over {} s, {}",
        record.samples,
        short(record.duration),
        record.spacing_in_words()
    )];
    if let Some(begins) = record.begins {
        found.insert(
            0,
            format!("at rest before {begins} s: excluded by `window`"),
        );
    }
    found.extend(columns.in_words(&table));
    let others: Vec<String> = table.channels_of_other_times().map(quote).collect();
    if !others.is_empty() {
        let others = listed(others.iter().map(String::as_str));
        found.push(format!("not used, of another length or rate: {others}"));
    }
    if let Some(lines) = &record.repeated {
        found.push(format!(
            "times are repeated in {lines}: the model uses the first row of each time (`duplicates: first`)"
        ));
    }
    if let Some((count, first)) = record.outliers {
        let outliers = match count {
            1 => "1 outlier".to_owned(),
            _ => format!("{count} outliers"),
        };
        found.push(format!(
            "{outliers} (first: {}): if these stand for missing samples, use empty fields; the model has a robust loss",
            significant(first / record.channel.1, 4)
        ));
    }
    if let (Some(given), Some((index, rate))) = (sample_rate, columns::rate(&table))
        && (rate / given - 1.0).abs() > SAME_RATE
    {
        found.push(format!(
            "`--sample-rate {given}` is used, although `{}` has {} Hz",
            table.label(index),
            significant(rate, 4)
        ));
    }
    found.push(match record.frequency {
        Some(frequency) => format!(
            "dominant frequency {} Hz: {} in the record",
            short(frequency),
            match record.periods().round() {
                1.0 => "1 period".to_owned(),
                periods => format!("{periods} periods"),
            }
        ),
        None => "no dominant frequency was found".into(),
    });
    Ok(Scaffold {
        text: text(&table, data, &columns, &record, sample_rate),
        found,
    })
}

/// The table of a file with its columns; of several sets of channels the only one with times and a measured response.
fn record(
    csv: &Path,
    sample_rate: Option<f64>,
    units: Option<&str>,
) -> Result<(Table, ColumnAssignment), InputError> {
    let mut tables = Table::read_all(csv, &TableFormat::default())?;
    if let Some(units) = units {
        for table in &mut tables {
            calibration::apply(table, units)?;
        }
    }
    let has_samples = tables.iter().any(|table| table.rows() > 1);
    tables.retain(|table| !has_samples || table.rows() > 1);
    if let [table] = tables.as_slice() {
        let columns = ColumnAssignment::of(table, sample_rate)?;
        return Ok((tables.remove(0), columns));
    }
    let mut found = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let columns = ColumnAssignment::without_guess(table, sample_rate);
        let columns = columns
            .ok()
            .filter(|columns| columns.channels().next().is_some());
        found.extend(columns.map(|columns| (i, columns)));
    }
    match (found.pop(), found.is_empty()) {
        (Some((i, columns)), true) => Ok((tables.remove(i), columns)),
        _ => Err(Table::several(&tables)),
    }
}

fn text(
    table: &Table,
    data: &str,
    columns: &ColumnAssignment,
    record: &RecordSummary,
    sample_rate: Option<f64>,
) -> String {
    let name = Path::new(data)
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    let mut text = format!(
        "# yaml-language-server: $schema=kmcfit.schema.json\n\
         # Model file written by `kmcfit init`. Check it with `kmcfit check`, fit it with `kmcfit fit`;\n\
         # `kmcfit explain KEY` explains a key.\n\
         format: 1\n\
         title: {}\n\
         experiments:\n  \
           - name: record 1\n    \
             data: {}\n",
        quoted(&name),
        quoted(data)
    );
    for (key, value, comment) in keys(table, columns, record, sample_rate) {
        if let Some(value) = value {
            text += &commented(&format!("{key}: {value}"), &comment);
        }
    }
    text + &functions(columns, record)
        + &commented(
            "# truth: {data: truth.csv}",
            "the true functions, where they are known",
        )
        + &commented(
            "fit: {method: gauss-newton, stop: {iterations: 100, tolerance: 1.0e-8}}",
            "",
        )
}

/// The keys of the record and the grid, each with its value and a comment.
fn keys(
    table: &Table,
    columns: &ColumnAssignment,
    record: &RecordSummary,
    sample_rate: Option<f64>,
) -> Vec<(&'static str, Option<String>, String)> {
    let sigmas: Vec<String> = (columns.channels())
        .map(|role| format!("{}: estimate", role.key()))
        .collect();
    let has_base = columns.has(Role::BaseAcceleration) || columns.has(Role::BaseDisplacement);
    let between = format!("{{interpolation: {}}}", record.between);
    let or = "between samples: or hold, linear, cubic";
    let (sensors, why) = sensors(columns, record);
    let repeated = record.repeated.as_deref().unwrap_or_default();
    let repeated = format!("times are repeated in {repeated}; or `mean`");
    let robust = format!("{{{}: huber}}", record.channel.0.key());
    let keys = [
        (
            "    columns",
            Some(columns.named(table)),
            "by name or by number from 1",
        ),
        ("    sample_rate", sample_rate.map(|r| r.to_string()), "Hz"),
        ("    units", columns.units(table), &columns.units_comment()),
        (
            "    duplicates",
            record.repeated.as_ref().map(|_| "first".to_owned()),
            &repeated,
        ),
        (
            "    window",
            record.begins.map(|begins| format!("{{min: {begins}}}")),
            "s; at rest before (not yet released or struck)",
        ),
        (
            "    force",
            columns.has(Role::Force).then(|| between.clone()),
            or,
        ),
        ("    base", has_base.then_some(between), or),
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
        (
            "grid",
            Some("{nodes: auto}".into()),
            "chosen from the spectrum of the record",
        ),
    ];
    let owned = keys.map(|(key, value, comment)| (key, value, comment.to_owned()));
    owned.into()
}

/// Sensors with estimated parameters, and the reasons.
fn sensors(
    columns: &ColumnAssignment,
    record: &RecordSummary,
) -> (Vec<&'static str>, Vec<&'static str>) {
    let mut sensors = Vec::new();
    if columns.has(Role::Acceleration) {
        sensors.push((
            "acceleration: {offset: estimate}",
            "accelerometers usually have an offset; remove the line if yours has none",
        ));
    }
    // A static force can cause the offset of a displacement.
    if columns.has(Role::Displacement) && !columns.has(Role::Force) {
        if record.drifts {
            sensors.push((
                "displacement: {offset: estimate, drift: estimate}",
                "the record oscillates about a sloping line",
            ));
        } else if record.is_off_centre {
            sensors.push((
                "displacement: {offset: estimate}",
                "the record oscillates about a value other than zero",
            ));
        }
    }
    sensors.into_iter().unzip()
}

/// The coefficient functions, with start values that give the dominant frequency.
fn functions(columns: &ColumnAssignment, record: &RecordSummary) -> String {
    let omega = std::f64::consts::TAU * record.frequency.unwrap_or(1.0);
    let driven = columns.has(Role::Force);
    let mass = match driven {
        true => record.mass(omega).unwrap_or(1.0),
        false => 1.0,
    };
    let mut text = String::from("functions:\n");
    text += &match driven {
        true => commented(
            &format!("  mass:      {{basis: constant, start: {}}}", short(mass)),
            "kg; identifiable, because the force is measured",
        ),
        false => commented(
            "  mass:      {fixed: 1.0}",
            "kg; ASSUMED, enter your own: without a measured force only k/m and c/m are identifiable",
        ),
    };
    let damping = 2.0 * DAMPING_RATIO * mass * omega;
    text += &commented(
        &format!(
            "  damping:   {{basis: constant, start: {}}}",
            short(damping)
        ),
        "N s/m; start value: 2 % of critical damping",
    );
    let stiffness = short(mass * omega * omega);
    text += &match record.periods() >= FEWEST_PERIODS {
        true => commented(
            &format!("  stiffness: {{basis: b-spline, knots: auto, start: {stiffness}}}"),
            "N/m; varies smoothly; for a constant write {basis: constant, start: …}",
        ),
        false => commented(
            &format!("  stiffness: {{basis: constant, start: {stiffness}}}"),
            "N/m; the record is too short to show a variation",
        ),
    };
    text
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
