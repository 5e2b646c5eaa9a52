//! Sensors whose parameters are estimated.

use super::columns::ColumnAssignment;
use super::record_summary::RecordSummary;
use super::roles::Role;
use crate::tables::Table;

/// Words for a motion measured from the base.
const RELATIVE: [&str; 5] = ["relative", "rel", "drift", "deformation", "stretch"];

/// Sensors with estimated parameters, and the reasons.
pub(super) fn sensors(
    columns: &ColumnAssignment,
    table: &Table,
    record: &RecordSummary,
) -> (Vec<&'static str>, Vec<&'static str>) {
    let mut sensors = Vec::new();
    if columns.has(Role::Acceleration) {
        let has_base = columns.has(Role::BaseAcceleration) || columns.has(Role::BaseDisplacement);
        sensors.push(
            match has_base && columns.is_named(table, Role::Acceleration, &RELATIVE) {
                true => (
                    "acceleration: {offset: estimate, absolute: false}",
                    "relative to the base, by its name; accelerometers usually have an offset",
                ),
                false => (
                    "acceleration: {offset: estimate}",
                    "accelerometers usually have an offset; remove the line if yours has none",
                ),
            },
        );
    }
    if columns.has(Role::Displacement) {
        sensors.push(match record.drifts {
            true => (
                "displacement: {offset: estimate, drift: estimate}",
                "the record oscillates about a sloping line",
            ),
            false if columns.has(Role::BaseDisplacement) && !columns.is_named(table, Role::Displacement, &RELATIVE) => (
                "displacement: {offset: estimate, absolute: true}",
                "both from the ground; `absolute: false` if the displacement is relative to the base",
            ),
            // A small offset is invisible in a short record and changes frequency and damping.
            false => (
                "displacement: {offset: estimate}",
                "the zero of a displacement is seldom that of the rest position; remove the line if yours is",
            ),
        });
    }
    sensors.into_iter().unzip()
}
