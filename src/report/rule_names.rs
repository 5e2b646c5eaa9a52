//! Rules for the weight of a penalty in words.

use kmcfit_core::internals::functions::WeightRule;

/// Name of a rule for the weight of a penalty in a sentence.
pub(super) fn rule_in_words(rule: &str) -> &str {
    let mut rules = WeightRule::OF_PATHS.into_iter().chain([WeightRule::Bic]);
    match rules.find(|r| r.name() == rule) {
        Some(WeightRule::Discrepancy) => "the discrepancy principle",
        Some(WeightRule::LCurve) => "the L-curve",
        Some(WeightRule::Gcv) => "generalised cross-validation",
        Some(WeightRule::Bic) => "the Bayesian information criterion",
        _ => rule,
    }
}
