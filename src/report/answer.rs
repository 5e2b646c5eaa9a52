//! The answer of a fit as a table: estimates with their confidence intervals, units and status.

use super::document::ResultDocument;
use super::ratios;
use super::text::aligned_to;
use kmcfit_core::assessment::{Doubt, Estimate, EstimateStatus};
use kmcfit_core::identifiability::ClassificationKind;
use kmcfit_core::number_format::{resolved, significant};
use kmcfit_core::structure::CoefficientKind;
use std::fmt;

/// Half-width of an interval, relative to the estimate, below which it is not printed: samples without noise.
const EXACT: f64 = 1e-7;

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct AnswerRow {
    /// Name in `estimates` of the result document.
    pub key: String,
    /// Measurand in words, with its symbol.
    pub quantity: String,
    /// Mean over the record.
    pub estimate: String,
    /// 95 % confidence interval of the mean; empty without one, and where its half-width is below 1e-7 of the estimate.
    pub interval: String,
    /// Unit; empty if dimensionless.
    pub unit: String,
    /// Range over the record of a quantity that varies, or where it is identified; empty for others.
    pub range: String,
    /// How it was obtained.
    pub status: String,
}

impl AnswerRow {
    /// How it was obtained, and the range over the record.
    pub fn status_and_range(&self) -> String {
        match (self.range.as_str(), self.estimate.as_str()) {
            ("", _) => self.status.clone(),
            (range, "") => format!("{} ({range})", self.status),
            (range, _) => format!("{} (mean; {range} over the record)", self.status),
        }
    }
}

impl fmt::Display for AnswerRow {
    /// One line: quantity, estimate with unit and interval, status.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = format!("{} {}", self.estimate, self.unit);
        write!(f, "{}: {}", self.quantity, value.trim())?;
        if !self.interval.is_empty() {
            write!(f, " (95 % CI {})", self.interval)?;
        }
        write!(f, ", {}", self.status_and_range())
    }
}

/// The rows of the answer: natural frequency and damping ratio, then the coefficients; with ratios only the ratios to the mass before what the
/// model assumes.
pub fn answer(document: &ResultDocument) -> Vec<AnswerRow> {
    let is_scaled = document.model.mass_unknown
        || (document.estimates.0.iter())
            .any(|(_, estimate)| estimate.status == EstimateStatus::OnlyAsRatio);
    let is_shown = |name: &str| is_scaled || !matches!(name, "k_over_m" | "c_over_m");
    let rows = document.estimates.0.iter();
    let rows = rows.filter(|(name, _)| is_shown(name));
    rows.map(|(name, estimate)| row(document, name, estimate))
        .collect()
}

fn row(document: &ResultDocument, name: &str, estimate: &Estimate) -> AnswerRow {
    let function = document.functions.get(&ratios::function_of(name));
    let is_open = function.is_some_and(|f| f.verdict == Some(ClassificationKind::NotIdentified));
    let [mut value, mut interval] = numbers(estimate);
    let mut status = status(document, estimate);
    // Known parts of single experiments are not in the shared functions.
    let has_own_parts = (document.functions.keys())
        .any(|name| name.starts_with("known part of ") && name.matches(" of ").count() > 1);
    if has_own_parts && function.is_none() {
        status += ", without the known parts of experiments";
    }
    let mut range = estimate.range.and_then(range_in_words).unwrap_or_default();
    if is_negligible(document, name) {
        value = "0".to_owned();
        interval.clear();
        range.clear();
    } else if value == "0" {
        // Less than the interval resolves.
        range.clear();
    } else if function.is_some_and(|f| f.at_bound) {
        status += ", at its bound";
    }
    let is_partly = function.filter(|f| f.verdict == Some(ClassificationKind::PartlyIdentified));
    if let Some(identified) = is_partly.and_then(|f| f.identified_range) {
        let ends = range_in_words(identified);
        let ends = ends.unwrap_or_else(|| significant(identified[0], 4));
        range = format!("{ends} where it is identified");
        value.clear();
        interval.clear();
    }
    if is_open {
        "not identifiable".clone_into(&mut status);
        value.clear();
        interval.clear();
        range.clear();
    }
    AnswerRow {
        key: name.to_owned(),
        quantity: quantity(name),
        estimate: value,
        interval,
        range,
        unit: estimate.unit.clone(),
        status,
    }
}

/// Estimate and interval with the digits that the interval resolves; four digits without one.
fn numbers(estimate: &Estimate) -> [String; 2] {
    match estimate.ci95 {
        _ if !estimate.value.is_finite() => [String::new(), String::new()],
        Some([low, high]) if 0.5 * (high - low) > EXACT * estimate.value.abs() => {
            let numbers = resolved([estimate.value, low, high], 0.5 * (high - low));
            let [value, low, high] = numbers;
            [value, format!("{low} to {high}")]
        }
        Some(_) => [significant(estimate.value, 7), String::new()],
        None => [significant(estimate.value, 4), String::new()],
    }
}

/// A range with at least three digits, as many as distinguish its ends; `None` for ends that are equal to six digits.
fn range_in_words([low, high]: [f64; 2]) -> Option<String> {
    let ends = |digits| [low, high].map(|x| significant(x, digits));
    let [low, high] = (3..=6).map(ends).find(|[low, high]| low != high)?;
    Some(format!("{low} to {high}"))
}

/// True for a function that is zero to machine precision, and for its ratios.
fn is_negligible(document: &ResultDocument, name: &str) -> bool {
    let function = match name {
        "damping_ratio" | "c_over_m" => "damping",
        "natural_frequency" | "k_over_m" => "stiffness",
        name => &ratios::function_of(name),
    };
    (document.functions.get(function)).is_some_and(|function| function.negligible)
}

fn status(document: &ResultDocument, estimate: &Estimate) -> String {
    match estimate.status {
        EstimateStatus::NotIdentifiable => "not identifiable by this method".to_owned(),
        EstimateStatus::Estimated if !estimate.value.is_finite() => "not defined".to_owned(),
        _ if is_not_unique(document, estimate) => "not unique".to_owned(),
        EstimateStatus::Estimated => "estimated".to_owned(),
        EstimateStatus::Fixed => match fixed_name(document).is_some() {
            true => "fixed; the others scale with it".to_owned(),
            false => "fixed".to_owned(),
        },
        EstimateStatus::OnlyAsRatio => match fixed_name(document) {
            Some(name) => format!("scales with the fixed {name}"),
            None => "only as ratio; the model sets the scale".to_owned(),
        },
    }
}

/// True for an estimate without an interval where more parameters are estimated than the samples determine and no penalty determines the
/// others: other values explain the samples equally well.
fn is_not_unique(document: &ResultDocument, estimate: &Estimate) -> bool {
    let is_deficient = |doubt: &Doubt| matches!(doubt, Doubt::RankDeficient { .. });
    let is_estimated = estimate.status != EstimateStatus::Fixed && estimate.ci95.is_none();
    is_estimated && document.cost.regularisation == 0.0 && document.doubts().any(is_deficient)
}

/// Name of the fixed function that determines the scale of all others.
fn fixed_name(document: &ResultDocument) -> Option<&str> {
    let estimates = || document.estimates.0.iter();
    let scaled = estimates().any(|(_, e)| e.status == EstimateStatus::OnlyAsRatio);
    let is_fixed = |(name, e): &&(String, Estimate)| {
        e.status == EstimateStatus::Fixed && e.value != 0.0 && document.functions.contains_key(name)
    };
    let mut fixed = estimates().filter(is_fixed);
    let first = fixed.next().filter(|_| scaled);
    match fixed.next() {
        None => first.map(|(name, _)| name.as_str()),
        Some(_) => None,
    }
}

/// A quantity in words: `stiffness k`, `damping c of first`.
pub fn quantity(name: &str) -> String {
    let ratio = match name {
        "natural_frequency" => "undamped natural frequency",
        "damping_ratio" => "damping ratio",
        "k_over_m" => "stiffness / mass",
        "c_over_m" => "damping / mass",
        _ => "",
    };
    if !ratio.is_empty() {
        return ratio.to_owned();
    }
    let coefficient = ratios::function_of(name);
    if coefficient != name {
        return format!("{} / mass", coefficient.replace('_', " "));
    }
    let (first, owner) = match name.split_once(" of ") {
        Some((first, owner)) if first != "known part" => (first, format!(" of {owner}")),
        _ => (name, String::new()),
    };
    match CoefficientKind::named(first) {
        Some(kind) => format!("{} {}{owner}", in_words(first), kind.symbol()),
        None => name.replace('_', " "),
    }
}

/// Name of a coefficient in words: `cubic stiffness`, `Coulomb friction`.
pub fn in_words(name: &str) -> String {
    name.replace('_', " ").replace("coulomb", "Coulomb")
}

/// The table as text.
pub fn answer_table(document: &ResultDocument) -> String {
    let rows = answer(document);
    let headings = ["", "estimate", "95 % CI", "unit", "status"].map(str::to_owned);
    let cells = rows.into_iter().map(|row| {
        let status = row.status_and_range();
        vec![row.quantity, row.estimate, row.interval, row.unit, status]
    });
    let rows: Vec<Vec<String>> = [headings.to_vec()].into_iter().chain(cells).collect();
    aligned_to(&rows, |column| column == 1)
}
