//! Reading of a column of a file: times, and values in SI units within the time window.

use super::Entry;
use super::data_facts::{FIRST, MEAN, MERGED, MOST_PATHS, RecordNotes, fact};
use super::unit::QuantityColumn;
use crate::config::lowering::ModelKey;
use crate::error::{InputError, Location};
use crate::tables::{
    ColumnName, Duplicates, RepeatedTimes, SAMPLE_RATES, Table, TableFormat, lines_in_words,
    repeated_times, sample_rates, without_rounding,
};
use crate::units::{Measurand, Unit};
use kmcfit_core::finding::Finding;
use kmcfit_core::model::{
    ColumnId, ColumnRef, DecimalSign, Delimiter, ExperimentSpec, OneOrList, ScalarOr, SourceSpec,
};
use kmcfit_core::number_format::significant;
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
    pub entry: &'a Entry<'a>,
    /// Name of the channel: a key of `columns` and `units`.
    pub name: &'a str,
    /// Measured quantity.
    pub kind: Measurand,
    /// The column.
    pub column: &'a ColumnRef,
    /// Unit given in the model file.
    pub unit: Option<&'a String>,
    /// Another column of the same file, in the same unit, and its key.
    pub beside: Option<(&'a str, &'a ModelKey<'a>)>,
}

fn column_name(id: &ColumnId) -> ColumnName {
    match id {
        ColumnId::Name(name) => ColumnName::Name(name.clone()),
        ColumnId::Number(number) => ColumnName::Number(*number),
    }
}

/// Reads the requested column.
pub fn read(wanted: &ColumnRequest, notes: &mut RecordNotes) -> Result<ColumnSamples, InputError> {
    let (entry, spec) = (wanted.entry, wanted.entry.spec);
    let mut at = entry.at.below(&format!("columns.{}", wanted.name));
    let (id, own) = match wanted.column {
        ScalarOr::Scalar(id) => (id, None),
        ScalarOr::Map(source) => (&source.column, Some(source)),
    };
    let source = Source::of(wanted, &at, (id, own))?;
    let tables = source.tables(notes)?;
    let table = source.table(&tables)?;
    for note in table.notes() {
        notes.state(&entry.name(), Finding::new("file", note));
    }
    if own.is_some() {
        at = at.below("column");
    }
    let index = (table.find(&column_name(id))).map_err(at.asks_for())?;
    let column = |index| QuantityColumn {
        at: &entry.at,
        name: wanted.name,
        kind: wanted.kind,
        given: wanted.unit,
        table,
        index,
    };
    let unit = column(index).unit(&mut notes.warnings)?;
    let factor = unit.factor();
    let times = times(entry, own, table, notes)?;
    let values = table.samples(index).map_err(at.asks_for())?;
    let beside = match wanted.beside {
        Some((name, at)) => {
            let found = (table.find(&ColumnName::from(name))).map_err(at.asks_for())?;
            column(found).same_as(unit.unit, &at.key, &mut notes.warnings);
            Some(table.samples(found).map_err(at.asks_for())?)
        }
        None => None,
    };
    let label = table.label(index);
    if label == times.label {
        let name = wanted.name.replace('_', " ");
        return Err((entry.at)
            .error_in("columns", format!("time and {name} are the same column"))
            .found(format!("`{label}`"))
            .expected("two columns"));
    }
    repeats(entry, table, &times, notes);
    let mut inside = inside(entry, &times.values)?;
    // Responses are used at times at which every channel of the file has a sample before and after.
    let late = table.late(index);
    let lates = || (0..table.width()).map(|i| table.late(i));
    let is_response = Measurand::ALL.iter().any(|kind| kind.name() == wanted.name)
        && wanted.kind != Measurand::Force;
    if is_response && inside.len() > 2 {
        inside.start += usize::from(inside.start == 0 && lates().any(|other| other > late));
        let is_last = inside.end == times.values.len();
        inside.end -= usize::from(is_last && lates().any(|other| other < late));
    }
    let duplicates = spec.duplicates.unwrap_or_default();
    let codes = spec.missing.as_ref().map_or(&[][..], OneOrList::values);
    let is_code = |value: f64| codes.contains(&value);
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
    let zero = spec.time_zero.unwrap_or(0.0);
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
fn repeats(entry: &Entry<'_>, table: &Table, times: &Times, notes: &mut RecordNotes) {
    let repeated = &times.repeated;
    if repeated.groups.is_empty() {
        return;
    }
    let (count, lines) = (repeated.excess(), repeated.lines(table, MOST_PATHS));
    let action = match entry.spec.duplicates.unwrap_or_default() {
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
    notes.state(&entry.name(), fact);
}

/// The file of a column: its own, or that of the experiment.
struct Source<'a> {
    entry: &'a Entry<'a>,
    /// Key of the path.
    at: ModelKey<'a>,
    name: &'a str,
    format: TableFormat,
    /// The column, and those that are read with it.
    columns: Vec<ColumnName>,
}

impl<'a> Source<'a> {
    fn of(
        wanted: &ColumnRequest<'a>,
        column: &ModelKey<'a>,
        (id, own): (&ColumnId, Option<&'a SourceSpec>),
    ) -> Result<Self, InputError> {
        let (entry, spec) = (wanted.entry, wanted.entry.spec);
        let time = own.and_then(|s| s.time.as_ref());
        let time = time.or_else(|| spec.columns.as_ref()?.time.as_ref());
        let mut columns = vec![column_name(id)];
        columns.extend(time.map(column_name));
        columns.extend(wanted.beside.map(|(name, _)| ColumnName::from(name)));
        let own = own.and_then(|s| s.data.as_ref());
        let at = own.map_or(&entry.at, |_| column).below("data");
        let data = own.or(spec.data.as_ref()).ok_or_else(|| {
            (entry.at.error("this experiment has no data"))
                .expected("`data`, a CSV file with the samples")
        })?;
        Ok(Self {
            entry,
            at,
            name: data,
            format: format(spec),
            columns,
        })
    }

    fn tables(&self, notes: &mut RecordNotes) -> Result<Rc<[Table]>, InputError> {
        let tables = notes.tables(self.at.file, self.name, &self.format);
        tables.map_err(|error| self.about(error))
    }

    fn table<'t>(&self, tables: &'t [Table]) -> Result<&'t Table, InputError> {
        Table::with_columns(tables, &self.columns).map_err(|error| self.about(error))
    }

    fn about(&self, error: InputError) -> InputError {
        match &error.location {
            Location::Argument(name) => {
                let at = self.entry.at.below(&format!("format.{name}"));
                at.file.error_about(&at.key, error)
            }
            _ => self.at.asks_for()(error),
        }
    }
}

/// The rows in the window, of increasing times.
fn inside(entry: &Entry<'_>, times: &[f64]) -> Result<Range<usize>, InputError> {
    let [from, to] = window(entry)?;
    let first = times.partition_point(|t| *t < from);
    let inside = first..times.partition_point(|t| *t <= to);
    match inside.is_empty() {
        false => Ok(inside),
        true => Err((entry.at)
            .error_in("window", "no sample lies in the window")
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
        skip: given.skip,
        header: given.header,
        units_row: given.units_row,
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
    entry: &Entry<'_>,
    own: Option<&SourceSpec>,
    table: &Table,
    notes: &mut RecordNotes,
) -> Result<Times, InputError> {
    let (at, spec) = (&entry.at, entry.spec);
    let own_rate = own.and_then(|s| s.sample_rate);
    let own_column = own.and_then(|s| s.time.as_ref());
    let shared_column = spec.columns.as_ref().and_then(|c| c.time.as_ref());
    let rate = match (own_rate, own_column) {
        (Some(rate), None) => Some(rate),
        (None, Some(_)) => None,
        (Some(_), Some(_)) => return Err(two_times(at)),
        (None, None) => match (spec.sample_rate, shared_column) {
            (Some(_), Some(_)) => return Err(two_times(at)),
            (rate, _) => rate,
        },
    };
    if let Some(rate) = rate {
        if !SAMPLE_RATES.contains(&rate) {
            return Err(at
                .error_in("sample_rate", "invalid sampling rate")
                .found(format!("{:?}", rate))
                .expected(sample_rates()));
        }
        return Ok(Times {
            values: (0..table.rows()).map(|i| i as f64 / rate).collect(),
            label: String::new(),
            unit: None,
            repeated: RepeatedTimes::NONE,
        });
    }
    let default = ColumnId::Name(TIME_COLUMN.to_owned());
    let id = own_column.or(shared_column).unwrap_or(&default);
    let named = at.below("columns.time");
    // A file that states its sampling rate needs no column of times.
    let stated = table.time_column().filter(|_| std::ptr::eq(id, &default));
    let index = stated.map_or_else(|| table.find(&column_name(id)), Ok);
    let index = index.map_err(|error| {
        let error = named.asks_for()(error);
        match own_column.or(shared_column) {
            None => error.hint("name it with `columns: {time: …}`, or give `sample_rate: …`"),
            Some(_) => error,
        }
    })?;
    let column = QuantityColumn {
        at,
        name: "time",
        kind: Measurand::Time,
        given: spec.units.as_ref().and_then(|u| u.time.as_ref()),
        table,
        index,
    };
    let unit = column.unit(&mut notes.warnings)?;
    let duplicates = spec.duplicates.unwrap_or_default();
    let repeated = repeated_times(table, index, duplicates).map_err(named.asks_for())?;
    let values = table.values(index).map_err(named.asks_for())?;
    let mut values = repeated.merged(values, Duplicates::First);
    if let Some(exact) = without_rounding(&values) {
        let (digits, rate) = (exact.digits, 1.0 / (exact.step * unit.factor()));
        let text = format!(
            "times printed with {digits} decimals: taken as equally spaced, at {} Hz",
            significant(rate, 9)
        );
        let found = json!({"digits": digits, "rate": rate});
        let fact = Finding::having("rounded_times", text, found);
        notes.state(&entry.name(), fact);
        values = exact.times.into();
    }
    Ok(Times {
        values: values.iter().map(|t| t * unit.factor()).collect(),
        label: table.label(index),
        unit: Some(unit.unit),
        repeated,
    })
}

fn two_times(at: &ModelKey<'_>) -> InputError {
    at.error_in(
        "sample_rate",
        "both a sampling rate and a column of times are given",
    )
    .found("`sample_rate` beside a column of times")
    .expected("one of the two")
}

/// First and last time of the window, on the time axis of the file.
pub fn window(entry: &Entry<'_>) -> Result<[f64; 2], InputError> {
    let Some(window) = &entry.spec.window else {
        return Ok([f64::NEG_INFINITY, f64::INFINITY]);
    };
    let from = window.min.unwrap_or(f64::NEG_INFINITY);
    let to = window.max.unwrap_or(f64::INFINITY);
    if from >= to {
        return Err((entry.at)
            .error_in("window", "the window is empty")
            .found(format!("{from} s to {to} s"))
            .expected("`min` less than `max`"));
    }
    Ok([from, to])
}
