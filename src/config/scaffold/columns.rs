//! Assignment of the columns of a table to time, channels, force and base motion, from units, names and values.

use super::quoted;
use crate::error::InputError;
use crate::tables::{Duplicates, Table, increasing_at, repeated_times};
use crate::units::{Quantity, Unit};
use kmcfit_core::internals::diagnostics::standard_deviation;

/// Role of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Time,
    Displacement,
    Velocity,
    Acceleration,
    Force,
    BaseAcceleration,
    BaseDisplacement,
}

/// Prefixes of column names, in lower case, by role.
const NAMES: [(Role, &[&str]); 5] = [
    (Role::Time, &["time", "zeit", "uhrzeit", "t"]),
    (
        Role::Displacement,
        &[
            "disp", "pos", "defl", "angle", "roll", "pitch", "y", "x", "z", "u", "s",
        ],
    ),
    (Role::Velocity, &["vel", "v"]),
    (Role::Acceleration, &["acc", "a"]),
    (Role::Force, &["force", "load", "torque", "f"]),
];
/// Words in a name that denote the base.
const BASE: [&str; 5] = ["base", "table", "ground", "floor", "support"];
/// Names that match only as whole words, not as prefixes (`roller` is not `roll`).
const WHOLE: [&str; 2] = ["roll", "pitch"];
/// Unit suffixes, in lower case, of quantities without a role.
const FOREIGN: [&str; 18] = [
    "hz", "khz", "rpm", "degc", "°c", "celsius", "kelvin", "%", "percent", "pa", "kpa", "mpa",
    "bar", "ohm", "ma", "db", "kg", "volt",
];
/// Ratio of standard deviations beyond which a later sensor replaces an earlier one of the same role.
const MUCH: f64 = 3.0;
/// Longest name that is compared as a single letter with a number or unit: `y1`.
const LONGEST_LETTER: usize = 2;

/// Remedy for a column of times that cannot be used.
const OTHER_TIMES: &str = "correct the times in the file; `--sample-rate HZ` replaces them if the samples are equally spaced";

impl Role {
    /// Its key in the model file.
    pub fn key(self) -> &'static str {
        match self {
            Role::Time => "time",
            Role::Displacement => "displacement",
            Role::Velocity => "velocity",
            Role::Acceleration => "acceleration",
            Role::Force => "force",
            Role::BaseAcceleration => "base_acceleration",
            Role::BaseDisplacement => "base_displacement",
        }
    }

    fn kind(self) -> Quantity {
        match self {
            Role::Time => Quantity::Time,
            Role::Displacement | Role::BaseDisplacement => Quantity::Displacement,
            Role::Velocity => Quantity::Velocity,
            Role::Acceleration | Role::BaseAcceleration => Quantity::Acceleration,
            Role::Force => Quantity::Force,
        }
    }

    fn of_base(self) -> Option<Self> {
        match self {
            Role::Displacement => Some(Role::BaseDisplacement),
            Role::Acceleration => Some(Role::BaseAcceleration),
            _ => None,
        }
    }

    /// True for a measured response.
    pub fn is_channel(self) -> bool {
        matches!(
            self,
            Role::Displacement | Role::Velocity | Role::Acceleration
        )
    }
}

/// A column that is used.
#[derive(Debug, Clone, Copy)]
pub struct UsedColumn {
    pub index: usize,
    pub role: Role,
    /// The unit.
    pub unit: Unit,
    /// True if the model file must state the unit, because no row of units or name does so in a recognised form.
    state_unit: bool,
    /// True if the role follows from the position of the column alone.
    guessed: bool,
    /// True if the file states the unit.
    has_unit: bool,
}

/// Columns of a table by role, and unused columns.
#[derive(Debug)]
pub struct ColumnAssignment {
    pub used: Vec<UsedColumn>,
    unused: Vec<usize>,
}

impl ColumnAssignment {
    pub fn of(table: &Table, sample_rate: Option<f64>) -> Result<Self, InputError> {
        let mut columns = Self::known(table, sample_rate)?;
        if columns.channels().next().is_none() {
            columns.guess(table)?;
        }
        columns.check_units(table)?;
        Ok(columns)
    }

    /// The columns with recognised names or units and the column of times; none of them need be a channel.
    pub fn without_guess(table: &Table, sample_rate: Option<f64>) -> Result<Self, InputError> {
        let columns = Self::known(table, sample_rate)?;
        columns.check_units(table)?;
        Ok(columns)
    }

    fn check_units(&self, table: &Table) -> Result<(), InputError> {
        for column in &self.used {
            let correct = |error: InputError| error.hint("correct one of them in the file");
            table.check_stated_unit(column.index).map_err(correct)?;
        }
        Ok(())
    }

    fn known(table: &Table, sample_rate: Option<f64>) -> Result<Self, InputError> {
        let mut numeric = Vec::new();
        for i in 0..table.width() {
            match table.samples(i) {
                Ok(samples) if samples.iter().any(|x| x.is_finite()) => numeric.push(i),
                Ok(_) => {}
                // A recognised name requires numbers.
                Err(error) => match known(table, i).map(|column| column.role) {
                    Some(Role::Time) if sample_rate.is_some() => {}
                    Some(Role::Time) => {
                        return Err(error.hint(OTHER_TIMES));
                    }
                    Some(_) => return Err(error),
                    None => {}
                },
            }
        }
        let mut columns = Self {
            used: Vec::new(),
            unused: Vec::new(),
        };
        if sample_rate.is_none() {
            columns.used.push(time(table, &numeric)?);
        }
        for index in numeric {
            if columns.used.iter().any(|c| c.index == index) {
                continue;
            }
            match known(table, index) {
                Some(column) if column.role != Role::Time => columns.take(table, column)?,
                _ => columns.unused.push(index),
            }
        }
        Ok(columns)
    }

    /// Assigns a column to its role. Among several sensors of one role a later one replaces an earlier one if its
    /// standard deviation is much larger.
    fn take(&mut self, table: &Table, column: UsedColumn) -> Result<(), InputError> {
        let Some(place) = self.used.iter().position(|c| c.role == column.role) else {
            self.used.push(column);
            return Ok(());
        };
        let size = |c: &UsedColumn| -> Result<f64, InputError> {
            let samples = table.samples(c.index)?.iter().copied();
            let samples: Vec<f64> = samples.filter(|x| x.is_finite()).collect();
            Ok(c.unit.factor() * standard_deviation(&samples))
        };
        let there = &self.used[place];
        let alike = column.has_unit == there.has_unit
            && column.unit.is_angular() == there.unit.is_angular();
        let moves_more = size(&column)? > MUCH * size(there)?;
        let left = match column.role.is_channel() && alike && moves_more {
            true => std::mem::replace(&mut self.used[place], column),
            false => column,
        };
        self.unused.push(left.index);
        self.unused.sort_unstable();
        Ok(())
    }

    /// Assigns the first column without a recognised name or foreign unit to the displacement.
    fn guess(&mut self, table: &Table) -> Result<(), InputError> {
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
        let is_open = |i: &usize| !is_foreign(table.quantity_name(*i));
        let Some(place) = self.unused.iter().position(is_open) else {
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
        self.used.push(UsedColumn {
            index: self.unused.remove(place),
            role: Role::Displacement,
            unit: Unit::si(Quantity::Displacement),
            state_unit: false,
            guessed: true,
            has_unit: false,
        });
        Ok(())
    }

    pub fn has(&self, role: Role) -> bool {
        self.find(role).is_some()
    }

    pub fn find(&self, role: Role) -> Option<&UsedColumn> {
        self.used.iter().find(|c| c.role == role)
    }

    /// Roles of the measured responses.
    pub fn channels(&self) -> impl Iterator<Item = Role> {
        self.used.iter().map(|c| c.role).filter(|r| r.is_channel())
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

    /// The units that the model file states, as a YAML map: those that the file does not state in a recognised form, and those
    /// of calibrated columns.
    pub fn units(&self, table: &Table) -> Option<String> {
        let unit = |c: &UsedColumn| match table.calibration(c.index) {
            Some(calibration) => Some(calibration.to_owned()),
            None => (c.state_unit || !c.has_unit).then(|| c.unit.symbol().to_owned()),
        };
        let pair = |c: &UsedColumn| Some(format!("{}: {}", c.role.key(), quoted(&unit(c)?)));
        let pairs: Vec<String> = self.used.iter().filter_map(pair).collect();
        (!pairs.is_empty()).then(|| format!("{{{}}}", pairs.join(", ")))
    }

    /// The comment on these units.
    pub fn units_comment(&self) -> String {
        let assumed: Vec<&str> = (self.used.iter())
            .filter(|c| !c.has_unit)
            .map(|c| c.role.key())
            .collect();
        match assumed.is_empty() {
            true => "converted to SI".to_owned(),
            false => format!(
                "ASSUMED, the file does not state a known unit: {}",
                assumed.join(", ")
            ),
        }
    }

    /// One sentence for each column: its role and unit.
    pub fn in_words(&self, table: &Table) -> Vec<String> {
        let said = |c: &UsedColumn| {
            let guess = match (c.guessed, c.has_unit) {
                (true, _) => "; quantity and unit are assumed, please check",
                (false, false) => "; the unit is assumed, please check",
                (false, true) => "",
            };
            let role = c.role.key().replace('_', " of the ");
            let role = match c.role {
                Role::BaseAcceleration => "acceleration of the base".to_owned(),
                Role::BaseDisplacement => "displacement of the base".to_owned(),
                _ => role,
            };
            let gaps = match (c.role.is_channel(), table.samples(c.index)) {
                (false, Ok(samples)) => samples.iter().filter(|x| x.is_nan()).count(),
                _ => 0,
            };
            let gaps = match gaps {
                0 => String::new(),
                count => format!("; {count} values missing: an input needs a value in every row"),
            };
            format!(
                "column `{}`: {role}, {}{guess}{gaps}",
                table.label(c.index),
                c.unit.symbol()
            )
        };
        let mut words: Vec<String> = self.used.iter().map(said).collect();
        let unused: Vec<String> = (self.unused.iter())
            .map(|i| format!("`{}`", table.label(*i)))
            .collect();
        if !unused.is_empty() {
            words.push(format!("not used: {}", unused.join(", ")));
        }
        words
    }
}

/// Quantity and unit of a column as its name and stated unit give them, and true if the file states the unit.
pub fn recognised(table: &Table, index: usize) -> Option<(Role, Unit, bool)> {
    known(table, index).map(|column| (column.role, column.unit, column.has_unit))
}

/// Column of times and sampling rate, Hz; `None` without a column of increasing times.
pub fn rate(table: &Table) -> Option<(usize, f64)> {
    (0..table.width()).find_map(|i| {
        let column = known(table, i).filter(|c| c.role == Role::Time)?;
        let repeated = repeated_times(table, i, Duplicates::First).ok()?;
        let times = repeated.merged(table.values(i).ok()?, Duplicates::First);
        let duration = column.unit.factor() * (times.last()? - times.first()?);
        Some((i, (times.len() - 1) as f64 / duration))
    })
}

/// The column of times: by unit, by name, or the first that increases.
fn time(table: &Table, numeric: &[usize]) -> Result<UsedColumn, InputError> {
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
                index: *index,
                role: Role::Time,
                unit: Unit::si(Quantity::Time),
                state_unit: false,
                guessed: true,
                has_unit: false,
            })),
        None => Err(InputError::file(table.path(), "no column of times")
            .found("no column whose numbers increase from row to row")
            .expected("a column of times, or `--sample-rate HZ`")),
    }
}

/// Role and unit of a column from its name and stated unit.
fn known(table: &Table, index: usize) -> Option<UsedColumn> {
    let (label, is_base) = without_base(table.quantity_name(index));
    let by_name = role_of(&label.to_lowercase());
    let stated = table.stated_unit(index);
    let roles = [
        Role::Time,
        Role::Acceleration,
        Role::Velocity,
        Role::Displacement,
        Role::Force,
    ];
    let unit_of = |role: Role| {
        let explicit = stated.explicit(role.kind()).map(|u| (u, false));
        explicit.or_else(|| stated.suffix(role.kind()).map(|u| (u, true)))
    };
    let by_unit = roles.into_iter().find(|role| unit_of(*role).is_some());
    if by_unit.is_none() && is_foreign(&label) {
        return None;
    }
    // A role by name takes precedence if its unit agrees, because some units fit several quantities.
    let role = by_name
        .filter(|r| unit_of(*r).is_some())
        .or(by_unit)
        .or(by_name)?;
    let found = unit_of(role);
    let (unit, in_name) = found.unwrap_or((Unit::si(role.kind()), false));
    Some(UsedColumn {
        index,
        role: role.of_base().filter(|_| is_base).unwrap_or(role),
        unit,
        state_unit: in_name && unit.factor() != 1.0,
        guessed: false,
        has_unit: found.is_some(),
    })
}

/// A label without a word for the base, and true if it had one: `table_acc` is an acceleration of the base.
fn without_base(label: &str) -> (String, bool) {
    // ASCII lower case keeps the byte length.
    let small = label.to_ascii_lowercase();
    let found = BASE
        .iter()
        .find_map(|word| Some((small.find(word)?, word.len())));
    let Some((at, length)) = found else {
        return (label.to_owned(), false);
    };
    let rest = [&label[..at], &label[at + length..]].concat();
    let is_separator = |c: char| matches!(c, '_' | ' ' | '-' | '.');
    (rest.trim_start_matches(is_separator).to_owned(), true)
}

/// True for a name that ends with a unit of [`FOREIGN`].
fn is_foreign(label: &str) -> bool {
    let small = label.to_lowercase();
    let mut words = small.split(['_', ' ', '[', ']', '(', ')', '/']);
    words.next();
    words
        .rfind(|word| !word.is_empty())
        .is_some_and(|unit| FOREIGN.contains(&unit))
}

/// Role of a column by its name in lower case.
fn role_of(name: &str) -> Option<Role> {
    let bare = name
        .split(['_', ' ', '[', '(', '/'])
        .next()
        .unwrap_or_default();
    let means = |begin: &str| match begin.len() {
        1 => bare.starts_with(begin) && bare.len() <= LONGEST_LETTER,
        _ if WHOLE.contains(&begin) => bare.trim_end_matches(|c: char| c.is_ascii_digit()) == begin,
        _ => bare.starts_with(begin),
    };
    let named = NAMES
        .iter()
        .find(|(_, begins)| begins.iter().any(|b| means(b)));
    named.map(|(role, _)| *role)
}
