//! Reading of the rows of a text into the columns of a table.

use std::path::Path;

use csv::StringRecord;

use super::detect::Layout;
use super::field::{self, Field};
use super::format::Detected;
use super::origin::ColumnValues;
use super::rows::{CsvText, TableRows};
use super::table::{TABLE, Table};
use super::table_memory::TableMemory;
use crate::clock::Clock;
use crate::error::{InputError, Location};
use crate::formats::{Meaning, meaning};
use crate::quantity_names::quantity_of;
use crate::text_io::{listed, quote};
use crate::units::{Measurand, Unit};
use kmcfit_core::number_format::count;
use kmcfit_core::threads::both;

/// Most columns: each takes some hundred bytes beside its fields.
const MOST_COLUMNS: usize = 10_000;

impl Table {
    /// Reads names, units and rows; returns the number of rows that repeat the names.
    pub(super) fn fill(
        &mut self,
        source: &CsvText,
        layout: &Layout,
        room: TableMemory,
        format: &mut Detected,
    ) -> Result<usize, InputError> {
        let mut repeated = 0;
        let path = self.path.clone();
        let mut rows = source.rows(&path);
        let mut fields = StringRecord::new();
        let mut count = 0;
        while let Some(line) = rows.read(&mut fields)? {
            let row = Some(count);
            check_width(&path, line, fields.len())?;
            // Rows of statements can begin with a key above rows without: `Name,Force,Acc`.
            let is_keyed = layout.width.is_some_and(|width| fields.len() == width + 1)
                && fields.get(0).is_some_and(is_key);
            if is_keyed && count < layout.data {
                fields = fields.iter().skip(1).collect();
            }
            if row == layout.header {
                check_headers(&path, line, &fields, layout.decimal)?;
                self.headers = fields.iter().map(str::to_owned).collect();
                // Each channel can have times before it.
                for i in 1..self.headers.len() {
                    let count = self.headers[..i]
                        .iter()
                        .filter(|name| **name == self.headers[i])
                        .count();
                    if count > 0 && !self.headers[i].is_empty() {
                        self.headers[i] += &format!(" #{}", count + 1);
                    }
                }
                self.columns = columns(fields.len(), room)?;
                format.header = Some(line);
            } else if row == layout.units {
                self.units = fields.iter().map(str::to_owned).collect();
                // `Units,kN,g` begins with a key.
                if let Some(key) = self.units.first_mut().filter(|key| is_key(key)) {
                    key.clear();
                }
                format.units_row = Some(line);
            } else if let (Some(header), true) = (layout.header, count < layout.data) {
                // The name of an index below the other names.
                if let Some(first) = self
                    .headers
                    .first_mut()
                    .filter(|first| count > header && first.is_empty())
                {
                    *first = fields.get(0).unwrap_or_default().to_owned();
                }
            } else if count >= layout.data {
                repeated += usize::from(!self.push(line, &fields, layout, room)?);
                // The first row of data defines the columns.
                if let Some(later) = rows.split_off() {
                    repeated += self.push_halves(rows, later, layout, room)?;
                    break;
                }
            }
            count += 1;
        }
        let first = self.lines.first().copied();
        match (format.header.or(first), first) {
            (None, _) => Err(empty(&path, format.skipped)),
            (_, None) => Err(InputError::file(&path, "the file has no data")
                .found("a row of column names only")
                .expected(TABLE)),
            (Some(head), _) => {
                format.skipped = head - 1;
                Ok(repeated)
            }
        }
    }

    /// Adds the rows of data of both halves of a text, which are read at the same time.
    fn push_halves(
        &mut self,
        first: TableRows,
        second: TableRows,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<usize, InputError> {
        let begun = |own: &ColumnValues| ColumnValues {
            clock: own.clock,
            ..ColumnValues::default()
        };
        let mut later = Self::empty(&self.path, self.origin.clone());
        later.headers.clone_from(&self.headers);
        later.columns = self.columns.iter().map(begun).collect();
        let (first, second) = both(
            || self.push_all(first, layout, room),
            || Ok((later.push_all(second, layout, room)?, later)),
        );
        // The first mistake in the file is reported.
        let first = first?;
        let (second, later): (usize, Self) = second?;
        self.lines.extend(later.lines);
        for (column, later) in self.columns.iter_mut().zip(later.columns) {
            // An unreadable column has no samples after its first mistake.
            if column.unreadable.is_none() {
                column.samples.extend(later.samples);
                column.unreadable = later.unreadable;
                column.has_other_dates |= later.has_other_dates;
                column.unnumbered = column.unnumbered.take().or(later.unnumbered);
            }
        }
        Ok(first + second)
    }

    /// Adds all rows as data, and counts those that repeat the column names.
    fn push_all(
        &mut self,
        mut rows: TableRows,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<usize, InputError> {
        let mut fields = StringRecord::new();
        let mut repeated = 0;
        while let Some(line) = rows.read(&mut fields)? {
            check_width(&self.path, line, fields.len())?;
            repeated += usize::from(!self.push(line, &fields, layout, room)?);
        }
        Ok(repeated)
    }

    /// Adds a data row, unless it is that of the column names. A field that is not a number makes its column unusable.
    fn push(
        &mut self,
        line: usize,
        fields: &StringRecord,
        layout: &Layout,
        room: TableMemory,
    ) -> Result<bool, InputError> {
        if fields.get(0) == self.headers.first().map(String::as_str)
            && fields == self.headers.as_slice()
        {
            return Ok(false);
        }
        let row = self.lines.len();
        self.lines.push(line);
        if self.columns.is_empty() {
            let width = layout.width.unwrap_or(fields.len());
            self.columns = columns(width, room)?;
        }
        // Some loggers end every row of data, but not the row of names, with a delimiter.
        let width = self.columns.len();
        let ended = layout.width == Some(width + 1) && fields.get(width) == Some("");
        if fields.len() != width + usize::from(ended) {
            let location = self.location(row, None);
            return Err(ragged(location, fields, width, &self.headers));
        }
        for (index, text) in fields.iter().take(width).enumerate() {
            let column = &self.columns[index];
            if column.unreadable.is_some() {
                continue;
            }
            let read = field::read(text, layout.decimal);
            if let Field::Number(value) = read {
                self.columns[index].samples.push(value);
                continue;
            }
            let is_clock = || column.clock.is_some() || column.samples.iter().all(|x| x.is_nan());
            let clock_in = |order| Clock::read(text, order).filter(|_| read == Field::Text);
            let clock = clock_in(layout.day_first);
            if let Some(clock) = clock.filter(|_| is_clock()) {
                let column = &mut self.columns[index];
                let first = column.clock.get_or_insert(clock);
                column.samples.push(clock.since(first));
                continue;
            }
            let location = || self.location(row, Some(&self.label(index)));
            let unnumbered = column
                .unnumbered
                .is_none()
                .then(|| field::not_a_number(location(), text, layout.decimal));
            let unreadable = (read != Field::Missing)
                .then(|| field::not_a_sample(location(), text, layout.decimal));
            let has_other_dates = clock_in(!layout.day_first).is_some();
            let column = &mut self.columns[index];
            column.has_other_dates |= has_other_dates;
            column.samples.push(f64::NAN);
            column.unnumbered = column.unnumbered.take().or(unnumbered);
            column.unreadable = unreadable;
        }
        Ok(true)
    }
}

/// True for the first field of a row of names or units that is none of them.
fn is_key(text: &str) -> bool {
    let is_name = ["name", "names", "channel", "channels"]
        .iter()
        .any(|key| text.eq_ignore_ascii_case(key));
    is_name || meaning(text) == Some(Meaning::Unit)
}

/// Allocates the columns with capacity for all rows.
fn columns(width: usize, room: TableMemory) -> Result<Vec<ColumnValues>, InputError> {
    let column = |_| {
        Ok(ColumnValues {
            samples: room.list(width)?,
            ..ColumnValues::default()
        })
    };
    (0..width).map(column).collect()
}

/// The error for a file without rows after the skipped lines.
fn empty(path: &Path, skipped: usize) -> InputError {
    let error = InputError::file(path, "the file is empty").expected(TABLE);
    match skipped {
        0 => error,
        lines => error.found(format!("nothing after {lines} skipped lines")),
    }
}

/// Refuses a row with more than [`MOST_COLUMNS`] fields.
fn check_width(path: &Path, line: usize, fields: usize) -> Result<(), InputError> {
    if fields <= MOST_COLUMNS {
        return Ok(());
    }
    Err(
        InputError::line(path, line, 1, "the table has too many columns")
            .found(format!("{fields} fields"))
            .expected(format!("at most {MOST_COLUMNS}")),
    )
}

/// Refuses repeated column names, and a row of names that are all numbers.
fn check_headers(
    path: &Path,
    line: usize,
    headers: &StringRecord,
    decimal: char,
) -> Result<(), InputError> {
    let error = |problem: String| InputError::line(path, line, 1, problem);
    let is_number = |name| matches!(field::read(name, decimal), Field::Number(_));
    if headers.iter().all(is_number) {
        return Err(error("the column names are missing".to_owned())
            .found(format!("the numbers {}", quote(&listed(headers))))
            .expected("one row of column names before the data")
            .hint("a line that begins with `#` is a comment: remove the `#` before the names"));
    }
    for (index, name) in headers.iter().enumerate() {
        let before = headers.iter().take(index).position(|other| other == name);
        let is_time = quantity_of(name) == Some(Measurand::Time) && index + 1 < headers.len();
        if let (Some(first), false) = (before, name.is_empty() || is_time) {
            return Err(error(format!("two columns have the name {}", quote(name)))
                .found(format!("columns {} and {}", first + 1, index + 1))
                .expected("every column name once"));
        }
    }
    Ok(())
}

/// The error for a row with more or fewer fields than there are columns.
fn ragged(
    location: Location,
    fields: &StringRecord,
    expected: usize,
    headers: &[String],
) -> InputError {
    let problem = match headers {
        [] => "the row does not fit the other rows",
        _ => "the row does not fit the column names",
    };
    let error = InputError::new(location, problem)
        .found(count(fields.len(), "field"))
        .expected(format!("{}, one per column", count(expected, "field")));
    if fields.iter().any(|field| field.contains('\n')) {
        return error.hint("a quote that is opened in this row is not closed in it");
    }
    let split = |pair: &&[String]| Unit::any(&pair[1]).is_some();
    if let Some([name, unit]) = headers.windows(2).find(split)
        && fields.len() < expected
    {
        return error.hint(format!(
            "the comma in `{name}, {unit}` parts the name: write `{name} ({unit})`, or the name in quotes"
        ));
    }
    if fields.len() == 2 * expected {
        return error.hint("write numbers with a decimal point, not a comma");
    }
    error
}
