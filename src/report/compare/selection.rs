//! Model selection: a line for each run, and the conclusion on the best one.

use super::Comparison;
use super::likelihood::LikelihoodRatio;
use super::measures::Measures;
use crate::number_format::significant;
use kmcfit_core::internals::assessment::Estimate;

/// Differences of BIC beyond which evidence is very strong, strong and positive (Kass and Raftery 1995).
const VERY_STRONG: f64 = 10.0;
const STRONG: f64 = 6.0;
const POSITIVE: f64 = 2.0;

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

/// The table with a line for each run, the best first; empty where fewer than two runs have a likelihood of the same samples.
pub(super) fn table(measures: &[Measures]) -> String {
    let mut runs: Vec<&Measures> = measures
        .iter()
        .filter(|m| m.bic_difference.is_some())
        .collect();
    if runs.len() < 2 {
        return String::new();
    }
    let difference = |m: &Measures| m.bic_difference.unwrap_or(f64::INFINITY);
    runs.sort_by(|a, b| difference(a).total_cmp(&difference(b)));
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

/// Sentences on the best model and on nested ones.
pub(super) fn sentences(comparison: &Comparison) -> Vec<String> {
    let mut sentences = Vec::new();
    let mut known: Vec<(&str, f64)> = (comparison.measures.iter())
        .filter_map(|m| Some((m.name.as_str(), m.bic_difference?)))
        .collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    if let [(best, _), (second, difference), ..] = known.as_slice() {
        let size = significant(*difference, 2);
        sentences.push(match *difference {
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
        });
    }
    sentences.extend(comparison.likelihood_ratios.iter().map(ratio));
    sentences
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
