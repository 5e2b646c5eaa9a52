//! Coefficient functions of a scaffolded model: what the options state, else what the records can determine.

use super::statements::Statements;
use super::{FileRecord, Role, commented};
use kmcfit_core::internals::functions::CoefficientKind;

/// Periods of the response below which the stiffness is constant: fewer do not show how it varies.
const FEWEST_PERIODS: f64 = 4.0;

/// The section `functions`. Start values are left out: they follow from the records.
pub(super) fn functions(records: &[FileRecord], statements: &Statements) -> String {
    let mut text = String::from("functions:\n");
    for kind in [
        CoefficientKind::Mass,
        CoefficientKind::Damping,
        CoefficientKind::Stiffness,
    ] {
        let (value, comment) = match (statements.known(kind), kind) {
            (Some(value), _) => (
                format!("{{fixed: {value:?}}}"),
                format!("{}; as stated", kind.unit()),
            ),
            (None, CoefficientKind::Mass) => mass(records, statements),
            (None, kind) => {
                let unit = match is_unknown(records, statements) {
                    false => kind.unit(),
                    true if kind == CoefficientKind::Damping => "1/s, ratio to the mass",
                    true => "1/s^2, ratio to the mass",
                };
                match kind {
                    CoefficientKind::Damping => (
                        "{basis: constant}".to_owned(),
                        format!("{unit}; starts from the decay or the frequency response"),
                    ),
                    _ => stiffness(records, unit),
                }
            }
        };
        let name = format!("{}:", kind.name());
        text += &commented(&format!("  {name:<10} {value}"), &comment);
    }
    text
}

fn is_driven(records: &[FileRecord]) -> bool {
    records.iter().any(|record| record.columns.has(Role::Force))
}

/// True if nothing determines the mass.
pub(super) fn is_unknown(records: &[FileRecord], statements: &Statements) -> bool {
    let kinds = [
        CoefficientKind::Mass,
        CoefficientKind::Damping,
        CoefficientKind::Stiffness,
    ];
    !is_driven(records) && kinds.iter().all(|kind| statements.known(*kind).is_none())
}

/// The mass where it is not stated.
fn mass(records: &[FileRecord], statements: &Statements) -> (String, String) {
    let (value, comment) = match (is_unknown(records, statements), is_driven(records)) {
        (true, _) => (
            "{fixed: unknown}",
            "or its value in kg; without it and without a measured force the results are ratios to the mass",
        ),
        (false, true) => (
            "{basis: constant}",
            "kg; identifiable, because the force is measured",
        ),
        (false, false) => (
            "{basis: constant}",
            "kg; identifiable, because another coefficient is stated",
        ),
    };
    (value.to_owned(), comment.to_owned())
}

fn stiffness(records: &[FileRecord], unit: &str) -> (String, String) {
    let (value, comment) = match records {
        [only] if only.summary.periods() >= FEWEST_PERIODS => (
            "{basis: b-spline, knots: auto}",
            "varies smoothly; for a constant write {basis: constant}",
        ),
        [_] => (
            "{basis: constant}",
            "the record is too short to show a variation",
        ),
        _ => ("{basis: constant}", "shared by the records"),
    };
    (value.to_owned(), format!("{unit}; {comment}"))
}
