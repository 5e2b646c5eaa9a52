//! The unit of a column: from the model, else from the file, else SI.

use crate::config::ModelFile;
use crate::config::scalar::Text;
use crate::error::InputError;
use crate::observations::Table;
use crate::units::{Kind, Unit};

/// A column whose unit is wanted, and where the model speaks of it.
pub(super) struct Column<'a> {
    pub file: &'a ModelFile,
    /// The experiment's key.
    pub experiment: &'a str,
    /// Name of the channel: a key of `columns` and `units`.
    pub name: &'a str,
    pub kind: Kind,
    /// Unit that the model gives.
    pub given: Option<&'a Text>,
    pub table: &'a Table,
    pub index: usize,
}

impl Column<'_> {
    /// The unit: that of the model, else the one that the file states in its row of units or behind
    /// the name, else SI. Every other unit that the file states is a warning.
    ///
    /// # Errors
    /// When the model's unit is none of this kind; when the model gives none and the file states two.
    pub fn unit(&self, warnings: &mut Vec<String>) -> Result<Unit, InputError> {
        let Self { name, kind, .. } = *self;
        let stated = self.table.stated_unit(self.index);
        let units_key = format!("{}.units.{name}", self.experiment);
        let columns_key = format!("{}.columns.{name}", self.experiment);
        let label = self.table.label(self.index);
        let (si, suffix) = (Unit::si(kind), stated.suffix(kind));
        let differs = |unit: &Unit, used: Unit| unit.factor() != used.factor();
        if let Some(text) = self.given {
            let unit = Unit::parse(kind, &text.0)
                .map_err(|error| self.file.error_about(&units_key, error))?;
            let other = stated.explicit(kind).or(suffix);
            if let Some(other) = other.filter(|other| differs(other, unit)) {
                warnings.push(format!(
                    "{units_key}: the column `{label}` is taken in {}, though the file says {}",
                    unit.symbol(),
                    other.symbol()
                ));
            }
            return Ok(unit);
        }
        self.table.check_stated_unit(self.index).map_err(|error| {
            let way_out = format!("`units: {{{name}: …}}` in the model decides");
            error.key(&*columns_key).hint(way_out)
        })?;
        if let Some(unit) = stated.explicit(kind) {
            if let Some(other) = suffix.filter(|other| differs(other, unit)) {
                warnings.push(format!(
                    "{columns_key}: the column `{label}` is taken in {}, as the file says, though \
                     its name ends like {}",
                    unit.symbol(),
                    other.symbol()
                ));
            }
            return Ok(unit);
        }
        if let Some(text) = stated.text() {
            warnings.push(format!(
                "{columns_key}: `{text}`, which the file gives as the unit of `{label}`, is not \
                 known as one of {}; the values are taken as they are, in {}",
                kind.name(),
                si.symbol(),
            ));
            return Ok(si);
        }
        if let Some(looks) = suffix.filter(|unit| differs(unit, si)) {
            warnings.push(format!(
                "{columns_key}: the column `{label}` is taken in {}, though its name ends like \
                 {}; if that is its unit, say `units: {{{name}: {}}}`",
                si.symbol(),
                looks.symbol(),
                looks.symbol(),
            ));
        }
        // A name like `phi_rad` or `acc_V` says what reports should call the unit.
        Ok(suffix.filter(|unit| !differs(unit, si)).unwrap_or(si))
    }

    /// Warns where the file states another unit of this column than the one that it is taken in,
    /// since it belongs to another column: a standard deviation to the readings.
    pub fn same_as(&self, used: Unit, key: &str, warnings: &mut Vec<String>) {
        let stated = self.table.stated_unit(self.index);
        let own = stated.explicit(self.kind).or(stated.suffix(self.kind));
        if let Some(own) = own.filter(|own| own.factor() != used.factor()) {
            warnings.push(format!(
                "{key}: the column `{}` is taken in {}, as the readings, though the file says {}",
                self.table.label(self.index),
                used.symbol(),
                own.symbol()
            ));
        }
    }
}
