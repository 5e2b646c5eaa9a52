//! Rules for the weight of a penalty in words.

/// Name of a rule for the weight of a penalty in a sentence.
pub(super) fn rule_in_words(rule: &str) -> &str {
    match rule {
        "discrepancy" => "the discrepancy principle",
        "bic" => "the Bayesian information criterion",
        _ => rule,
    }
}
