//! Sensors whose parameters are estimated.

use super::columns::ColumnAssignment;
use super::record_summary::RecordSummary;
use super::roles::{Role, UsedColumn};
use crate::tables::Table;

/// Words for a motion measured from the base.
const RELATIVE: [&str; 5] = ["relative", "rel", "drift", "deformation", "stretch"];

/// Sensors with their parameters, and the reasons.
pub(super) fn sensors(
    columns: &ColumnAssignment,
    table: &Table,
    record: &RecordSummary,
    codes: &[(f64, usize)],
) -> (Vec<String>, Vec<&'static str>) {
    let has_base = columns.has(Role::BaseAcceleration) || columns.has(Role::BaseDisplacement);
    let is_relative = |role| columns.is_named(table, role, &RELATIVE);
    let channels = [Role::Acceleration, Role::Displacement, Role::Velocity];
    let channels = channels.into_iter().filter(|role| columns.has(*role));
    let each = channels.map(|role| {
        let (parameters, why) = match role {
            // The equation error estimates no offset.
            _ if record.is_kept_up => {
                return (
                    format!("{}: {{offset: {}}}", role.key(), mean(table, columns.find(role), codes)),
                    "the mean, SI: the motion is one about rest",
                );
            }
            Role::Acceleration if has_base && is_relative(role) => (
                "offset: estimate, absolute: false",
                "relative to the base, by its name; accelerometers usually have an offset",
            ),
            Role::Acceleration => (
                "offset: estimate",
                "accelerometers usually have an offset; remove the line if yours has none",
            ),
            Role::Displacement if record.drifts => (
                "offset: estimate, drift: estimate",
                "the record oscillates about a sloping line",
            ),
            Role::Displacement if columns.has(Role::BaseDisplacement) && !is_relative(role) => (
                "offset: estimate, absolute: true",
                "both from the ground; `absolute: false` if the displacement is relative to the base",
            ),
            // A small offset is invisible in a short record and changes frequency and damping.
            Role::Displacement => (
                "offset: estimate",
                "the zero of a displacement is seldom that of the rest position; remove the line if yours is",
            ),
            _ => (
                "offset: estimate",
                "the zero of a velocity is seldom exact; remove the line if yours is",
            ),
        };
        (format!("{}: {{{parameters}}}", role.key()), why)
    });
    each.unzip()
}

/// Mean of a column, SI, with four digits.
fn mean(table: &Table, column: Option<&UsedColumn>, codes: &[(f64, usize)]) -> String {
    let samples = column.and_then(|c| Some((c.factor(), table.samples(c.index).ok()?)));
    let (factor, samples) = samples.unwrap_or((1.0, &[]));
    let is_sample = |x: &&f64| x.is_finite() && !codes.iter().any(|(code, _)| code == *x);
    let (sum, count) = (samples.iter().filter(is_sample))
        .fold((0.0, 0u32), |(sum, count), x| (sum + x, count + 1));
    super::short(factor * sum / f64::from(count.max(1)))
}
