//! Notes that hold for all confidence bands of a fit: the contributions they neglect, and the active bounds.

use super::active::ActiveRow;
use super::covariance::{Information, is_bayesian};
use crate::problem::Problem;
use crate::record::ScoreCovariance;

/// The notes, in the order in which they are shown.
pub(super) fn notes(
    problem: &Problem,
    information: &Information,
    active: &[ActiveRow],
) -> Vec<String> {
    let mut notes = Vec::new();
    if information.sensitivity().directions.is_coarse() {
        notes.push(
            "the model has many parameters: the bands are those of smooth changes and neglect rougher ones"
                .to_owned(),
        );
    }
    if information.is_pulled() {
        notes.push(
            "the bands describe the scatter of the estimates and exclude the smoothing bias"
                .to_owned(),
        );
    }
    if is_bayesian(problem) {
        notes.push(
            "the bands of smoothed functions cover on average over the record, less where a function bends most".to_owned(),
        );
    }
    if problem
        .channels()
        .any(|c| c.noise().scores == ScoreCovariance::Kernel)
    {
        notes.push(
            "the residuals are not white under the noise model: the bands come from a covariance that is consistent under \
             heteroscedasticity and autocorrelation"
                .to_owned(),
        );
    }
    if !problem.variations.is_empty() {
        notes.push("the bands neglect the total-variation penalty".to_owned());
    }
    let bounds = active.iter().filter(|r| !r.equality);
    let mut names: Vec<&str> = bounds.map(|r| r.name.as_str()).collect();
    names.dedup();
    if !names.is_empty() {
        notes.push(format!("bounds are active: {}", names.join(", ")));
    }
    notes
}
