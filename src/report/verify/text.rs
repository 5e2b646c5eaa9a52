//! The checks of a verification as text.

use super::{Check, Difference, Verification};
use crate::number_format::significant;

/// Most differences that are listed; `--json` has all.
const MOST: usize = 10;
/// Digits of a value.
const DIGITS: usize = 8;

/// A number with eight digits.
pub(super) fn number(x: f64) -> String {
    significant(x, DIGITS)
}

pub(super) fn text(verification: &Verification) -> String {
    let checks = &verification.checks;
    let width = |column: fn(&Check) -> &str| {
        checks
            .iter()
            .map(|c| column(c).chars().count())
            .max()
            .unwrap_or(0)
    };
    let [name, stored, recomputed] = [
        width(|c| c.name),
        width(|c| &c.stored),
        width(|c| &c.recomputed),
    ];
    let mut lines: Vec<String> = checks
        .iter()
        .map(|check| {
            let word = match check.holds {
                true => "holds",
                false => "DOES NOT HOLD",
            };
            let difference = check.difference.map(|d| match d == 0.0 {
                true => " (exact)".to_owned(),
                false => format!(" ({d:.0e})"),
            });
            format!(
                "{:name$}  {:stored$}  recomputed {:recomputed$}  {word}{}",
                check.name,
                check.stored,
                check.recomputed,
                difference.unwrap_or_default()
            )
        })
        .collect();
    let wrong = checks.iter().filter(|check| !check.holds).count();
    lines.push(match wrong {
        0 => format!("all {} hold", checks.len()),
        1 => format!("1 of {} does not hold", checks.len()),
        _ => format!("{wrong} of {} do not hold", checks.len()),
    });
    let differences = &verification.differences;
    lines.extend(differences.iter().take(MOST).map(difference));
    if let Some(more) = differences.len().checked_sub(MOST).filter(|more| *more > 0) {
        lines.push(format!("  and {more} more; `--json` lists all"));
    }
    lines.join("\n") + "\n"
}

fn difference(difference: &Difference) -> String {
    let Difference {
        file,
        place,
        stored,
        recomputed,
    } = difference;
    format!("  {file}: {place}: stored {stored}, recomputed {recomputed}")
}
