//! Model selection: a line for each run, and the conclusion on the best one.

use super::Comparison;
use super::likelihood::LikelihoodRatio;
use super::measures::Measures;
use super::verdict::percent;
use crate::number_format::significant;
use crate::report::document::level_in_words;
use kmcfit_core::internals::assessment::Estimate;

/// Differences of BIC beyond which evidence is very strong, strong and positive (Kass and Raftery 1995).
const VERY_STRONG: f64 = 10.0;
const STRONG: f64 = 6.0;
const POSITIVE: f64 = 2.0;

/// Width of an interval, relative to the estimate, below which it is not printed: samples without noise.
const EXACT: f64 = 2e-7;

/// Headers of the table.
const HEADERS: [&str; 9] = [
    "model",
    "parameters",
    "log-likelihood",
    "AICc",
    "BIC - best",
    "fit",
    "validation fit",
    "f_n, Hz (95 % CI)",
    "zeta (95 % CI)",
];

/// Indices of the runs, the best first and those without a likelihood last.
fn ranked(measures: &[Measures]) -> Vec<usize> {
    let difference = |i: &usize| measures[*i].bic_difference.unwrap_or(f64::INFINITY);
    let mut runs: Vec<usize> = (0..measures.len()).collect();
    runs.sort_by(|a, b| difference(a).total_cmp(&difference(b)));
    runs
}

/// The table with a line for each run, the best first; empty where fewer than two runs have a likelihood of the same samples.
pub(super) fn table(measures: &[Measures]) -> String {
    let runs = ranked(measures).into_iter().map(|i| &measures[i]);
    let runs: Vec<&Measures> = runs.filter(|m| m.bic_difference.is_some()).collect();
    if runs.len() < 2 {
        return String::new();
    }
    let mut rows = vec![HEADERS.map(String::from)];
    rows.extend(runs.into_iter().map(row));
    let width = |j: usize| {
        rows.iter()
            .map(|row| row[j].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..HEADERS.len()).map(width).collect();
    let line = |row: &[String; 9]| {
        let cells = row
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell:<width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

fn row(m: &Measures) -> [String; 9] {
    let unknown = || "–".to_owned();
    let fixed = |x: f64| format!("{x:.1}");
    let percent = |x: Option<f64>| x.map_or_else(unknown, |x| format!("{x:.1} %"));
    let likelihood = m.likelihood;
    let parameters = likelihood.map_or(m.parameters as f64, |l| l.parameters);
    [
        m.name.clone(),
        significant(parameters, 4),
        likelihood.map_or_else(unknown, |l| fixed(l.log_likelihood)),
        likelihood.map_or_else(unknown, |l| fixed(l.aicc)),
        m.bic_difference.map_or_else(unknown, |d| match d == 0.0 {
            true => "0".to_owned(),
            false => format!("+{}", fixed(d)),
        }),
        percent(m.worst_fit),
        percent(m.validation_fit),
        interval(m.natural_frequency.as_ref()),
        interval(m.damping_ratio.as_ref()),
    ]
}

/// An estimate with its interval, to the digits of the interval.
fn interval(estimate: Option<&Estimate>) -> String {
    let Some(estimate) = estimate.filter(|e| e.value.is_finite()) else {
        return "–".into();
    };
    match estimate.ci95 {
        None => significant(estimate.value, 4),
        Some([low, high]) if (high - low).abs() <= EXACT * estimate.value.abs() => {
            significant(estimate.value, 7)
        }
        Some([low, high]) => {
            let width = (high - low).abs();
            let digits = (estimate.value.abs() / width)
                .log10()
                .ceil()
                .clamp(0.0, 9.0) as usize
                + 2;
            let [value, low, high] = [estimate.value, low, high].map(|x| significant(x, digits));
            format!("{value} ({low} to {high})")
        }
    }
}

/// Headings of the page that the table of the terminal lacks.
const VERDICT: &str = "verdict";
const ERRORS: [&str; 3] = ["error of k/m", "error of c/m", "error of m"];

/// Relative error below which the table says so.
const LEAST_ERROR: f64 = 1e-4;

/// The table of models on the page.
pub(super) struct ModelTable {
    /// Headings of the columns.
    pub headings: Vec<&'static str>,
    /// Index of the run of each row.
    pub runs: Vec<usize>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

/// The table of models: the best first where they are ranked, else in the given order; columns without a value are omitted.
pub(super) fn model_table(measures: &[Measures], keeps_order: bool) -> ModelTable {
    let runs = match keeps_order {
        true => (0..measures.len()).collect(),
        false => ranked(measures),
    };
    let [name, others @ ..] = HEADERS;
    let headings: Vec<&str> = [name, VERDICT]
        .into_iter()
        .chain(others)
        .chain(ERRORS)
        .collect();
    let all: Vec<Vec<String>> = runs.iter().map(|i| page_row(&measures[*i])).collect();
    let is_known = |j: &usize| *j == 0 || all.iter().any(|row| row[*j] != "–");
    let kept: Vec<usize> = (0..headings.len()).filter(is_known).collect();
    ModelTable {
        headings: kept.iter().map(|j| headings[*j]).collect(),
        rows: all
            .iter()
            .map(|row| kept.iter().map(|j| row[*j].clone()).collect())
            .collect(),
        runs,
    }
}

/// A row of the table of models with all its columns.
fn page_row(m: &Measures) -> Vec<String> {
    let level = m.level.map_or("–", level_in_words).to_owned();
    let errors = m.errors.as_ref().map_or([f64::NAN; 3], |e| {
        [e.k_over_m_relative, e.c_over_m_relative, e.mass_relative]
    });
    let errors = errors.map(|error| match error.is_nan() {
        true => "–".to_owned(),
        false if error < LEAST_ERROR => "< 0.01 %".to_owned(),
        false => percent(error),
    });
    let [name, others @ ..] = row(m);
    let others = others.map(|cell| cell.replace('-', "−"));
    [name, level]
        .into_iter()
        .chain(others)
        .chain(errors)
        .collect()
}

/// Sentences on the best model and on nested ones.
pub(super) fn sentences(comparison: &Comparison) -> Vec<String> {
    let tests = comparison.likelihood_ratios.iter().map(ratio);
    best(comparison)
        .into_iter()
        .map(|best| best.sentence)
        .chain(tests)
        .collect()
}

/// The best model.
pub(super) struct BestModel<'a> {
    /// Its name.
    pub name: &'a str,
    /// True if the data favour it.
    pub is_favoured: bool,
    /// The difference to the next in words.
    pub sentence: String,
}

/// The model with the smallest BIC; `None` where fewer than two are ranked.
pub(super) fn best(comparison: &Comparison) -> Option<BestModel<'_>> {
    let mut known: Vec<(&str, f64)> = (comparison.measures.iter())
        .filter_map(|m| Some((m.name.as_str(), m.bic_difference?)))
        .collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [(best, _), (second, difference), ..] = known.as_slice() else {
        return None;
    };
    let size = significant(*difference, 2);
    let sentence = match *difference {
        d if d >= POSITIVE => format!(
            "The data favour `{best}` over `{second}` {} (difference of BIC {size}).",
            match d {
                d if d >= VERY_STRONG => "decisively",
                d if d >= STRONG => "strongly",
                _ => "weakly",
            }
        ),
        _ => format!(
            "The data do not distinguish `{best}` and `{second}` (difference of BIC {size})."
        ),
    };
    Some(BestModel {
        name: best,
        is_favoured: *difference >= POSITIVE,
        sentence,
    })
}

fn ratio(test: &LikelihoodRatio) -> String {
    let LikelihoodRatio {
        restricted,
        general,
        statistic,
        degrees_of_freedom,
        p_value,
    } = test;
    let p = match *p_value < 1e-4 {
        true => "p < 0.0001".to_owned(),
        false => format!("p = {}", significant(*p_value, 2)),
    };
    let verb = match *p_value < 0.05 {
        true => "rejects",
        false => "does not reject",
    };
    format!(
        "Likelihood-ratio test {verb} `{restricted}` within `{general}` ({p}, statistic {}, {} degrees of freedom).",
        significant(*statistic, 3),
        significant(*degrees_of_freedom, 3)
    )
}
