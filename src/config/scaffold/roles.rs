//! Roles of columns from their names and units.

use crate::quantity_names::{is_foreign, quantity_of, without_base};
use crate::tables::Table;
use crate::units::{Measurand, ScaledUnit, Unit};

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
    pub fn kind(self) -> Measurand {
        match self {
            Role::Time => Measurand::Time,
            Role::Displacement | Role::BaseDisplacement => Measurand::Displacement,
            Role::Velocity => Measurand::Velocity,
            Role::Acceleration | Role::BaseAcceleration => Measurand::Acceleration,
            Role::Force => Measurand::Force,
        }
    }

    fn of(kind: Measurand) -> Self {
        match kind {
            Measurand::Time => Role::Time,
            Measurand::Displacement => Role::Displacement,
            Measurand::Velocity => Role::Velocity,
            Measurand::Acceleration => Role::Acceleration,
            Measurand::Force => Role::Force,
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
    let path = || quantity_of(table.headers().get(index)?);
    let by_name = quantity_of(&label).or_else(path).map(Role::of);
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
    let is_mechanical = |role: &Role| unit_of(*role).is_some_and(|(unit, _)| !unit.is_arbitrary());
    let by_unit = roles.into_iter().find(is_mechanical);
    if by_unit.is_none() && is_foreign(&label) {
        return None;
    }
    // A role by name takes precedence if its unit agrees, because some units fit several quantities.
    let role = by_name
        .filter(|r| unit_of(*r).is_some())
        .or(by_unit)
        .or(by_name)?;
    let word = || stated.last_word(role.kind()).map(|u| (u, true));
    let found = unit_of(role).or_else(word);
    let (unit, in_name) = found.unwrap_or((Unit::si(role.kind()), false));
    Some(UsedColumn {
        role: role.of_base().filter(|_| is_base).unwrap_or(role),
        state_unit: in_name && unit.factor() != 1.0,
        has_unit: found.is_some(),
        unit,
        ..UsedColumn::guessed(index, role)
    })
}
