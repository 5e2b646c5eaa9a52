//! Summary of a fleet in the terminal.

use super::collect::Collected;
use super::folder::FleetFolder;
use super::statistics::{Distribution, LinearTrend, Outlier, Statistics};
use super::trend::Trend;
use crate::number_format::significant;
use crate::report::{count, quantity};
use std::fmt::Write;

/// The summary for the terminal.
pub fn fleet_summary(folder: &FleetFolder, collected: &Collected, trend: &Trend) -> String {
    let statistics = &collected.statistics;
    let mut text = format!("{}\n\n", counts(statistics));
    let shown = shown(statistics);
    if !shown.is_empty() {
        let mut rows = vec![headings(trend)];
        rows.extend(shown.iter().map(|d| cells(d)));
        let width = |i: usize| rows.iter().map(|row| row[i].chars().count()).max();
        let widths: Vec<usize> = (0..COLUMNS).map(|i| width(i).unwrap_or(0)).collect();
        for row in &rows {
            let cells = row.iter().zip(&widths);
            let cells = cells.map(|(cell, width)| format!("{cell:<width$}"));
            let line = cells.collect::<Vec<_>>().join("  ");
            let _ = writeln!(text, "{}", line.trim_end());
        }
        text.push('\n');
    }
    if let Some(used) = incomplete_axis(statistics, trend) {
        let _ = writeln!(text, "{used}\n");
    }
    for outlier in statistics.outliers.iter().take(MOST_LISTED) {
        let _ = writeln!(text, "outlier {}", outlier_in_words(outlier, statistics));
    }
    let _ = write!(text, "{}", further(statistics.outliers.len(), "outlier"));
    for (record, error) in collected.errors.iter().take(MOST_LISTED) {
        let _ = writeln!(text, "error   {record}: {}", first_line(error));
    }
    let _ = write!(text, "{}", further(statistics.errors, "error  "));
    let _ = writeln!(text, "results in {}", folder.path.display());
    text
}

/// Most outliers, and most errors, in the terminal.
const MOST_LISTED: usize = 5;

/// A line on the entries of a list that are left out.
fn further(count: usize, what: &str) -> String {
    match count.saturating_sub(MOST_LISTED) {
        0 => String::new(),
        more => format!("{what} and {more} more: fleet.html\n"),
    }
}

/// A sentence where records have no place on the axis.
pub(super) fn incomplete_axis(statistics: &Statistics, trend: &Trend) -> Option<String> {
    let placed = trend.values.iter().filter(|x| x.is_finite()).count();
    let all = statistics.records;
    (placed < all).then(|| {
        format!(
            "{} of {all} records have a {}; the others are compared with the median of all",
            placed, trend.name
        )
    })
}

/// Columns of the table of estimates.
const COLUMNS: usize = 6;

/// Headings of the table of estimates.
pub(super) fn headings(trend: &Trend) -> [String; COLUMNS] {
    let change = format!("change per {} (95 % CI)", trend.step());
    [
        "estimate",
        "median",
        "95 % of records",
        &change,
        "unit",
        "outliers",
    ]
    .map(String::from)
}

/// The row of an estimate in it.
pub(super) fn cells(distribution: &Distribution) -> [String; COLUMNS] {
    let d = distribution;
    [
        quantity(&d.name),
        significant(d.median, 5),
        between(d.central95),
        d.trend.map_or("—".to_owned(), |trend| change(&trend)),
        d.unit.clone(),
        d.outliers.to_string(),
    ]
}

/// The slope with its 95 % confidence interval.
fn change(trend: &LinearTrend) -> String {
    let [low, high] = trend.slope95.map(|limit| significant(limit, 3));
    format!("{} ({low} to {high})", significant(trend.slope, 3))
}

fn outlier_in_words(outlier: &Outlier, statistics: &Statistics) -> String {
    let distribution = statistics
        .distributions
        .iter()
        .find(|d| d.name == outlier.estimate);
    let unit = distribution.map_or("", |d| d.unit.as_str());
    let value = format!("{} {unit}", significant(outlier.value, 5));
    let reference = match distribution.is_some_and(|d| d.trend.is_some()) {
        true => "trend",
        false => "median",
    };
    format!(
        "{}: {} {}, {} standard deviations from the {reference}",
        outlier.record,
        quantity(&outlier.estimate),
        value.trim_end(),
        significant(outlier.score, 3)
    )
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// Estimates that differ between records.
pub(super) fn shown(statistics: &Statistics) -> Vec<&Distribution> {
    statistics
        .distributions
        .iter()
        .filter(|d| !d.is_constant())
        .collect()
}

fn between([low, high]: [f64; 2]) -> String {
    format!("{} to {}", significant(low, 5), significant(high, 5))
}

/// Numbers of records, verdicts, errors and missing rows.
pub(super) fn counts(statistics: &Statistics) -> String {
    let [adequate, check, inadequate] = statistics.verdicts;
    let mut parts = vec![
        count(statistics.records, "record"),
        format!("{adequate} Adequate"),
        format!("{check} Check"),
        format!("{inadequate} Inadequate"),
        count(statistics.errors, "error"),
    ];
    if statistics.time_limits > 0 {
        parts.push(format!(
            "of these {} by the time limit",
            statistics.time_limits
        ));
    }
    if statistics.missing > 0 {
        parts.push(format!("{} without a row yet", statistics.missing));
    }
    parts.join(", ")
}
