//! Extent of the records of a fit, and the result of its validation, in words.

use super::document::ResultDocument;
use kmcfit_core::assessment::POOR;
use kmcfit_core::number_format::{count, percent, significant};

/// Number of samples, of several records with their number, and duration, of several records the longest; samples for validation apart.
pub(super) fn extent(document: &ResultDocument) -> String {
    let samples = document.experiments.iter().map(|e| e.samples).sum();
    let mut text = size_in_words(samples, document.experiments.len(), document.model.duration);
    let held = document.validation.iter().flat_map(|e| &e.channels);
    let held: usize = held.map(|c| c.samples).sum();
    if held > 0 {
        text += &format!("; validation: {}", count(held, "sample"));
    }
    text
}

/// Number of samples, of several records with their number, and duration (s), of several records the longest.
pub(super) fn size_in_words(samples: usize, records: usize, duration: f64) -> String {
    let (samples, seconds) = (count(samples, "sample"), significant(duration, 4));
    match records {
        0 | 1 => format!("{samples}, {seconds} s"),
        several => format!("{samples} in {several} records of up to {seconds} s"),
    }
}

/// Result of the validation with its worst fit; `None` without validation records.
pub(super) fn validation(document: &ResultDocument) -> Option<String> {
    let records = &document.validation;
    (!records.is_empty()).then_some(())?;
    let channels = records.iter().flat_map(|e| &e.channels);
    let worst = channels.map(|c| c.fit_percent).reduce(f64::min);
    Some(match worst {
        _ if records.iter().any(|e| e.failure.is_some()) => {
            "validation failed: no response".to_owned()
        }
        Some(worst) if worst < POOR => format!("validation failed: fit {}", percent(worst, 2)),
        Some(worst) => format!("validation passed: fit {}", percent(worst, 2)),
        None => "validation: no samples".to_owned(),
    })
}
