//! Section of the validation records: what was predicted, and what was fitted to them.

use super::figures;
use super::table::{list, paragraph};
use crate::report::FittedModel;
use crate::report::channel_view::sentence;
use crate::report::document::{ResultDocument, ValidationSummary};
use crate::report::extent;
use kmcfit_core::number_format::and_list;

/// Result, basis and figures of the validation; empty without validation records.
pub(super) fn validation(run: &FittedModel, document: &ResultDocument) -> String {
    let Some(result) = extent::validation(document) else {
        return String::new();
    };
    let basis = "The coefficients are fixed at their estimates; these records had no part in the fit. A fit of 90 % or more passes.";
    let records: Vec<String> = document.validation.iter().map(record).collect();
    paragraph(&format!("{} {basis}", sentence(&result)))
        + &list(&records)
        + &figures(&run.drawn().validation)
}

/// A record with its own parameters.
fn record(record: &ValidationSummary) -> String {
    if let Some(failure) = &record.failure {
        return format!("{}: no response: {failure}", record.name);
    }
    let own = format!(" of {}", record.name);
    let names = record.nuisance_parameters.iter();
    let names: Vec<String> = names.map(|p| p.name.replace(&own, "")).collect();
    match names.as_slice() {
        [] => format!("{}: nothing was fitted to it", record.name),
        [only] => format!("{}: only its {only} was fitted to it", record.name),
        several => format!(
            "{}: only its {} were fitted to it",
            record.name,
            and_list(several)
        ),
    }
}
