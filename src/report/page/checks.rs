//! Section of the checks of step, basis and terms: what was tried, and what each gave.

use super::table::{paragraph, table};
use crate::number_format::{at_most, significant};
use crate::report::answer::in_words;
use crate::report::document::ResultDocument;
use crate::report::text::decade;
use kmcfit_core::assessment::{
    BasisComparison, ClassicalEstimate, EXACT, Extension, ExtensionTest, ModelTests,
};

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
    if let Some(tests) = &document.model_tests {
        text += &bases(tests);
        text += &extensions(document, tests);
    }
    let classical = document.classical.as_ref().map(ClassicalEstimate::sentence);
    text + &classical.map_or(String::new(), |classical| {
        paragraph(&format!("Classical estimate: {classical}."))
    })
}

/// Each basis beside a finer one.
fn bases(tests: &ModelTests) -> String {
    if tests.bases.is_empty() {
        return String::new();
    }
    let row = |b: &BasisComparison| {
        let finer = match b.parameters {
            1 => "a value for each half of the record".to_owned(),
            _ => format!("{} parameters instead of {}", b.finer, b.parameters),
        };
        vec![in_words(&b.function), finer, probability(b.p_value)]
    };
    let rows: Vec<Vec<String>> = tests.bases.iter().map(row).collect();
    let limit = significant(tests.p_limit, 2);
    paragraph(&format!(
        "Refinement: does a finer basis of a coefficient fit better than noise explains? Significant below p = {limit}."
    )) + &table("Refinement", &["coefficient", "tried", "p-value"], &rows)
}

/// Each further term and error of a record with its estimate.
fn extensions(document: &ResultDocument, tests: &ModelTests) -> String {
    if tests.extensions.is_empty() {
        return String::new();
    }
    let row = |test: &ExtensionTest| {
        let (name, estimate) = extension(document, test);
        vec![name, estimate, short(test.t)]
    };
    let rows: Vec<Vec<String>> = tests.extensions.iter().map(row).collect();
    let limit = significant(tests.t_limit, 2);
    paragraph(&format!(
        "Missing terms and errors of the records, each added alone: estimate, and t = estimate / standard error, with \
         cubic splines for lines between the samples of an input where these make it smaller. A candidate with |t| of {limit} \
         or more is fitted; it counts as missing if this fit explains the residuals."
    )) + &table(
        "Missing terms and errors of the records",
        &["tried", "estimate", "t"],
        &rows,
    )
}

/// Name and estimate of an extension.
fn extension(document: &ResultDocument, test: &ExtensionTest) -> (String, String) {
    let of = |what: &str, experiment: &str| match document.experiments.len() {
        1 => what.to_owned(),
        _ => format!("{what} of {experiment}"),
    };
    let value = |x: f64, unit: &str| format!("{} {unit}", short(x));
    match &test.extension {
        Extension::Term { term } => {
            let unit = match document.is_rotation() {
                true => term.angular_unit(),
                false => term.unit(),
            };
            (in_words(term.name()), value(test.value, unit))
        }
        Extension::Delay { experiment } => (
            of("delay of the response", experiment),
            value(test.value, "s"),
        ),
        Extension::ClockRate { experiment } => (
            of("rate of the clock of the response", experiment),
            value(100.0 * test.value, "%"),
        ),
        Extension::Gain {
            experiment,
            channel,
        } => (
            of(&format!("gain of the {channel}"), experiment),
            value(100.0 * test.value, "%"),
        ),
    }
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

fn probability(p: f64) -> String {
    match p < 1e-6 {
        true => "below 0.000001".to_owned(),
        false => at_most(p, 2),
    }
}
