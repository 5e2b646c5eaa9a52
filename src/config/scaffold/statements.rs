//! What the options of `kmcfit init` state beside the files: roles and units of columns, and known coefficients.

use super::roles::{Role, UsedColumn, known};
use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::tables::{ColumnName, Table};
use crate::text_io::{one_of, quote};
use crate::units::{Quantity, ScaledUnit, Unit, split_factor};
use kmcfit_core::internals::functions::CoefficientKind;

/// Coefficients whose value can be stated.
const KNOWN: [CoefficientKind; 3] = [
    CoefficientKind::Mass,
    CoefficientKind::Damping,
    CoefficientKind::Stiffness,
];
/// A channel without a unit in a list of units by position.
const NOT_USED: &str = "-";

/// Statements of the options, for all files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statements {
    /// Sampling rate of a table without a column of times, Hz.
    pub sample_rate: Option<f64>,
    /// Column of the force.
    pub force: Option<String>,
    /// Column of the motion of the base.
    pub base: Option<String>,
    units: Vec<UnitEntry>,
    known: Vec<(CoefficientKind, f64)>,
}

/// An entry of `--units`.
#[derive(Debug, Clone, PartialEq)]
struct UnitEntry {
    key: UnitKey,
    unit: String,
}

#[derive(Debug, Clone, PartialEq)]
enum UnitKey {
    /// Quantity, or name or number of a column.
    Named(String),
    /// Channel of a file, from 0; with the number of channels that the list has.
    Position(usize, usize),
}

impl Statements {
    /// Adds units: `time=ms,displacement=mm` by quantity or by column, or `50 g,200 N` by the position of a channel in a file without
    /// names and units; a number before the unit is the value of one unit of the file.
    ///
    /// # Errors
    /// For an entry without a unit, and for entries with a name beside entries without.
    pub fn state_units(&mut self, text: &str) -> Result<(), InputError> {
        let error = |problem: &str, entry: &str| {
            InputError::argument("--units", problem)
                .found(quote(entry))
                .expected("NAME=UNIT with a quantity or a column, as in `time=ms,displacement=mm`")
        };
        let entries: Vec<&str> = text.split(',').map(str::trim).collect();
        let count = entries.len();
        let is_named = entries.iter().any(|entry| entry.contains('='));
        for (index, entry) in entries.into_iter().enumerate() {
            let (key, unit) = match entry.rsplit_once('=') {
                Some((name, unit)) => (UnitKey::Named(name.trim().to_owned()), unit.trim()),
                None if is_named => {
                    return Err(error("a unit without a name beside others with one", entry));
                }
                None => (UnitKey::Position(index, count), entry),
            };
            if unit.is_empty() || key == UnitKey::Named(String::new()) {
                return Err(error("neither a name nor a unit may be empty", entry));
            }
            let unit = unit.to_owned();
            self.units.push(UnitEntry { key, unit });
        }
        Ok(())
    }

    /// States the unit of one column.
    ///
    /// # Errors
    /// When the text is not a unit of this quantity.
    pub fn state_unit(
        &mut self,
        column: &str,
        quantity: Quantity,
        unit: &str,
    ) -> Result<(), InputError> {
        ScaledUnit::parse(quantity, unit)?;
        self.units.push(UnitEntry {
            key: UnitKey::Named(column.to_owned()),
            unit: unit.to_owned(),
        });
        Ok(())
    }

    /// States a coefficient, `stiffness=821.96`, from the option `option`.
    ///
    /// # Errors
    /// For another name, a value that is not a number or not possible, and a coefficient that is stated twice.
    pub fn fix(&mut self, option: &str, text: &str) -> Result<(), InputError> {
        let names = || KNOWN.iter().map(|kind| kind.name());
        let error = |problem: &str| InputError::argument(option, problem);
        let Some((name, value)) = text.split_once('=') else {
            return Err(error("missing `=`")
                .found(quote(text))
                .expected("NAME=VALUE, as in `stiffness=821.96`"));
        };
        let name = name.trim();
        let Some(kind) = KNOWN.into_iter().find(|kind| kind.name() == name) else {
            return Err(error("no coefficient of this name")
                .found(quote(name))
                .expected(one_of(names()))
                .hint_if(did_you_mean(name, names())));
        };
        self.know(option, kind, value.trim())
    }

    /// States the value of a coefficient in its SI unit.
    ///
    /// # Errors
    /// As [`fix`](Self::fix).
    pub fn know(
        &mut self,
        option: &str,
        kind: CoefficientKind,
        value: &str,
    ) -> Result<(), InputError> {
        let least = match kind {
            CoefficientKind::Damping => "0 or greater",
            _ => "greater than 0",
        };
        let number: Option<f64> = value.parse().ok();
        let is_possible = |x: &f64| {
            x.is_finite() && (*x > 0.0 || (*x == 0.0 && kind == CoefficientKind::Damping))
        };
        let Some(number) = number.filter(is_possible) else {
            return Err(
                InputError::argument(option, format!("invalid {}", kind.name()))
                    .found(quote(value))
                    .expected(format!("a number {least}, in {}", kind.unit())),
            );
        };
        if self.known.iter().any(|(other, _)| *other == kind) {
            return Err(InputError::argument(
                option,
                format!("the {} is given twice", kind.name()),
            )
            .found(quote(value))
            .expected("one value"));
        }
        self.known.push((kind, number));
        Ok(())
    }

    /// The stated value of a coefficient.
    pub fn known(&self, kind: CoefficientKind) -> Option<f64> {
        let stated = self.known.iter().find(|(other, _)| *other == kind);
        stated.map(|(_, value)| *value)
    }

    /// Error for a unit that no file uses; `is_used` has one entry for each unit.
    pub(super) fn check_used(&self, is_used: &[bool], tables: &[&Table]) -> Result<(), InputError> {
        let mut unused = self.units.iter().zip(is_used).filter(|(_, used)| !**used);
        let Some((
            UnitEntry {
                key: UnitKey::Named(name),
                ..
            },
            _,
        )) = unused.next()
        else {
            return Ok(());
        };
        let labels: Vec<String> = (tables.iter())
            .flat_map(|table| (0..table.width()).map(|i| table.label(i)))
            .collect();
        let names = || {
            Role::ALL
                .iter()
                .map(|role| role.key())
                .chain(labels.iter().map(String::as_str))
        };
        Err(InputError::argument(
            "--units",
            "no used column is this quantity or has this name",
        )
        .found(quote(name))
        .expected(one_of(names()))
        .hint_if(did_you_mean(name, names().filter(|other| other != name))))
    }
}

/// A statement on one column.
#[derive(Debug, Clone, Copy)]
struct ColumnStatement {
    index: usize,
    role: Role,
    unit: Option<ScaledUnit>,
}

/// Statements on the columns of one table.
#[derive(Debug, Default)]
pub(super) struct ColumnStatements {
    columns: Vec<ColumnStatement>,
    /// Units by quantity, with the place of their entry.
    quantities: Vec<(usize, Role, ScaledUnit)>,
    /// True for each entry of `--units` that concerns this table.
    pub is_used: Vec<bool>,
}

impl ColumnStatements {
    /// # Errors
    /// When a column does not exist, or a text is not a unit, or not one of its quantity.
    pub fn of(table: &Table, statements: &Statements) -> Result<Self, InputError> {
        let mut found = Self {
            is_used: vec![false; statements.units.len()],
            ..Self::default()
        };
        if let Some(name) = &statements.force {
            found.state(
                option_column(table, "--force", name)?,
                Some(Role::Force),
                None,
            )?;
        }
        if let Some(name) = &statements.base {
            let index = option_column(table, "--base", name)?;
            let is_displacement = known(table, index)
                .is_some_and(|c| matches!(c.role, Role::Displacement | Role::BaseDisplacement));
            let role = match is_displacement {
                true => Role::BaseDisplacement,
                false => Role::BaseAcceleration,
            };
            found.state(index, Some(role), None)?;
        }
        for (place, entry) in statements.units.iter().enumerate() {
            let index = match &entry.key {
                UnitKey::Named(name) => match Role::ALL.iter().find(|role| role.key() == name) {
                    Some(role) => {
                        found
                            .quantities
                            .push((place, *role, parse(role.kind(), &entry.unit)?));
                        continue;
                    }
                    None => column_of(table, name),
                },
                UnitKey::Position(index, count) => {
                    check_positions(table, *count)?;
                    (entry.unit != NOT_USED).then_some(*index)
                }
            };
            if let Some(index) = index {
                found.is_used[place] = true;
                let own = known(table, index).map(|column| column.role);
                found.state(index, own, Some(&entry.unit))?;
            }
        }
        Ok(found)
    }

    /// States the role and the unit of a column. The role of another quantity than that of the unit is replaced.
    fn state(
        &mut self,
        index: usize,
        role: Option<Role>,
        unit: Option<&str>,
    ) -> Result<(), InputError> {
        let earlier = self.columns.iter().position(|column| column.index == index);
        let earlier = earlier.map(|place| self.columns.remove(place));
        let role = earlier.map(|column| column.role).or(role);
        let (role, unit) = match (role, unit) {
            (Some(role), None) => (role, None),
            (None, None) => return Ok(()),
            (role, Some(text)) => {
                let is_of =
                    |role: &Role| Unit::recognise(role.kind(), split_factor(text).1).is_some();
                match role
                    .filter(|role| earlier.is_some() || is_of(role))
                    .or_else(|| Role::ALL.into_iter().find(is_of))
                {
                    Some(role) => (role, Some(parse(role.kind(), text)?)),
                    None => return Err(unknown_unit(text)),
                }
            }
        };
        self.columns.push(ColumnStatement { index, role, unit });
        Ok(())
    }

    /// The column as stated, else as its name and unit give it.
    pub fn recognise(&self, table: &Table, index: usize) -> Option<UsedColumn> {
        let own = known(table, index);
        let Some(stated) = self.columns.iter().find(|column| column.index == index) else {
            return own;
        };
        let own = own.filter(|column| column.role.kind() == stated.role.kind());
        let mut column = own.unwrap_or_else(|| UsedColumn::guessed(index, stated.role));
        column.role = stated.role;
        column.is_stated = true;
        if let Some(unit) = stated.unit {
            column.state(unit);
        }
        Some(column)
    }

    /// The response that an unrecognised column is, by the units stated for quantities.
    pub fn response(&self) -> Option<Role> {
        let mut roles = self.quantities.iter().map(|(_, role, _)| *role);
        roles.find(|role| role.is_channel())
    }

    /// States the units by quantity.
    pub fn state_quantities(&mut self, columns: &mut [UsedColumn]) {
        for (place, role, unit) in &self.quantities {
            if let Some(column) = columns.iter_mut().find(|column| column.role == *role) {
                column.state(*unit);
                self.is_used[*place] = true;
            }
        }
    }
}

/// A unit with a factor, for the option `--units`.
fn parse(kind: Quantity, text: &str) -> Result<ScaledUnit, InputError> {
    ScaledUnit::parse(kind, text).map_err(|error| InputError {
        place: InputError::argument("--units", "").place,
        problem: format!("{} of the {}", error.problem, kind.name()),
        ..error
    })
}

fn unknown_unit(text: &str) -> InputError {
    let symbols = || Quantity::ALL.into_iter().flat_map(Unit::symbols);
    InputError::argument("--units", "unknown unit")
        .found(quote(text))
        .expected(one_of(symbols()))
        .hint_if(did_you_mean(split_factor(text).1, symbols()))
}

/// Error for units by position in a file whose columns have names, or with another number of channels.
fn check_positions(table: &Table, count: usize) -> Result<(), InputError> {
    let error = |problem: &str| InputError::argument("--units", problem);
    match table.time_column() {
        None => Err(error("the units need names")
            .found(table.path().display())
            .expected("NAME=UNIT with a quantity or a column, as in `time=ms,displacement=mm`")),
        Some(channels) if channels != count => Err(error("another number of units than channels")
            .found(format!("{count} for {channels} channels"))
            .expected(format!(
                "{channels}, separated by commas, with `{NOT_USED}` for a channel that is not used; or NAME=UNIT"
            ))),
        Some(_) => Ok(()),
    }
}

/// Column by its name, or by its number from 1.
fn column_of(table: &Table, name: &str) -> Option<usize> {
    let by_name = (0..table.width()).find(|i| table.label(*i) == name);
    by_name.or_else(|| {
        let number = name.parse().ok()?;
        table.find(&ColumnName::Number(number)).ok()
    })
}

fn option_column(table: &Table, option: &str, name: &str) -> Result<usize, InputError> {
    column_of(table, name).ok_or_else(|| {
        let labels: Vec<String> = (0..table.width()).map(|i| table.label(i)).collect();
        let names = || labels.iter().map(String::as_str);
        InputError::argument(option, "no such column")
            .found(quote(name))
            .expected(format!(
                "a column of {}: {}",
                table.path().display(),
                one_of(names())
            ))
            .hint_if(did_you_mean(name, names()))
    })
}
