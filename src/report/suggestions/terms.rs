//! Suggestions about force terms.

use super::{Suggestion, written};
use crate::report::document::ResultDocument;
use kmcfit_core::assessment::Doubt;

/// Shift of the estimates by half the width of Coulomb friction at which a smaller one aims, in standard errors.
const WIDTH_SHIFT: f64 = 0.06;

/// The most significant missing term of an equation of motion.
pub(super) fn about_terms(document: &ResultDocument) -> Option<Suggestion> {
    let missing = document.doubts().find_map(|doubt| match doubt {
        Doubt::MissingTerm(missing) => Some(missing),
        _ => None,
    })?;
    let width = missing
        .width
        .map(|width| format!(", width: {}", written(width)));
    Some(Suggestion::change(
        "add_term",
        "add the missing term",
        vec![format!(
            "functions.{}={{basis: constant, start: {}{}}}",
            missing.term.name(),
            written(missing.value),
            width.unwrap_or_default()
        )],
    ))
}

/// A better width of Coulomb friction: the shift of the estimates is at most proportional to it.
pub(super) fn about_friction(document: &ResultDocument) -> Option<Suggestion> {
    let depends = document.doubts().find_map(|doubt| match doubt {
        Doubt::FrictionWidth {
            width,
            better,
            errors,
            ..
        } => Some((*width, *better, *errors)),
        _ => None,
    });
    let (width, better, errors) = depends?;
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
    Some(Suggestion::change(
        kind,
        words,
        vec![format!("functions.coulomb_friction.width={to}")],
    ))
}
