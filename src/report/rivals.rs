//! Time or amplitude in words.

use crate::number_format::significant;
use crate::report::text::and_list;
use kmcfit_core::assessment::AmplitudeRival;

/// Difference of BIC beyond which the rival is favoured.
const FAVOURED: f64 = -10.0;

/// The rival as a clause: the functions that vary, the terms that depend on the amplitude, and the difference of BIC.
pub fn rival_in_words(rival: &AmplitudeRival) -> String {
    let terms: Vec<String> = rival
        .terms
        .iter()
        .map(|term| term.row().words.to_owned())
        .collect();
    let functions = and_list(&rival.functions);
    let verb = match rival.functions.len() {
        1 => "varies",
        _ => "vary",
    };
    let constants = match terms.is_empty() {
        true => "constants".to_owned(),
        false => format!("constants with {}", and_list(&terms)),
    };
    let size = significant(rival.bic_difference.abs(), 2);
    match rival.bic_difference {
        d if terms.is_empty() => format!(
            "constants explain the samples as well as a {functions} that {verb} with time (BIC {size} {})",
            if d < 0.0 { "lower" } else { "higher" }
        ),
        d if d < FAVOURED => format!(
            "{functions} {verb} with amplitude rather than time: {constants} explain the samples better (BIC {size} lower)"
        ),
        d => format!(
            "{functions} {verb} with time or with amplitude: {constants} explain the samples as well (BIC {size} {})",
            if d < 0.0 { "lower" } else { "higher" }
        ),
    }
}
