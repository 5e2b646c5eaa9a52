//! Terms of the first screen, each in one line, folded.

use super::table::pairs;
use crate::report::document::ResultDocument;
use kmcfit_core::internals::assessment::EstimateStatus;

/// The terms that the page uses.
pub(super) fn glossary(document: &ResultDocument) -> String {
    let mut terms = vec![
        ("Adequate", "every check passed"),
        ("Check", "usable after the stated reasons have been judged"),
        (
            "Inadequate",
            "the model does not explain the record: do not use the estimates",
        ),
        (
            "undamped natural frequency",
            "sqrt(k/m) / (2 pi); the damped one is smaller by the factor sqrt(1 - damping ratio^2)",
        ),
        ("damping ratio", "c / (2 sqrt(k m))"),
        (
            "95 % CI",
            "confidence interval: of repeated measurements 95 % give one that contains the true value, if model and noise model hold",
        ),
        (
            "estimated",
            "fitted to the samples; fixed: a value of the model file",
        ),
        (
            "identified",
            "the samples determine it: half-width of the 95 % CI at most 25 % of its size",
        ),
        (
            "fit",
            "100 % (1 - |residuals| / |samples - mean|): 100 % is perfect, 0 % as good as the mean",
        ),
        (
            "sigma",
            "standard deviation of the noise of a sample; rms residual: that of measured minus model",
        ),
    ];
    let is_scaled = (document.estimates.0.iter())
        .any(|(_, estimate)| estimate.status == EstimateStatus::OnlyAsRatio);
    if is_scaled {
        terms.push((
            "scales with",
            "only its ratio to the fixed coefficient is measured: a wrong fixed value changes it by the same factor",
        ));
    }
    let rows: Vec<(&str, String)> = (terms.into_iter())
        .map(|(term, text)| (term, text.to_owned()))
        .collect();
    format!(
        "<details>\n<summary>Terms of this page</summary>\n{}</details>\n",
        pairs(&rows)
    )
}
