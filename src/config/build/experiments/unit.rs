//! The unit of a column: from the model, else from the file, else SI.

use super::warning::DataWarning;
use crate::config::ModelFile;
use crate::config::values::Text;
use crate::error::InputError;
use crate::finding::Finding;
use crate::tables::Table;
use crate::units::{Quantity, ScaledUnit, Unit};

/// A column of a table, its keys in the model file and its kind of quantity.
pub(super) struct QuantityColumn<'a> {
    pub file: &'a ModelFile,
    /// The experiment's key.
    pub experiment: &'a str,
    /// Name of the channel: a key of `columns` and `units`.
    pub name: &'a str,
    pub kind: Quantity,
    /// Unit given in the model file.
    pub given: Option<&'a Text>,
    pub table: &'a Table,
    pub index: usize,
}

impl QuantityColumn<'_> {
    /// Unit of the column: from the model file, else from the row of units or the name in the table, else SI. A
    /// differing unit in the table gives a warning. A unit of the model file can have a factor.
    ///
    /// # Errors
    /// If the model's unit is not of this kind of quantity, or the table alone states two units.
    pub fn unit(&self, warnings: &mut Vec<Finding>) -> Result<ScaledUnit, InputError> {
        if let Some(text) = self.given {
            return self.given_unit(text, warnings);
        }
        let unapplied = self.table.unapplied(self.index);
        if !unapplied.is_empty() {
            let warning = DataWarning::ScaleNotApplied {
                column: self.table.label(self.index),
                stated: unapplied.join(", "),
                quantity: self.name.to_owned(),
                unit: Unit::si(self.kind).symbol().to_owned(),
            };
            warnings.push(warning.at(&format!("{}.columns.{}", self.experiment, self.name)));
        }
        self.stated_unit(warnings).map(ScaledUnit::from)
    }

    fn given_unit(
        &self,
        text: &Text,
        warnings: &mut Vec<Finding>,
    ) -> Result<ScaledUnit, InputError> {
        let Self { name, kind, .. } = *self;
        let units_key = format!("{}.units.{name}", self.experiment);
        let stated = self.table.stated_unit(self.index);
        let other = stated.explicit(kind).or(stated.suffix(kind));
        let scaled = ScaledUnit::parse(kind, &text.0, other)
            .map_err(|error| self.file.error_about(&units_key, error))?;
        let unit = scaled.unit;
        let differs = |other: &Unit| !other.is_arbitrary() && other.factor() != unit.factor();
        if let Some(other) = other.filter(differs) {
            let warning = DataWarning::UnitDiffersFromFile {
                column: self.table.label(self.index),
                used: unit.symbol().into(),
                stated: other.symbol().into(),
            };
            warnings.push(warning.at(&units_key));
        }
        Ok(scaled)
    }

    /// The unit that the table states, else that of SI.
    fn stated_unit(&self, warnings: &mut Vec<Finding>) -> Result<Unit, InputError> {
        let Self { name, kind, .. } = *self;
        let stated = self.table.stated_unit(self.index);
        let columns_key = format!("{}.columns.{name}", self.experiment);
        let label = self.table.label(self.index);
        let (si, suffix) = (
            Unit::si(kind),
            stated.suffix(kind).or(stated.last_word(kind)),
        );
        let differs = |unit: &Unit, used: Unit| unit.factor() != used.factor();
        self.table.check_stated_unit(self.index).map_err(|error| {
            let way_out = format!("state the unit in the model: `units: {{{name}: …}}`");
            error.key(&*columns_key).hint(way_out)
        })?;
        let found = stated.explicit(kind).or(suffix);
        if let Some(volts) = found.filter(Unit::is_arbitrary) {
            let warning = DataWarning::Volts {
                column: label,
                quantity: name.to_owned(),
                unit: volts.symbol().into(),
            };
            warnings.push(warning.at(&columns_key));
            return Ok(volts);
        }
        if let Some(unit) = stated.explicit(kind) {
            if let Some(other) = suffix.filter(|other| differs(other, unit)) {
                let warning = DataWarning::UnitDiffersFromName {
                    column: label,
                    used: unit.symbol().into(),
                    stated: other.symbol().into(),
                };
                warnings.push(warning.at(&columns_key));
            }
            return Ok(unit);
        }
        if let Some(text) = stated.text() {
            let warning = DataWarning::UnknownUnit {
                column: label,
                stated: text.to_string(),
                quantity: kind.name(),
                used: si.symbol().into(),
            };
            warnings.push(warning.at(&columns_key));
            return Ok(si);
        }
        let warning = match suffix {
            // A name like `phi_rad` has the symbol of the unit for reports.
            Some(unit) if !differs(&unit, si) => return Ok(unit),
            Some(unit) => DataWarning::UnitOfNameUnused {
                column: label,
                name: name.to_owned(),
                used: si.symbol().into(),
                stated: unit.symbol().into(),
            },
            None => DataWarning::UnitAssumed {
                column: label,
                quantity: name.to_owned(),
                unit: si.symbol().into(),
            },
        };
        warnings.push(warning.at(&columns_key));
        Ok(si)
    }

    /// Warns if the table states another unit for this column of standard deviations than `used`, the unit of the
    /// samples that they belong to.
    pub fn same_as(&self, used: Unit, key: &str, warnings: &mut Vec<Finding>) {
        let stated = self.table.stated_unit(self.index);
        let own = stated.explicit(self.kind).or(stated.suffix(self.kind));
        if let Some(own) = own.filter(|own| own.factor() != used.factor()) {
            let warning = DataWarning::SigmaUnitDiffers {
                column: self.table.label(self.index),
                used: used.symbol().into(),
                stated: own.symbol().into(),
            };
            warnings.push(warning.at(key));
        }
    }
}
