//! Keys and choices of a model file that were removed, and what takes their place.

const WEIGHT: &str = "functions.penalty.weight";
const OTHER_RULES: &str = "`reml` chooses the weight by the likelihood of noise and smoothness, also with `sigma: {…: estimate}`; the fit \
     page of `discrepancy` shows what L-curve and cross-validation would choose";

/// Path of the key, the choice where one of its values was removed, and what takes its place.
const RETIRED: [(&str, &str, &str); 6] = [
    (
        "study.bootstrap",
        "",
        "`study.profiles` gives intervals without resampling",
    ),
    (
        "study.noise",
        "",
        "it belonged to `bootstrap`; `study.profiles` gives intervals without resampling",
    ),
    (
        "study.constancy_test",
        "",
        "the fit tests each function that varies against a constant; `kmcfit compare` compares a model with a constant",
    ),
    (
        "functions.width",
        "auto",
        "a fit warns where the estimates depend on the width, and names a smaller one",
    ),
    (WEIGHT, "l-curve", OTHER_RULES),
    (WEIGHT, "gcv", OTHER_RULES),
];

/// What takes the place of a removed key, or of a removed choice of a key.
pub(super) fn successor(path: &str, choice: &str) -> Option<&'static str> {
    let mut keys: Vec<&str> = path
        .split('.')
        .filter_map(|part| part.split('[').next())
        .collect();
    // All functions have the same keys.
    if keys.first() == Some(&"functions") && keys.len() > 2 {
        keys.remove(1);
    }
    let path = keys.join(".");
    let found = RETIRED
        .iter()
        .find(|(key, of, _)| *key == path && *of == choice);
    found.map(|(.., successor)| *successor)
}
