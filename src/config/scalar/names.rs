//! Choices from a list of names.

use super::Scalar;
use crate::config::complaint::Complaint;
use crate::input::quote;

/// Reads one of a list of names.
pub(in crate::config) fn choose<T: Copy>(
    scalar: Scalar<'_>,
    choices: &[(&str, T)],
) -> Result<T, Complaint> {
    let names = || choices.iter().map(|(name, _)| *name);
    let expected = crate::input::one_of(names());
    let Scalar::Text(word) = scalar else {
        return Err(Complaint::new(
            "not one of the choices",
            scalar.describe(),
            expected,
        ));
    };
    match choices.iter().find(|(name, _)| *name == word) {
        Some((_, choice)) => Ok(*choice),
        None => Err(Complaint::new("unknown choice", quote(word), expected)
            .hint(crate::near::did_you_mean(word, names()))),
    }
}
