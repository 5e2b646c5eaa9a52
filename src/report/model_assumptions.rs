//! Assumptions of a model that stand beside its results: an unknown mass, and units that are not stated.

use super::text::and_list;
use crate::config::Model;
use crate::finding::Finding;

/// Kinds of the assumptions that stand in the short summary.
pub(super) const UNITS_ASSUMED: &str = "units_assumed";
pub(super) const MASS_UNKNOWN: &str = "mass_unknown";

/// The statement that the mass is unknown.
pub(super) fn unknown_mass(model: &Model) -> Option<Finding> {
    let text = "the mass is unknown: all coefficients are ratios to it; `--set functions.mass.fixed=4.5` (kg) states it";
    (model.has_unknown_mass).then(|| Finding::new(MASS_UNKNOWN, text))
}

/// The units that neither the model nor a file states.
pub(super) fn assumed_units(model: &Model) -> Option<Finding> {
    let units = &model.assumed_units;
    let each = units.iter().filter_map(|unit| {
        let quantity = unit.said("quantity")?.replace('_', " ");
        Some(format!("{quantity} in {}", unit.said("unit")?))
    });
    let mut each: Vec<String> = each.collect();
    each.sort();
    each.dedup();
    let list = and_list(&each);
    (!units.is_empty()).then(|| {
        Finding::new(
            UNITS_ASSUMED,
            format!("{list}: assumed, the file does not state it; `units` in the model file does"),
        )
        .with("units", &each)
    })
}
