//! Section of the checks of step, basis and terms: what was tried, and what each gave.

use super::table::{paragraph, table};
use crate::report::answer::in_words;
use crate::report::document::ResultDocument;
use crate::report::document::SelectionStep;
use crate::report::text::decade;
use kmcfit_core::assessment::{ClassicalEstimate, EXACT};
use kmcfit_core::candidates::{Candidate, Candidates, GAIN};
use kmcfit_core::number_format::{at_most, significant};

/// Step-size check, tests against larger models, and the classical estimates. Empty for a fit without any.
pub(super) fn checks(document: &ResultDocument) -> String {
    let mut text = String::new();
    if let Some(step) = &document.step_check
        && step.change_per_sample.is_finite()
    {
        // Residuals that are rounding errors are no measure of the step.
        let is_exact = document.worst_fit().is_some_and(|worst| worst > EXACT);
        let beside_residuals = match is_exact {
            true => ".".to_owned(),
            false => format!(
                ", {} % of the rms residual. The step is too large if it changes the response by more than the rms residual.",
                at_most(100.0 * step.change_per_residual, 2)
            ),
        };
        text += &paragraph(&format!(
            "Step size: half the step ({} s) changes the response by at most {} % of its peak{beside_residuals}",
            significant(step.step, 4),
            at_most(100.0 * step.change_per_sample, 2),
        ));
    }
    text += &ladder(document);
    if let Some(found) = &document.candidates {
        text += &candidates(found);
    }
    let classical = document.classical.as_ref().map(ClassicalEstimate::sentence);
    text + &classical.map_or(String::new(), |classical| {
        paragraph(&format!("Classical estimate: {classical}."))
    })
}

/// Each addition by `--select` with what it changed.
fn ladder(document: &ResultDocument) -> String {
    if document.selection.is_empty() {
        return String::new();
    }
    let change = |pair: Option<[f64; 2]>| {
        pair.map_or(String::new(), |[before, after]| {
            format!("{} → {}", significant(before, 6), significant(after, 6))
        })
    };
    let row = |(i, step): (usize, &SelectionStep)| {
        vec![
            format!("{}. {}", i + 1, stated(step)),
            short(step.gain),
            change(step.natural_frequency),
            change(step.damping_ratio),
        ]
    };
    let rows: Vec<Vec<String>> = document.selection.iter().enumerate().map(row).collect();
    let headings = ["added", "gain", "natural frequency (Hz)", "damping ratio"];
    paragraph(
        "What --select added to the model of the file, until no candidate was preferred, and what each addition changed.",
    ) + &table("Additions", &headings, &rows)
}

/// What was added, and what is as good.
fn stated(step: &SelectionStep) -> String {
    match step.as_good.as_slice() {
        [] => step.added.clone(),
        others => format!("{}; as good: {}", step.added, others.join(", ")),
    }
}

/// Each candidate with its gain and what it estimates.
fn candidates(found: &Candidates) -> String {
    let row = |candidate: &Candidate| {
        let estimates = candidate.estimates.iter().map(|q| {
            let error = match q.standard_error.is_finite() {
                true => format!(" ± {}", short(q.standard_error)),
                false => String::new(),
            };
            let name = in_words(&q.name);
            format!("{name} {}{error} {}", short(q.value), q.unit)
        });
        let estimates: Vec<String> = estimates.collect();
        let how = if candidate.is_refitted {
            "fit"
        } else {
            "linearised"
        };
        vec![
            in_words(&candidate.name),
            short(candidate.gain),
            how.to_owned(),
            estimates.join(", "),
        ]
    };
    let rows: Vec<Vec<String>> = found.list.iter().map(row).collect();
    paragraph(&format!(
        "What the model may lack: the model with one thing more. The gain is the decrease of N ln E + q ln N, with the variance E of the residuals \
         under the best autoregressive noise, N samples and q parameters. A candidate is preferred from a gain of {GAIN} on; two within {GAIN} \
         are equally good. ± is a standard error."
    )) + &table(
        "Candidates",
        &["candidate", "gain", "by", "estimates"],
        &rows,
    )
}

/// Two significant digits, with powers of ten and a true minus sign.
fn short(x: f64) -> String {
    let text = significant(x, 2);
    let text = match text.split_once('e') {
        Some((mantissa, exponent)) => {
            format!("{mantissa}×{}", decade(exponent.parse().unwrap_or(0)))
        }
        None => text,
    };
    text.replace('-', "−")
}
