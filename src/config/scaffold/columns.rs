//! Assignment of the columns of a table to time, channels, force and base motion, from units, names and values.

use super::quoted;
use super::roles::{Role, UsedColumn, known};
use super::statements::{ColumnStatements, OTHER_FILE, Statements};
use crate::error::InputError;
use crate::quantity_names::{is_drive, is_foreign};
use crate::tables::{Duplicates, Table, increasing_at, repeated_times};
use crate::units::{ScaledUnit, Unit};
use kmcfit_core::diagnostics::standard_deviation;

/// Ratio of standard deviations beyond which a later sensor replaces an earlier one of the same role.
const MUCH: f64 = 3.0;
/// Rows for each of which a clock may step back once.
const FEW_STEPS: usize = 20;
const OTHER_TIMES: &str = "correct the times in the file; `--sample-rate HZ` replaces them if the samples are equally spaced, `--time COLUMN` names another column";

/// Columns of a table by role, and unused columns.
#[derive(Debug)]
pub struct ColumnAssignment {
    pub used: Vec<UsedColumn>,
    unused: Vec<usize>,
    /// Sampling rate that an option or, without times, the file states, Hz.
    pub sample_rate: Option<f64>,
}

impl ColumnAssignment {
    /// The columns of a table with the statements of the options, and for each unit among these whether the table has its column.
    pub fn of(table: &Table, statements: &Statements) -> Result<(Self, Vec<bool>), InputError> {
        let mut stated = ColumnStatements::of(table, statements)?;
        let mut columns = Self::known(table, statements.sample_rate, &stated)?;
        if columns.channels().next().is_none() {
            columns.guess(table, stated.response())?;
        }
        if !statements.responses.is_empty() {
            let is_other = |c: &UsedColumn| c.role.is_channel() && !c.is_stated;
            let (others, used): (Vec<_>, Vec<_>) = columns.used.into_iter().partition(is_other);
            columns.used = used;
            columns.unused.extend(others.iter().map(|c| c.index));
        }
        stated.state_quantities(&mut columns.used);
        columns.check_units(table)?;
        Ok((columns, stated.is_used))
    }

    /// The columns with the roles `named`, those with recognised names or units and the column of times; none of them need be a channel.
    /// Units of a role hold for a named column, and for others where the table states none.
    pub fn as_in_run(
        table: &Table,
        sample_rate: Option<f64>,
        named: Vec<(usize, Role)>,
        units: Vec<(Role, ScaledUnit)>,
    ) -> Result<Self, InputError> {
        let stated = ColumnStatements::of_run(named, &units);
        let mut columns = Self::known(table, sample_rate, &stated)?;
        for column in columns.used.iter_mut().filter(|c| !c.has_unit) {
            if let Some((_, unit)) = units.iter().find(|(role, _)| *role == column.role) {
                column.state(*unit);
            }
        }
        columns.check_units(table)?;
        Ok(columns)
    }

    fn check_units(&self, table: &Table) -> Result<(), InputError> {
        for column in self.used.iter().filter(|column| !column.state_unit) {
            let correct = |error: InputError| error.hint("correct one of them in the file");
            table.check_stated_unit(column.index).map_err(correct)?;
        }
        Ok(())
    }

    fn known(
        table: &Table,
        sample_rate: Option<f64>,
        stated: &ColumnStatements,
    ) -> Result<Self, InputError> {
        let known = |table: &Table, index: usize| stated.recognise(table, index);
        let is_time = |i: usize| known(table, i).is_some_and(|c| c.role == Role::Time);
        let of_file = || {
            table
                .stated_rate()
                .filter(|_| !(0..table.width()).any(is_time))
        };
        let sample_rate = sample_rate.or_else(of_file);
        let (mut numeric, mut no_times) = (Vec::new(), None);
        for i in 0..table.width() {
            match table.samples(i) {
                Ok(samples) if samples.iter().any(|x| x.is_finite()) => numeric.push(i),
                Ok(_) => {}
                // A recognised name requires numbers.
                Err(error) => match known(table, i).map(|column| column.role) {
                    // A column of dates can stand beside one of times.
                    Some(Role::Time) => no_times = no_times.or(Some(error)),
                    Some(_) => return Err(error),
                    None => {}
                },
            }
        }
        let mut columns = Self {
            used: Vec::new(),
            unused: Vec::new(),
            sample_rate,
        };
        if sample_rate.is_none() {
            if let Some(error) = no_times.filter(|_| !numeric.iter().any(|i| is_time(*i))) {
                return Err(error.hint(OTHER_TIMES));
            }
            columns.used.push(time(table, &numeric, &known)?);
        }
        // Voltages stand for a quantity only where no other column does.
        let rank = |index: &usize| {
            let found = known(table, *index).filter(|column| !column.is_stated);
            found.is_some_and(|column| column.unit.is_arbitrary())
        };
        let (volts, others): (Vec<usize>, Vec<usize>) = numeric.into_iter().partition(rank);
        for index in others.into_iter().chain(volts) {
            if columns.used.iter().any(|c| c.index == index) {
                continue;
            }
            match known(table, index) {
                Some(column)
                    if rank(&index)
                        && column.role.is_channel()
                        && columns.has_mechanical_channel() =>
                {
                    columns.unused.push(index);
                }
                Some(column) if column.role != Role::Time => columns.take(table, column)?,
                _ => columns.unused.push(index),
            }
        }
        Ok(columns)
    }

    /// Assigns a column to its role. Among several axes of a sensor a later one replaces an earlier one if its standard deviation is much
    /// larger.
    fn take(&mut self, table: &Table, column: UsedColumn) -> Result<(), InputError> {
        let Some(location) = self.used.iter().position(|c| c.role == column.role) else {
            self.used.push(column);
            return Ok(());
        };
        let size = |c: &UsedColumn| -> Result<f64, InputError> {
            let samples = table.samples(c.index)?.iter().copied();
            let samples: Vec<f64> = samples.filter(|x| x.is_finite()).collect();
            Ok(c.factor() * standard_deviation(&samples))
        };
        let there = &self.used[location];
        let alike = column.has_unit == there.has_unit
            && column.unit.is_angular() == there.unit.is_angular();
        let moves_more = column.role.is_channel() && size(&column)? > MUCH * size(there)?;
        let is_better = match column.is_stated == there.is_stated {
            true => alike && moves_more,
            false => column.is_stated,
        };
        let left = match is_better {
            true => std::mem::replace(&mut self.used[location], column),
            false => column,
        };
        self.unused.push(left.index);
        Ok(())
    }

    /// Assigns the first column without a recognised name or foreign unit to the response `role`, by default the displacement.
    fn guess(&mut self, table: &Table, role: Option<Role>) -> Result<(), InputError> {
        let is_empty = |i: &usize| match table.samples(*i) {
            Ok(samples) => samples.iter().all(|x| x.is_nan()),
            Err(_) => false,
        };
        let is_channel = |i: &usize| known(table, *i).is_some_and(|c| c.role.is_channel());
        let mut empty = (0..table.width()).filter(|i| is_empty(i) && is_channel(i));
        if let Some(empty) = empty.next() {
            let label = table.label(empty);
            return Err(InputError::file(table.path(), "all samples are missing")
                .found(format!("no number in the column `{label}`"))
                .expected("at least one sample"));
        }
        // A number of the sample is no response.
        let is_counter = |i: usize| self.sample_rate.is_some() && increasing_at(table, i).is_ok();
        let is_open = |i: &usize| !is_foreign(table.quantity_name(*i)) && !is_counter(*i);
        let has_no_unit = |i: &usize| is_open(i) && table.unit(*i).is_none();
        let location = self.unused.iter().position(has_no_unit);
        let Some(location) = location.or_else(|| self.unused.iter().position(is_open)) else {
            let names = (0..table.width()).map(|i| table.label(i));
            return Err(InputError::file(
                table.path(),
                "no column is a displacement, velocity or acceleration",
            )
            .found(format!(
                "the columns {}",
                names.collect::<Vec<_>>().join(", ")
            ))
            .expected("a column of samples in addition to the times"));
        };
        let index = self.unused.remove(location);
        let own = UsedColumn::guessed(index, role.unwrap_or(Role::Displacement));
        let unit = table.stated_unit(index).explicit(own.role.kind());
        self.used.push(UsedColumn {
            guessed: role.is_none(),
            unit: unit.unwrap_or(own.unit),
            has_unit: unit.is_some(),
            ..own
        });
        Ok(())
    }

    pub fn has(&self, role: Role) -> bool {
        self.find(role).is_some()
    }

    pub fn find(&self, role: Role) -> Option<&UsedColumn> {
        self.used.iter().find(|c| c.role == role)
    }

    /// True if the name of the column of a role has one of these words, which may be shortened as in `rel_x`.
    pub fn is_named(&self, table: &Table, role: Role, words: &[&str]) -> bool {
        let name = self.find(role).and_then(|c| table.headers().get(c.index));
        let name = name.map(|name| name.to_lowercase()).unwrap_or_default();
        let mut parts = name.split(|c: char| !c.is_alphabetic());
        parts.any(|part| words.contains(&part))
    }

    fn has_mechanical_channel(&self) -> bool {
        let mut channels = self.used.iter().filter(|c| c.role.is_channel());
        channels.any(|c| !c.unit.is_arbitrary())
    }

    /// Roles of the measured responses.
    pub fn channels(&self) -> impl Iterator<Item = Role> {
        self.used.iter().map(|c| c.role).filter(|r| r.is_channel())
    }

    /// Indices of the columns of samples, and whether they are inputs.
    pub fn measured(&self) -> impl Iterator<Item = (usize, bool)> {
        let measured = self.used.iter().filter(|c| c.role != Role::Time);
        measured.map(|c| (c.index, !c.role.is_channel()))
    }

    /// `{time: t_s, displacement: y_m}`
    pub fn named(&self, table: &Table) -> String {
        let name = |c: &UsedColumn| match table.headers().get(c.index) {
            Some(name) if !name.is_empty() => quoted(name),
            _ => (c.index + 1).to_string(),
        };
        let pairs = self
            .used
            .iter()
            .map(|c| format!("{}: {}", c.role.key(), name(c)));
        format!("{{{}}}", pairs.collect::<Vec<_>>().join(", "))
    }

    /// Units as a YAML map: those that the model file states, because an option or the name of the column alone does.
    pub fn units(&self) -> Option<String> {
        Self::map_of(self.used.iter().filter(|c| c.state_unit))
    }

    /// The units that are assumed, as a YAML map.
    pub fn assumed_units(&self) -> Option<String> {
        Self::map_of(self.used.iter().filter(|c| !c.has_unit))
    }

    fn map_of<'a>(columns: impl Iterator<Item = &'a UsedColumn>) -> Option<String> {
        let pairs = columns.map(|c| format!("{}: {}", c.role.key(), quoted(&c.unit_in_words())));
        let pairs: Vec<String> = pairs.collect();
        (!pairs.is_empty()).then(|| format!("{{{}}}", pairs.join(", ")))
    }

    /// One sentence for each column: its role and unit.
    pub fn in_words(&self, table: &Table) -> Vec<String> {
        let said = |c: &UsedColumn| {
            let guess = match (c.guessed, c.has_unit) {
                (false, _) if c.unit.is_arbitrary() => {
                    "; state the sensitivity of the sensor: `--units \"COLUMN=10 V/(m/s²)\"`"
                }
                (true, _) => {
                    "; quantity and unit are assumed, please check: `--response QUANTITY=COLUMN`, `--units COLUMN=UNIT`"
                }
                (_, false) if table.unit(c.index).is_some() => {
                    "; the stated unit is not known: `--units COLUMN=UNIT` states one"
                }
                (false, false) => "; the unit is assumed, please check",
                (false, true) => "",
            };
            let role = c.role.key().replace('_', " of the ");
            let role = match c.role {
                Role::BaseAcceleration => "acceleration of the base".to_owned(),
                Role::BaseDisplacement => "displacement of the base".to_owned(),
                _ => role,
            };
            let unapplied = match table.unapplied(c.index) {
                [] => String::new(),
                _ if c.is_stated => String::new(),
                stated => format!(
                    "; the file states {}, which is not applied",
                    stated.join(", ")
                ),
            };
            format!(
                "column `{}`: {role}, {}{guess}{unapplied}",
                table.label(c.index),
                c.unit_in_words()
            )
        };
        let mut words: Vec<String> = self.used.iter().map(said).collect();
        let unused: Vec<String> = (self.unused.iter())
            .map(|i| format!("`{}`", table.label(*i)))
            .collect();
        if !unused.is_empty() {
            words.push(format!("not used: {}", unused.join(", ")));
            let mut drives = self
                .unused
                .iter()
                .map(|i| table.label(*i))
                .filter(|label| is_drive(label));
            if let Some(drive) = drives.next() {
                words.push(format!("`{drive}` may drive the system: `--force` takes it as a force, `--base` as a motion of the base"));
            }
        }
        words
    }
}

/// Measurand and unit of a column as its name and stated unit give them, and true if the file states the unit.
pub fn recognised(table: &Table, index: usize) -> Option<(Role, Unit, bool)> {
    known(table, index).map(|column| (column.role, column.unit, column.has_unit))
}

/// Column of times and sampling rate, Hz; `None` without a column of increasing times.
pub fn rate(table: &Table) -> Option<(usize, f64)> {
    (0..table.width()).find_map(|i| {
        let column = known(table, i).filter(|c| c.role == Role::Time)?;
        let repeated = repeated_times(table, i, Duplicates::First).ok()?;
        let times = repeated.merged(table.values(i).ok()?, Duplicates::First);
        let duration = column.factor() * (times.last()? - times.first()?);
        Some((i, (times.len() - 1) as f64 / duration))
    })
}

/// The column of times: by unit, by name, or the first that increases.
fn time(
    table: &Table,
    numeric: &[usize],
    known: &dyn Fn(&Table, usize) -> Option<UsedColumn>,
) -> Result<UsedColumn, InputError> {
    let is_time = |i: &&usize| known(table, **i).is_some_and(|c| c.role == Role::Time);
    // A column that is named as one of times may repeat some.
    let repeats = |i: &usize| {
        let found = repeated_times(table, *i, Duplicates::First)?;
        // Most of them are those of rounded times.
        match 2 * found.excess() > table.rows() {
            true => repeated_times(table, *i, Duplicates::Error).map(|_| ()),
            false => Ok(()),
        }
    };
    let increases = |i: &&usize| match is_time(i) {
        true => repeats(i).is_ok(),
        false => increasing_at(table, **i).is_ok(),
    };
    if let Some(index) = numeric.iter().find(is_time)
        && let Err(error) = repeats(index)
        && !numeric.iter().filter(increases).any(|i| is_time(&i))
    {
        return Err(error.hint(OTHER_TIMES));
    }
    let named = numeric.iter().filter(increases).find(is_time);
    match named.or_else(|| numeric.iter().find(increases)) {
        Some(index) => Ok(known(table, *index)
            .filter(|c| c.role == Role::Time)
            .unwrap_or(UsedColumn {
                guessed: true,
                ..UsedColumn::guessed(*index, Role::Time)
            })),
        None => {
            // A clock that steps back in a few rows.
            let mostly = |i: &&usize| {
                let steps = table
                    .values(**i)
                    .map(|times| times.windows(2).filter(|pair| pair[1] <= pair[0]).count());
                steps.is_ok_and(|back| back * FEW_STEPS < table.rows())
            };
            if let Some(Err(error)) = numeric
                .iter()
                .find(mostly)
                .map(|i| increasing_at(table, *i))
            {
                return Err(error.hint(OTHER_TIMES));
            }
            Err(InputError::file(table.path(), "no column of times")
                .found("no column whose numbers increase from row to row")
                .expected("a column of times, `--time COLUMN`, or `--sample-rate HZ`")
                .hint(OTHER_FILE))
        }
    }
}
