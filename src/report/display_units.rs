//! Units in which a page and its figures show the measured quantities, in place of those of the files.

use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::text_io::{one_of, quote};
use crate::units::{Quantity, Unit};
use kmcfit_core::internals::record::ChannelKind;

/// The quantities whose unit can be chosen.
const QUANTITIES: [Quantity; 4] = [
    Quantity::Displacement,
    Quantity::Velocity,
    Quantity::Acceleration,
    Quantity::Force,
];

/// Units for display by quantity; a quantity without one keeps that of its file, an input its SI unit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DisplayUnits {
    units: [Option<Unit>; 4],
}

impl DisplayUnits {
    /// Reads `acceleration=g,force=kN`; `is_rotation` is true for angles and moments.
    ///
    /// # Errors
    /// For a text without `=`, an unknown quantity, one that is given twice, a unit of another quantity or of the other motion, and volts.
    pub fn parse(text: &str, is_rotation: bool) -> Result<Self, InputError> {
        let mut display = Self::default();
        for part in text.split(',') {
            let (name, unit) = part.split_once('=').ok_or_else(|| {
                InputError::argument("--units", "a unit without its quantity")
                    .found(quote(part))
                    .expected("quantities and units, as in `acceleration=g,force=kN`")
            })?;
            let (place, quantity) = quantity(name.trim())?;
            let unit = Unit::parse(quantity, unit)?;
            if unit.is_arbitrary() || unit.is_angular() != is_rotation {
                let symbols = Unit::symbols(quantity).filter(|symbol| {
                    let known = Unit::recognise(quantity, symbol);
                    known.is_some_and(|u| !u.is_arbitrary() && u.is_angular() == is_rotation)
                });
                let motion = if is_rotation {
                    "rotation"
                } else {
                    "translation"
                };
                let what = format!("not a unit of the {} of a {motion}", quantity.name());
                return Err(InputError::argument("--units", what)
                    .found(quote(unit.symbol()))
                    .expected(one_of(symbols)));
            }
            if display.units[place].replace(unit).is_some() {
                return Err(
                    InputError::argument("--units", "the quantity is given twice")
                        .found(quote(text))
                        .expected("one unit for each quantity"),
                );
            }
        }
        Ok(display)
    }

    /// Unit of a channel.
    pub(super) fn of_channel(&self, kind: ChannelKind) -> Option<Unit> {
        let [displacement, velocity, acceleration, _] = self.units;
        match kind {
            ChannelKind::Displacement => displacement,
            ChannelKind::Velocity => velocity,
            ChannelKind::Acceleration => acceleration,
        }
    }

    /// Unit of the force.
    pub(super) fn of_force(&self) -> Option<Unit> {
        self.units[3]
    }
}

/// A quantity and its place, by its name.
fn quantity(name: &str) -> Result<(usize, Quantity), InputError> {
    let mut quantities = QUANTITIES.into_iter().enumerate();
    let found = quantities.find(|(_, quantity)| quantity.name() == name);
    let names = || QUANTITIES.iter().map(|quantity| quantity.name());
    found.ok_or_else(|| {
        InputError::argument("--units", "unknown quantity")
            .found(quote(name))
            .expected(one_of(names()))
            .hint_if(did_you_mean(name, names()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use insta::assert_snapshot;

    #[test]
    fn units_are_read_by_quantity() {
        let display = DisplayUnits::parse("acceleration=g, force=kN", false).expect("valid");
        let unit = display.of_channel(ChannelKind::Acceleration);
        assert_eq!(unit.map(|u| u.symbol()), Some("g"));
        assert_eq!(display.of_force().map(|u| u.factor()), Some(1e3));
        assert_eq!(display.of_channel(ChannelKind::Velocity), None);
        assert!(DisplayUnits::parse("displacement=deg", true).is_ok());
    }

    #[test]
    fn messages_of_units_for_display() {
        let messages = [
            "g",
            "acceleratoin=g",
            "force=kn",
            "force=g",
            "displacement=deg",
            "force=V",
            "force=N,force=kN",
        ]
        .map(|text| {
            DisplayUnits::parse(text, false)
                .expect_err(text)
                .to_string()
        });
        assert_snapshot!(messages.join("\n"), @"
        --units: a unit without its quantity
          found: `g`
          expected: quantities and units, as in `acceleration=g,force=kN`
        --units: unknown quantity
          found: `acceleratoin`
          expected: one of: displacement, velocity, acceleration, force
          hint: did you mean `acceleration`?
        unit of the force: unknown unit
          found: `kn`
          expected: one of: N, kN, mN, lbf, N m, mN m, V
          hint: did you mean `kN`?
        unit of the force: unknown unit
          found: `g`
          expected: one of: N, kN, mN, lbf, N m, mN m, V
          hint: this is a unit of acceleration
        --units: not a unit of the displacement of a translation
          found: `deg`
          expected: one of: m, mm, cm, µm, in, ft
        --units: not a unit of the force of a translation
          found: `V`
          expected: one of: N, kN, mN, lbf
        --units: the quantity is given twice
          found: `force=N,force=kN`
          expected: one unit for each quantity
        ");
    }
}
