//! Coefficient functions of a scaffolded model: constants, and comments on what else they can be.

use super::statements::Statements;
use super::{FileRecord, Role, commented};
use kmcfit_core::structure::CoefficientKind;

/// Below the functions: how to let one vary, and what else they can be.
const OTHERS: &str = "\
# To let a coefficient vary with time, replace {basis: constant}, for example by
#   {basis: polynomial, degree: 1}                # a straight line over the record
#   {basis: piecewise-linear, knots: 5}           # straight pieces between five knots
#   {basis: b-spline, knots: auto}                # smooth; its smoothness follows from the record
# and compare both models: `kmcfit compare MODEL OTHER_MODEL`. A variation that the record does not show widens all intervals.
# A known coefficient is fixed: {fixed: 4.5}; a nearly known one: {fixed: {value: 4.5, sigma: 0.02}}.
# Further force terms:
#   cubic_stiffness:  {basis: constant, start: 0.0}
#   coulomb_friction: {basis: constant, start: 0.0, width: 0.001}
";

/// The section `functions`. Start values are left out: they follow from the records.
pub(super) fn functions(records: &[FileRecord], statements: &Statements) -> String {
    let fixed = |value: f64| format!("{{fixed: {value:?}}}");
    let mass = statements.known(CoefficientKind::MASS);
    let (mass, comment) = match (mass, is_unknown(records, statements)) {
        (Some(mass), _) => (fixed(mass), "kg; as stated"),
        (None, true) => (
            "{fixed: unknown}".to_owned(),
            "or its value in kg; without it and without a measured force the results are ratios to the mass",
        ),
        (None, false) => (
            "{basis: constant}".to_owned(),
            "kg; identifiable, because the force is measured or a coefficient is known",
        ),
    };
    let [damping, stiffness] = match is_unknown(records, statements) {
        true => ["1/s, ratio to the mass", "1/s^2, ratio to the mass"],
        false => [
            CoefficientKind::DAMPING.unit(),
            CoefficientKind::STIFFNESS.unit(),
        ],
    };
    let stated = |kind| statements.known(kind);
    let value = |kind| stated(kind).map_or("{basis: constant}".to_owned(), fixed);
    let (c, k) = (CoefficientKind::DAMPING, CoefficientKind::STIFFNESS);
    let comment_of = |kind, unit: &str, start: &str| match stated(kind) {
        Some(_) => format!("{unit}; as stated"),
        None => format!("{unit}; {start}"),
    };
    String::from("functions:\n")
        + &commented(&format!("  mass:      {mass}"), comment)
        + &commented(
            &format!("  damping:   {}", value(c)),
            &comment_of(
                c,
                damping,
                "starts from the decay or the frequency response",
            ),
        )
        + &commented(
            &format!("  stiffness: {}", value(k)),
            &comment_of(k, stiffness, "starts from the dominant frequency"),
        )
        + OTHERS
}

/// True if nothing determines the mass.
pub(super) fn is_unknown(records: &[FileRecord], statements: &Statements) -> bool {
    let is_driven = |record: &FileRecord| record.columns.has(Role::Force);
    statements.fixed.is_empty() && !records.iter().any(is_driven)
}
