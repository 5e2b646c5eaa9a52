//! Suggestions about force terms.

use super::{Suggestion, written};
use kmcfit_core::solvers::MissingTerm;

/// Shift of the estimates by half the width of Coulomb friction at which a smaller one aims, in standard errors.
const WIDTH_SHIFT: f64 = 0.06;

/// A missing term of an equation of motion.
pub(super) fn about_term(missing: &MissingTerm) -> Suggestion {
    let width = missing
        .width
        .map(|width| format!(", width: {}", written(width)));
    Suggestion::change(
        "add_term",
        "add the missing term",
        vec![format!(
            "functions.{}={{basis: constant, start: {}{}}}",
            missing.term.name(),
            written(missing.value),
            width.unwrap_or_default()
        )],
    )
}

/// A better width of Coulomb friction: the shift of the estimates is at most proportional to it.
pub(super) fn about_width(width: f64, better: f64, errors: f64) -> Suggestion {
    let least = width * WIDTH_SHIFT / errors;
    let (kind, words, to) = match better > width {
        true => (
            "widen_friction",
            "a larger width of Coulomb friction fits better",
            better,
        ),
        false => (
            "narrow_friction",
            "the estimates depend on the width of Coulomb friction: reduce it",
            better.max(least.min(0.5 * width)),
        ),
    };
    let to = written(to);
    Suggestion::change(
        kind,
        words,
        vec![format!("functions.coulomb_friction.width={to}")],
    )
}
