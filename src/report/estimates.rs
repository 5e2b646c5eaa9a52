//! Estimates of the coefficient functions in the summary of a fit.

use super::document::ResultDocument;
use crate::number_format::{resolved, significant};
use kmcfit_core::internals::assessment::FunctionSummary;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::identifiability::ClassificationKind;

/// Ratio of the largest to the smallest value above which the largest alone is stated.
const MANY_TIMES: f64 = 1e4;
/// Fewest and most significant digits of the ends of a range.
const DIGITS: std::ops::RangeInclusive<usize> = 4..=6;

/// Estimates of the coefficient functions: `k = 4075 N/m (95 % CI 4061 to 4089)`, or the range over the record.
pub(super) fn estimates(document: &ResultDocument) -> Vec<String> {
    document.terms().map(estimate).collect()
}

fn estimate((name, f): (&str, &FunctionSummary)) -> String {
    let symbol = symbol(name);
    let unit = &f.unit;
    let note = match (f.fixed, f.at_bound) {
        (true, _) => " (fixed)",
        (false, true) => " (at its bound)",
        (false, false) => "",
    };
    if f.negligible {
        return format!("{symbol} = 0 {unit}{note}");
    }
    if f.verdict == Some(ClassificationKind::NotIdentified) {
        return format!("{symbol}: not identifiable");
    }
    if let (Some(half), true) = (f.half_width(), f.min == f.max) {
        let [value, low, high] = resolved([f.min, f.min - half, f.min + half], half);
        return format!("{symbol} = {value} {unit} (95 % CI {low} to {high}){note}");
    }
    let (range, span) = match f.identified_range {
        Some(range) if f.verdict == Some(ClassificationKind::PartlyIdentified) => {
            (range, " where it is identified")
        }
        _ => ([f.min, f.max], " over the record"),
    };
    let ends = |digits| range.map(|x| significant(x, digits));
    match DIGITS.map(ends).find(|[low, high]| low != high) {
        None => format!("{symbol} = {} {unit}{note}", significant(range[0], 4)),
        // A coefficient at or near a lower limit of zero.
        Some([_, high]) if range[0] >= 0.0 && range[1] > MANY_TIMES * range[0] => {
            format!("{symbol} <= {high} {unit}{span}{note}")
        }
        Some([low, high]) => format!("{symbol} = {low} to {high} {unit}{span}{note}"),
    }
}

/// Symbol of a coefficient function in the equation of motion; the name of any other.
fn symbol(name: &str) -> &str {
    let kind = CoefficientKind::ALL.into_iter().find(|k| k.name() == name);
    kind.map_or(name, |kind| kind.symbol())
}
