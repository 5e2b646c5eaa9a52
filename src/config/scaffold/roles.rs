//! Roles of columns from their names and units.

use crate::tables::Table;
use crate::units::{Quantity, ScaledUnit, Unit};

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
/// Longest name that is compared as a single letter with a number or unit: `y1`.
const LONGEST_LETTER: usize = 2;

impl Role {
    /// All roles.
    pub const ALL: [Self; 7] = [
        Self::Time,
        Self::Displacement,
        Self::Velocity,
        Self::Acceleration,
        Self::Force,
        Self::BaseAcceleration,
        Self::BaseDisplacement,
    ];

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

    /// The measured quantity.
    pub fn kind(self) -> Quantity {
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
    /// Number of units in one of the file.
    pub(super) scale: f64,
    /// True if the model file must state the unit, because no row of units or name does so in a recognised form.
    pub(super) state_unit: bool,
    /// True if the role follows from the position of the column alone.
    pub(super) guessed: bool,
    /// True if the file or an option states the unit.
    pub(super) has_unit: bool,
    /// True if an option states role or unit.
    pub(super) is_stated: bool,
}

impl UsedColumn {
    /// A column whose role follows from its position or an option alone, in SI.
    pub(super) fn guessed(index: usize, role: Role) -> Self {
        Self {
            index,
            role,
            unit: Unit::si(role.kind()),
            scale: 1.0,
            state_unit: false,
            guessed: false,
            has_unit: false,
            is_stated: false,
        }
    }

    /// States the unit, which the model file then repeats.
    pub(super) fn state(&mut self, stated: ScaledUnit) {
        self.unit = stated.unit;
        self.scale = stated.scale;
        self.state_unit = true;
        self.has_unit = true;
        self.is_stated = true;
    }

    /// Factor from the numbers of the file to SI.
    pub fn factor(&self) -> f64 {
        self.scale * self.unit.factor()
    }

    /// True if neither the file nor an option states the unit.
    pub(super) fn has_assumed_unit(&self) -> bool {
        !self.has_unit
    }

    /// The unit with its factor: `50 g`.
    pub(super) fn unit_in_words(&self) -> String {
        match self.scale == 1.0 {
            true => self.unit.symbol().to_owned(),
            false => format!("{} {}", self.scale, self.unit.symbol()),
        }
    }
}

/// Role and unit of a column from its name and stated unit.
pub(super) fn known(table: &Table, index: usize) -> Option<UsedColumn> {
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
        role: role.of_base().filter(|_| is_base).unwrap_or(role),
        state_unit: in_name && unit.factor() != 1.0,
        has_unit: found.is_some(),
        unit,
        ..UsedColumn::guessed(index, role)
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
pub(super) fn is_foreign(label: &str) -> bool {
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
