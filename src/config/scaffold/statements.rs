//! What the options of `kmcfit init` state beside the files: units and roles of columns, and known coefficients.

use super::roles::{Role, UsedColumn, known};
use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::tables::{ColumnName, Table};
use crate::text_io::{one_of, quote};
use crate::units::{Measurand, ScaledUnit, Unit, split_factor};
use kmcfit_core::structure::CoefficientKind;

/// Remedy for a column of times that cannot be used.
pub(super) const OTHER_FILE: &str = "if another file has the times, write one table of both: `paste -d, TIMES.csv RECORD.csv > both.csv`";

/// Statements of the options, for all files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statements {
    /// Sampling rate of a table without a column of times, Hz.
    pub sample_rate: Option<f64>,
    /// Column of the times, by name or number.
    pub time: Option<String>,
    /// Columns of responses, each with its quantity before it or without, `acceleration=ch1`.
    pub responses: Vec<String>,
    /// Column of the force, by name or number.
    pub force: Option<String>,
    /// Column of the motion of the base.
    pub base: Option<String>,
    /// Known coefficients by name, in SI units.
    pub fixed: Vec<(CoefficientKind, f64)>,
    units: Vec<UnitEntry>,
}

/// An entry of `--units`: a quantity, or the name or the number of a column, and its unit.
#[derive(Debug, Clone, PartialEq)]
struct UnitEntry {
    name: String,
    unit: String,
}

impl Statements {
    /// Adds units by quantity or by column: `time=ms,displacement=mm`; a number before the unit is the value of one unit of the file.
    ///
    /// # Errors
    /// For an entry without a name or a unit.
    pub fn state_units(&mut self, text: &str) -> Result<(), InputError> {
        for entry in text.split(',').map(str::trim) {
            let pair = entry.rsplit_once('=');
            let pair = pair.map(|(name, unit)| (name.trim(), unit.trim()));
            let pair = pair.filter(|(name, unit)| !name.is_empty() && !unit.is_empty());
            let Some((name, unit)) = pair else {
                return Err(InputError::argument("--units", "not a name and a unit")
                    .found(quote(entry))
                    .expected("NAME=UNIT with a quantity or a column, as in `time=ms,displacement=mm` or `1=50 g`"));
            };
            let [name, unit] = [name, unit].map(str::to_owned);
            self.units.push(UnitEntry { name, unit });
        }
        Ok(())
    }

    /// Adds a known coefficient; `option` is named in errors.
    ///
    /// # Errors
    /// For another name, and for a value that is no number or a mass that is not positive.
    pub fn fix(&mut self, option: &str, name: &str, text: &str) -> Result<(), InputError> {
        const KINDS: [CoefficientKind; 3] = [
            CoefficientKind::MASS,
            CoefficientKind::DAMPING,
            CoefficientKind::STIFFNESS,
        ];
        let kind = KINDS.into_iter().find(|kind| kind.name() == name.trim());
        let kind = kind.ok_or_else(|| {
            InputError::argument(option, "no such coefficient")
                .found(quote(name))
                .expected(one_of(KINDS.map(CoefficientKind::name)))
        })?;
        let (least, range) = match kind {
            CoefficientKind::MASS => (f64::MIN_POSITIVE, " greater than 0"),
            _ => (f64::MIN, ""),
        };
        let value = text
            .trim()
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite() && *x >= least);
        let value = value.ok_or_else(|| {
            InputError::argument(option, format!("invalid {}", kind.name()))
                .found(quote(text))
                .expected(format!("a number{range}, in {}", kind.unit()))
        })?;
        self.fixed.push((kind, value));
        Ok(())
    }

    /// The known value of a coefficient.
    pub(super) fn known(&self, kind: CoefficientKind) -> Option<f64> {
        let found = self.fixed.iter().find(|(of, _)| *of == kind);
        found.map(|(_, value)| *value)
    }

    /// Error for a unit that no file uses; `is_used` has one entry for each unit.
    pub(super) fn check_used(&self, is_used: &[bool], tables: &[&Table]) -> Result<(), InputError> {
        let mut unused = self.units.iter().zip(is_used).filter(|(_, used)| !**used);
        let Some((UnitEntry { name, .. }, _)) = unused.next() else {
            return Ok(());
        };
        let labels = tables
            .iter()
            .flat_map(|table| (0..table.width()).map(|i| table.label(i)));
        let roles = Role::ALL.into_iter().map(|role| role.key().to_owned());
        let names: Vec<String> = roles.chain(labels).filter(|other| other != name).collect();
        let names = || names.iter().map(String::as_str);
        Err(InputError::argument(
            "--units",
            "no used column is this quantity or has this name",
        )
        .found(quote(name))
        .expected(one_of(names()))
        .hint_if(did_you_mean(name, names())))
    }
}

/// A statement on one column.
#[derive(Debug, Clone, Copy)]
struct ColumnStatement {
    index: usize,
    role: Role,
    unit: ScaledUnit,
}

/// Statements on the columns of one table.
#[derive(Debug, Default)]
pub(super) struct ColumnStatements {
    columns: Vec<ColumnStatement>,
    /// Roles of columns whose unit is their own or that of the role.
    roles: Vec<(usize, Role)>,
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
        let stated = [
            ("--time", &statements.time),
            ("--force", &statements.force),
            ("--base", &statements.base),
        ];
        let stated = stated
            .into_iter()
            .filter_map(|(option, name)| Some((option, name.as_ref()?)));
        let responses = statements.responses.iter().map(|name| ("--response", name));
        for (option, name) in stated.chain(responses) {
            let quantity = name
                .split_once('=')
                .filter(|_| option == "--response" && column_of(table, name).is_none());
            let response = match quantity {
                Some((key, _)) => Some(
                    Role::ALL
                        .into_iter()
                        .find(|r| r.is_channel() && r.key() == key.trim())
                        .ok_or_else(|| {
                            let keys = Role::ALL
                                .into_iter()
                                .filter(|role| role.is_channel())
                                .map(Role::key);
                            InputError::argument(option, "no such response")
                                .found(quote(key))
                                .expected(one_of(keys))
                        })?,
                ),
                None => None,
            };
            let name = quantity.map_or(name.as_str(), |(_, column)| column.trim());
            let index = column_of(table, name).ok_or_else(|| {
                let labels: Vec<String> = (0..table.width()).map(|i| table.label(i)).collect();
                let hint = (option == "--time").then(|| OTHER_FILE.to_owned());
                InputError::argument(option, "no such column")
                    .found(quote(name))
                    .expected(one_of(labels.iter().map(String::as_str)))
                    .hint_if(hint)
            })?;
            let is_length = || {
                known(table, index).is_some_and(|own| own.role.kind() == Measurand::Displacement)
            };
            let own = || {
                known(table, index)
                    .map(|own| own.role)
                    .filter(|role| role.is_channel())
            };
            let role = match option {
                "--time" => Role::Time,
                "--response" => response.or_else(own).unwrap_or(Role::Displacement),
                "--force" => Role::Force,
                _ if is_length() => Role::BaseDisplacement,
                _ => Role::BaseAcceleration,
            };
            found.roles.push((index, role));
        }
        for (location, entry) in statements.units.iter().enumerate() {
            let index = match Role::ALL.iter().find(|role| role.key() == entry.name) {
                Some(role) => {
                    let unit = parse(role.kind(), &entry.unit, None)?;
                    found.quantities.push((location, *role, unit));
                    continue;
                }
                None => column_of(table, &entry.name),
            };
            if let Some(index) = index {
                found.is_used[location] = true;
                let own = known(table, index);
                found.state(index, own, &entry.unit)?;
            }
        }
        Ok(found)
    }

    /// Columns by role, each with the unit of its role in `units`, if any.
    pub fn of_run(roles: Vec<(usize, Role)>, units: &[(Role, ScaledUnit)]) -> Self {
        let unit_of = |(index, role): &(usize, Role)| {
            let (_, unit) = units.iter().find(|(of, _)| of == role)?;
            Some(ColumnStatement {
                index: *index,
                role: *role,
                unit: *unit,
            })
        };
        Self {
            columns: roles.iter().filter_map(unit_of).collect(),
            roles,
            ..Self::default()
        }
    }

    /// States the unit of a column, and its role: its own where the unit is of its quantity, else the first that has this unit.
    fn state(
        &mut self,
        index: usize,
        own: Option<UsedColumn>,
        text: &str,
    ) -> Result<(), InputError> {
        let in_file = own.map(|column| column.unit);
        let own = own.map(|column| column.role);
        let is_of = |role: &Role| ScaledUnit::parse(role.kind(), text, None).is_ok();
        let any = || Role::ALL.into_iter().find(is_of);
        let role = own.filter(is_of).or_else(any);
        let role = role.ok_or_else(|| unknown_unit(text))?;
        let unit = parse(role.kind(), text, in_file)?;
        self.columns.retain(|column| column.index != index);
        self.columns.push(ColumnStatement { index, role, unit });
        Ok(())
    }

    /// The column as stated, else as its name and unit give it.
    pub fn recognise(&self, table: &Table, index: usize) -> Option<UsedColumn> {
        let own = known(table, index).filter(|own| {
            let is_other = |(of, role): &(usize, Role)| *role == Role::Time && *of != index;
            own.role != Role::Time || !self.roles.iter().any(is_other)
        });
        if let Some((_, role)) = self.roles.iter().find(|(of, _)| *of == index) {
            let own = own.filter(|column| column.role.kind() == role.kind());
            let mut column = own.unwrap_or_else(|| UsedColumn::guessed(index, *role));
            column.role = *role;
            column.is_stated = true;
            let unit = self
                .columns
                .iter()
                .find(|column| column.index == index && column.role.kind() == role.kind());
            unit.into_iter()
                .for_each(|stated| column.state(stated.unit));
            return Some(column);
        }
        let Some(stated) = self.columns.iter().find(|column| column.index == index) else {
            return own;
        };
        let own = own.filter(|column| column.role.kind() == stated.role.kind());
        let mut column = own.unwrap_or_else(|| UsedColumn::guessed(index, stated.role));
        column.role = stated.role;
        column.state(stated.unit);
        Some(column)
    }

    /// The response that an unrecognised column is, by the units stated for quantities.
    pub fn response(&self) -> Option<Role> {
        let mut roles = self.quantities.iter().map(|(_, role, _)| *role);
        roles.find(|role| role.is_channel())
    }

    /// States the units by quantity.
    pub fn state_quantities(&mut self, columns: &mut [UsedColumn]) {
        for (location, role, unit) in &self.quantities {
            if let Some(column) = columns.iter_mut().find(|column| column.role == *role) {
                column.state(*unit);
                self.is_used[*location] = true;
            }
        }
    }
}

/// A unit with a factor, for the option `--units`.
fn parse(kind: Measurand, text: &str, in_file: Option<Unit>) -> Result<ScaledUnit, InputError> {
    ScaledUnit::parse(kind, text, in_file).map_err(|error| InputError {
        location: InputError::argument("--units", "").location,
        problem: format!("{} of the {}", error.problem, kind.name()),
        ..error
    })
}

fn unknown_unit(text: &str) -> InputError {
    let symbols = || Measurand::ALL.into_iter().flat_map(Unit::symbols);
    InputError::argument("--units", "unknown unit")
        .found(quote(text))
        .expected(one_of(symbols()))
        .hint_if(did_you_mean(split_factor(text).1, symbols()))
}

/// Column by its name, or by its number from 1.
fn column_of(table: &Table, name: &str) -> Option<usize> {
    let by_name = (0..table.width()).find(|i| table.label(*i) == name);
    by_name.or_else(|| {
        let number = name.parse().ok()?;
        table.find(&ColumnName::Number(number)).ok()
    })
}
