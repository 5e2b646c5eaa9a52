//! Reading of a column of a file: times, and values in SI units within the time window.

use super::data_facts::{FIRST, MEAN, MERGED, MOST_PLACES, RecordNotes, fact};
use super::unit::QuantityColumn;
use crate::config::ModelFile;
use crate::config::alternatives::{OneOrList, ScalarOr};
use crate::config::build::asked_for;
use crate::config::spec::{ColumnRef, DecimalSign, Delimiter, ExperimentSpec, SourceSpec};
use crate::config::values::{ColumnId, Text};
use crate::error::InputError;
use crate::finding::Finding;
use crate::number_format::significant;
use crate::tables::{
    ColumnName, Duplicates, RepeatedTimes, SAMPLE_RATES, Table, TableFormat, lines_in_words,
    repeated_times, without_rounding,
};
use crate::units::{Quantity, Unit};
use serde_json::json;
use std::borrow::Cow;
use std::ops::Range;
use std::rc::Rc;

/// Default name of the column of times.
const TIME_COLUMN: &str = "t_s";

/// Samples of a column in SI units within the time window; NaN for a missing sample.
pub struct ColumnSamples {
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Values, SI.
    pub values: Vec<f64>,
    /// Unit of the values in the file.
    pub unit: Unit,
    /// Unit of the column of times; `None` for a sampling rate.
    pub time_unit: Option<Unit>,
    /// Values of a second column of the same file at the same times, SI.
    pub beside: Option<Vec<f64>>,
    /// Rows outside the window.
    pub outside: usize,
    /// Name of the column in the file.
    pub label: String,
    /// Detected format of the file, as text.
    pub format: String,
}

/// The rows of a column that have a number, in order; `None` where all have.
#[derive(Debug, Clone, PartialEq)]
pub struct PresentRows(Option<Vec<usize>>);

impl PresentRows {
    pub fn of(values: &[f64]) -> Self {
        let is_present = |row: &usize| !values[*row].is_nan();
        let has_gaps = values.iter().any(|value| value.is_nan());
        Self(has_gaps.then(|| (0..values.len()).filter(is_present).collect()))
    }

    /// The row of the sample `i` of those present.
    pub fn row(&self, i: usize) -> usize {
        self.0.as_ref().map_or(i, |rows| rows[i])
    }

    /// These rows of a column; a column that keeps all of them is not copied.
    pub fn pick<'a>(&self, column: &'a [f64]) -> Cow<'a, [f64]> {
        match &self.0 {
            None => Cow::Borrowed(column),
            Some(rows) => rows.iter().map(|row| column[*row]).collect(),
        }
    }

    /// These rows of a column that is no longer needed.
    pub fn picked(&self, column: Vec<f64>) -> Vec<f64> {
        match &self.0 {
            None => column,
            Some(rows) => rows.iter().map(|row| column[*row]).collect(),
        }
    }
}

/// A requested column, with its keys in the model file.
pub struct ColumnRequest<'a> {
    /// Number of the experiment.
    pub experiment: usize,
    /// Name of the channel: a key of `columns` and `units`.
    pub name: &'a str,
    /// Measured quantity.
    pub kind: Quantity,
    /// The column.
    pub column: &'a ColumnRef,
    /// Unit given in the model file.
    pub unit: Option<&'a Text>,
    /// Another column of the same file, in the same unit, and its key.
    pub beside: Option<(&'a str, &'a str)>,
}

fn column_name(id: &ColumnId) -> ColumnName {
    match id {
        ColumnId::Name(name) => ColumnName::Name(name.clone()),
        ColumnId::Number(number) => ColumnName::Number(*number),
    }
}

/// Reads the requested column.
pub fn read(
    file: &ModelFile,
    spec: &ExperimentSpec,
    wanted: &ColumnRequest,
    notes: &mut RecordNotes,
) -> Result<ColumnSamples, InputError> {
    let experiment = format!("experiments[{}]", wanted.experiment);
    let column_key = format!("{experiment}.columns.{}", wanted.name);
    let (id, own) = match wanted.column {
        ScalarOr::Scalar(id) => (id, None),
        ScalarOr::Map(source) => (&source.column, Some(source)),
    };
    let source = Source::of(file, spec, wanted, &column_key, (id, own))?;
    let tables = source.tables(notes)?;
    let table = source.table(&tables)?;
    for note in table.notes() {
        let name = file.experiment_name(wanted.experiment);
        notes.state(&name, Finding::new("file", note));
    }
    let column_key = match own {
        Some(_) => format!("{column_key}.column"),
        None => column_key,
    };
    let index = (table.find(&column_name(id))).map_err(asked_for(file, &column_key))?;
    let column = |index| QuantityColumn {
        file,
        experiment: &experiment,
        name: wanted.name,
        kind: wanted.kind,
        given: wanted.unit,
        table,
        index,
    };
    let unit = column(index).unit(&mut notes.warnings)?;
    let factor = unit.factor();
    let place = (wanted.experiment, &*experiment);
    let times = times(file, spec, place, own, table, notes)?;
    let values = table.samples(index).map_err(asked_for(file, &column_key))?;
    let beside = match wanted.beside {
        Some((name, key)) => {
            let found = table
                .find(&ColumnName::from(name))
                .map_err(asked_for(file, key))?;
            column(found).same_as(unit.unit, key, &mut notes.warnings);
            Some(table.samples(found).map_err(asked_for(file, key))?)
        }
        None => None,
    };
    let label = table.label(index);
    if label == times.label {
        return Err(file
            .error_at(
                &format!("{experiment}.columns"),
                format!(
                    "time and {} are the same column",
                    wanted.name.replace('_', " ")
                ),
            )
            .found(format!("`{label}`"))
            .expected("two columns"));
    }
    repeats(file, spec, wanted.experiment, table, &times, notes);
    let mut inside = inside(file, &experiment, spec, &times.values)?;
    // Responses are used at times at which every channel of the file has a sample before and after.
    let late = table.late(index);
    let lates = || (0..table.width()).map(|i| table.late(i));
    let is_response = Quantity::ALL.iter().any(|kind| kind.name() == wanted.name)
        && wanted.kind != Quantity::Force;
    if is_response && inside.len() > 2 {
        inside.start += usize::from(inside.start == 0 && lates().any(|other| other > late));
        let is_last = inside.end == times.values.len();
        inside.end -= usize::from(is_last && lates().any(|other| other < late));
    }
    let duplicates = spec.duplicates.unwrap_or_default();
    let codes = spec.missing.as_ref().map_or(&[][..], OneOrList::values);
    let is_code = |value: f64| codes.iter().any(|code| code.0 == value);
    let samples = |column| {
        let merged = times.repeated.merged(column, duplicates);
        let inside = merged[inside.clone()].iter();
        let value = |value: &f64| match is_code(*value) {
            true => f64::NAN,
            false => factor * value,
        };
        inside.map(value).collect()
    };
    let (values, beside) = (samples(values), beside.map(samples));
    let zero = spec.time_zero.map_or(0.0, |t| t.0);
    Ok(ColumnSamples {
        outside: times.values.len() - inside.len(),
        times: (times.values[inside].iter())
            .map(|t| t - zero + late)
            .collect(),
        values,
        beside,
        unit: unit.unit,
        time_unit: times.unit,
        label,
        format: table.format_in_words(),
    })
}

/// States the rows that repeat a time.
fn repeats(
    file: &ModelFile,
    spec: &ExperimentSpec,
    experiment: usize,
    table: &Table,
    times: &Times,
    notes: &mut RecordNotes,
) {
    let repeated = &times.repeated;
    if repeated.groups.is_empty() {
        return;
    }
    let (count, lines) = (repeated.excess(), repeated.lines(table, MOST_PLACES));
    let action = match spec.duplicates.unwrap_or_default() {
        _ if repeated.are_equal => MERGED,
        Duplicates::Mean => MEAN,
        Duplicates::First | Duplicates::Error => FIRST,
    };
    let repeat = if count == 1 {
        "row repeats"
    } else {
        "rows repeat"
    };
    let text = format!(
        "{count} {repeat} a time ({})",
        lines_in_words(&lines, count)
    );
    let found = json!({"count": count, "lines": lines});
    let fact = fact("repeated_times", &text, action, found);
    notes.state(&file.experiment_name(experiment), fact);
}

/// The file of a column: its own, or that of the experiment.
struct Source<'a> {
    file: &'a ModelFile,
    experiment: String,
    /// Key of the path.
    key: String,
    name: &'a str,
    format: TableFormat,
    /// The column, and those that are read with it.
    columns: Vec<ColumnName>,
}

impl<'a> Source<'a> {
    fn of(
        file: &'a ModelFile,
        spec: &'a ExperimentSpec,
        wanted: &ColumnRequest,
        column_key: &str,
        (id, own): (&ColumnId, Option<&'a SourceSpec>),
    ) -> Result<Self, InputError> {
        let experiment = format!("experiments[{}]", wanted.experiment);
        let time = own.and_then(|s| s.time.as_ref());
        let time = time.or_else(|| spec.columns.as_ref()?.time.as_ref());
        let mut columns = vec![column_name(id)];
        columns.extend(time.map(column_name));
        columns.extend(wanted.beside.map(|(name, _)| ColumnName::from(name)));
        let own = own.and_then(|s| s.data.as_ref());
        let key = format!("{}.data", own.map_or(&*experiment, |_| column_key));
        let data = own.or(spec.data.as_ref()).ok_or_else(|| {
            file.error_at(&experiment, "this experiment has no data")
                .expected("`data`, a CSV file with the samples")
        })?;
        Ok(Self {
            file,
            key,
            name: &data.0,
            format: format(spec),
            columns,
            experiment,
        })
    }

    fn tables(&self, notes: &mut RecordNotes) -> Result<Rc<[Table]>, InputError> {
        let tables = notes.tables(self.file, self.name, &self.format);
        tables.map_err(|error| self.about(error))
    }

    fn table<'t>(&self, tables: &'t [Table]) -> Result<&'t Table, InputError> {
        Table::with_columns(tables, &self.columns).map_err(|error| self.about(error))
    }

    fn about(&self, error: InputError) -> InputError {
        let error = about_format(self.file, &self.experiment, error);
        asked_for(self.file, &self.key)(error)
    }
}

/// The rows in the window, of increasing times.
fn inside(
    file: &ModelFile,
    experiment: &str,
    spec: &ExperimentSpec,
    times: &[f64],
) -> Result<Range<usize>, InputError> {
    let [from, to] = window(file, experiment, spec)?;
    let first = times.partition_point(|t| *t < from);
    let inside = first..times.partition_point(|t| *t <= to);
    match inside.is_empty() {
        false => Ok(inside),
        true => Err(file
            .error_at(
                &format!("{experiment}.window"),
                "no sample lies in the window",
            )
            .found(match (from.is_finite(), to.is_finite()) {
                (true, true) => format!("{from} s to {to} s"),
                (true, false) => format!("from {from} s to the end of the record"),
                (false, _) => format!("from the start of the record to {to} s"),
            })
            .expected(format!(
                "a part of {} s to {} s",
                significant(times[0], 6),
                significant(times[times.len() - 1], 6)
            ))),
    }
}

/// Table format of the files of an experiment, as far as the model gives it.
fn format(spec: &ExperimentSpec) -> TableFormat {
    let Some(given) = &spec.format else {
        return TableFormat::default();
    };
    TableFormat {
        delimiter: given.delimiter.map(|d| match d {
            Delimiter::Comma => ',',
            Delimiter::Semicolon => ';',
            Delimiter::Tab => '\t',
        }),
        decimal: given.decimal.map(|d| match d {
            DecimalSign::Point => '.',
            DecimalSign::Comma => ',',
        }),
        skip: given.skip.map(|count| count.0),
        header: given.header,
        units_row: given.units_row,
    }
}

/// Moves an error about an argument of the format to its key.
fn about_format(file: &ModelFile, experiment: &str, error: InputError) -> InputError {
    match &error.place {
        crate::error::Location::Argument(name) => {
            let key = format!("{experiment}.format.{name}");
            file.error_about(&key, error)
        }
        _ => error,
    }
}

struct Times {
    /// Each time once.
    values: Vec<f64>,
    label: String,
    unit: Option<Unit>,
    /// Rows that repeat a time.
    repeated: RepeatedTimes,
}

/// The times of the rows, in s.
fn times(
    file: &ModelFile,
    spec: &ExperimentSpec,
    (number, experiment): (usize, &str),
    own: Option<&SourceSpec>,
    table: &Table,
    notes: &mut RecordNotes,
) -> Result<Times, InputError> {
    let own_rate = own.and_then(|s| s.sample_rate);
    let own_column = own.and_then(|s| s.time.as_ref());
    let shared_column = spec.columns.as_ref().and_then(|c| c.time.as_ref());
    let rate = match (own_rate, own_column) {
        (Some(rate), None) => Some(rate),
        (None, Some(_)) => None,
        (Some(_), Some(_)) => return Err(two_times(file, experiment)),
        (None, None) => match (spec.sample_rate, shared_column) {
            (Some(_), Some(_)) => return Err(two_times(file, experiment)),
            (rate, _) => rate,
        },
    };
    if let Some(rate) = rate {
        if !SAMPLE_RATES.contains(&rate.0) {
            return Err(file
                .error_at(
                    &format!("{experiment}.sample_rate"),
                    "invalid sampling rate",
                )
                .found(format!("{:?}", rate.0))
                .expected(rates()));
        }
        let values = (0..table.rows()).map(|i| i as f64 / rate.0).collect();
        let label = String::new();
        return Ok(Times {
            values,
            label,
            unit: None,
            repeated: RepeatedTimes {
                groups: Vec::new(),
                are_equal: true,
            },
        });
    }
    let default = ColumnId::Name(TIME_COLUMN.to_owned());
    let id = own_column.or(shared_column).unwrap_or(&default);
    let key = format!("{experiment}.columns.time");
    // A file that states its sampling rate needs no column of times.
    let stated = table.time_column().filter(|_| std::ptr::eq(id, &default));
    let index = stated.map_or_else(|| table.find(&column_name(id)), Ok);
    let index = index.map_err(|error| {
        let error = asked_for(file, &key)(error);
        match own_column.or(shared_column) {
            None => error.hint("name it with `columns: {time: …}`, or give `sample_rate: …`"),
            Some(_) => error,
        }
    })?;
    let column = QuantityColumn {
        file,
        experiment,
        name: "time",
        kind: Quantity::Time,
        given: spec.units.as_ref().and_then(|u| u.time.as_ref()),
        table,
        index,
    };
    let unit = column.unit(&mut notes.warnings)?;
    let duplicates = spec.duplicates.unwrap_or_default();
    let repeated = repeated_times(table, index, duplicates).map_err(asked_for(file, &key))?;
    let values = table.values(index).map_err(asked_for(file, &key))?;
    let mut values = repeated.merged(values, Duplicates::First);
    if let Some(exact) = without_rounding(&values) {
        let (digits, rate) = (exact.digits, 1.0 / (exact.step * unit.factor()));
        let text = format!(
            "times printed with {digits} decimals: taken as equally spaced, at {} Hz",
            significant(rate, 9)
        );
        let found = json!({"digits": digits, "rate": rate});
        let fact = Finding::having("rounded_times", text, found);
        notes.state(&file.experiment_name(number), fact);
        values = exact.times.into();
    }
    Ok(Times {
        values: values.iter().map(|t| t * unit.factor()).collect(),
        label: table.label(index),
        unit: Some(unit.unit),
        repeated,
    })
}

/// The sampling rates that are accepted, for messages.
fn rates() -> String {
    let (least, most) = (SAMPLE_RATES.start(), SAMPLE_RATES.end());
    format!("samples per second, a number from {least:e} to {most:e}")
}

fn two_times(file: &ModelFile, experiment: &str) -> InputError {
    file.error_at(
        &format!("{experiment}.sample_rate"),
        "both a sampling rate and a column of times are given",
    )
    .found("`sample_rate` beside a column of times")
    .expected("one of the two")
}

/// First and last time of the window, on the time axis of the file.
pub fn window(
    file: &ModelFile,
    experiment: &str,
    spec: &ExperimentSpec,
) -> Result<[f64; 2], InputError> {
    let Some(window) = &spec.window else {
        return Ok([f64::NEG_INFINITY, f64::INFINITY]);
    };
    let from = window.min.map_or(f64::NEG_INFINITY, |t| t.0);
    let to = window.max.map_or(f64::INFINITY, |t| t.0);
    if from >= to {
        return Err(file
            .error_at(&format!("{experiment}.window"), "the window is empty")
            .found(format!("{from} s to {to} s"))
            .expected("`min` less than `max`"));
    }
    Ok([from, to])
}
