//! The unit of a column: from the model, else from the file, else SI.

use crate::config::lowering::ModelKey;
use crate::error::InputError;
use crate::tables::Table;
use crate::units::{Measurand, ScaledUnit, Unit};
use kmcfit_core::assessment::Doubt;
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use serde_json::json;

/// A column of a table, its keys in the model file and its kind of quantity.
pub(super) struct QuantityColumn<'a> {
    /// The experiment.
    pub at: &'a ModelKey<'a>,
    /// Name of the channel: a key of `columns` and `units`.
    pub name: &'a str,
    pub kind: Measurand,
    /// Unit given in the model file.
    pub given: Option<&'a String>,
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
            let (column, stated) = (self.table.label(self.index), unapplied.join(", "));
            let (quantity, si) = (self.name, Unit::si(self.kind));
            let unit = si.symbol();
            let text = format!(
                "the file states {stated} for the column `{column}`, which is not applied: state what one unit of its numbers is, as in \
                 `units: {{{quantity}: 0.1 {unit}}}`"
            );
            let found =
                json!({"column": column, "stated": stated, "quantity": quantity, "unit": unit});
            warnings.push(
                Finding::having("scale_not_applied", text, found)
                    .rated(Severity::Check)
                    .at(&self.key("columns")),
            );
        }
        self.stated_unit(warnings).map(ScaledUnit::from)
    }

    /// The key of the column in a map of the experiment.
    fn key(&self, map: &str) -> String {
        format!("{}.{map}.{}", self.at.key, self.name)
    }

    /// A warning that the unit `used` is taken from one place, and that another one states another unit.
    fn differs(&self, kind: &str, [from, other]: [&str; 2], [used, stated]: [&Unit; 2]) -> Finding {
        let column = self.table.label(self.index);
        let (used, stated) = (used.symbol(), stated.symbol());
        let text = format!("column `{column}`: unit taken from {from} ({used}); {other} {stated}");
        Finding::having(
            kind,
            text,
            json!({"column": column, "used": used, "stated": stated}),
        )
    }

    fn given_unit(
        &self,
        text: &str,
        warnings: &mut Vec<Finding>,
    ) -> Result<ScaledUnit, InputError> {
        let units_key = self.key("units");
        let other = self.stated();
        let scaled = ScaledUnit::parse(self.kind, text, other)
            .map_err(|error| self.at.file.error_about(&units_key, error))?;
        let unit = scaled.unit;
        let differs = |other: &Unit| !other.is_arbitrary() && other.factor() != unit.factor();
        if let Some(other) = other.filter(differs) {
            let positions = ["the model", "the file says"];
            let warning = self.differs("unit_differs_from_file", positions, [&unit, &other]);
            warnings.push(warning.at(&units_key));
        }
        Ok(scaled)
    }

    /// The unit that the table states, else that of SI.
    fn stated_unit(&self, warnings: &mut Vec<Finding>) -> Result<Unit, InputError> {
        let Self { name, kind, .. } = *self;
        let stated = self.table.stated_unit(self.index);
        let columns_key = self.key("columns");
        let column = self.table.label(self.index);
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
            let unit = volts.symbol();
            let text = format!(
                "the {} in the column `{column}` is in {unit}: state the sensitivity of its sensor, as in `units: {{{name}: \
                 10 V/(m/s²)}}`",
                name.replace('_', " ")
            );
            let found = json!({"column": column, "quantity": name, "unit": unit});
            warnings.push(
                Finding::having("volts", text, found)
                    .rated(Severity::Check)
                    .at(&columns_key),
            );
            return Ok(volts);
        }
        if let Some(unit) = stated.explicit(kind) {
            if let Some(other) = suffix.filter(|other| differs(other, unit)) {
                let positions = ["the file's row of units", "its name ends in"];
                let warning = self.differs("unit_differs_from_name", positions, [&unit, &other]);
                warnings.push(warning.at(&columns_key));
            }
            return Ok(unit);
        }
        let used = si.symbol();
        let (warning, text, found) = match (stated.text(), suffix) {
            (Some(stated), _) => (
                "unknown_unit",
                format!(
                    "the unit `{stated}` of the {} in the column `{column}` is not known: {used} is assumed; state one under `units`",
                    kind.name()
                ),
                json!({"column": column, "stated": stated, "quantity": kind.name(), "used": used}),
            ),
            // A name like `phi_rad` has the symbol of the unit for reports.
            (None, Some(unit)) if !differs(&unit, si) => return Ok(unit),
            (None, Some(unit)) => {
                let stated = unit.symbol();
                let text = format!(
                    "column `{column}`: {used} is assumed, although its name ends in {stated}; add `units: {{{name}: {stated}}}` if it is \
                     in {stated}"
                );
                let found = json!({"column": column, "name": name, "used": used, "stated": stated});
                ("unit_of_name_unused", text, found)
            }
            (None, None) => {
                let units = vec![format!("{} in {used}", name.replace('_', " "))];
                warnings.push(Doubt::UnitsAssumed { units }.into());
                return Ok(si);
            }
        };
        warnings.push(
            Finding::having(warning, text, found)
                .rated(Severity::Check)
                .at(&columns_key),
        );
        Ok(si)
    }

    /// Warns if the table states another unit for this column of standard deviations than `used`, the unit of the
    /// samples that they belong to.
    pub fn same_as(&self, used: Unit, key: &str, warnings: &mut Vec<Finding>) {
        if let Some(own) = self.stated().filter(|own| own.factor() != used.factor()) {
            let positions = ["the samples", "the file says"];
            let warning = self.differs("sigma_unit_differs", positions, [&used, &own]);
            warnings.push(warning.at(key));
        }
    }

    /// The unit that the table states by its row of units or the end of the name.
    fn stated(&self) -> Option<Unit> {
        let stated = self.table.stated_unit(self.index);
        stated.explicit(self.kind).or(stated.suffix(self.kind))
    }
}
