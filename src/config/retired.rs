//! Keys and choices of a model file that were removed, and what takes their place.

const WEIGHT: &str = "functions.penalty.weight";
const OTHER_RULES: &str = "`reml` chooses the weight by the likelihood of noise and smoothness, also with `sigma: {…: estimate}`; the fit \
     page of `discrepancy` shows what L-curve and cross-validation would choose";

const TIKHONOV: &str = "`penalty: {kind: tikhonov, order: …, weight: …}`";
const COMPARE: &str =
    "`kmcfit compare A.yaml B.yaml …` fits models in order and compares them on one page";

/// Path of the key, the choice where one of its values was removed, and what takes its place.
const RETIRED: [(&str, &str, &str); 16] = [
    ("sequence", "", COMPARE),
    ("story", "", COMPARE),
    ("experiments.hold_out", "", "`validation`"),
    ("functions.offset", "", "`static_force`"),
    ("functions.smooth", "", TIKHONOV),
    (
        "functions.variation",
        "",
        "`penalty: {kind: tv, weight: …}`",
    ),
    ("study.tubes", "", "`study.extremes`"),
    ("study.level", "", "`study.misfit_limit`"),
    ("study.same", "", "`study.merge_tolerance`"),
    ("study.equivalents", "", "`study.equivalent_systems`"),
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
        .filter(|part| !part.is_empty())
        .collect();
    // All functions have the same keys, also those of an experiment.
    if keys.starts_with(&["experiments", "functions"]) {
        keys.remove(0);
    }
    if keys.first() == Some(&"functions") && keys.len() > 2 {
        keys.remove(1);
    }
    let path = keys.join(".");
    let found = RETIRED
        .iter()
        .find(|(key, of, _)| *key == path && *of == choice);
    found.map(|(.., successor)| *successor)
}

/// What takes the place of a removed key or choice with this name.
pub(super) fn successor_of_name(name: &str) -> Option<&'static str> {
    let is_meant = |key: &str| key == name || key.ends_with(&format!(".{name}"));
    let found = RETIRED
        .iter()
        .find(|(key, choice, _)| *choice == name || choice.is_empty() && is_meant(key));
    found.map(|(.., successor)| *successor)
}
