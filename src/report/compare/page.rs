//! The comparison as a page.

use super::conclusions::{conclusions, on_the_truth};
use super::figures::{self, style};
use super::measures::Measures;
use super::selection;
use super::table::{Cell, known_rows};
use super::verdict::Agreement;
use super::{CLOSE, Comparison, MATCHED};
use crate::config::DataFile;
use crate::report::chart::{Detail, Figure, Style, sample};
use crate::report::extent::extent;
use crate::report::page as shell;
use crate::report::text::{escape, prose};
use kmcfit_core::internals::assessment::RECOVERY_TOLERANCE;
use std::path::Path;

pub(super) fn page(comparison: &Comparison) -> String {
    shell::within_limit(|detail| page_of(comparison, detail))
}

fn page_of(comparison: &Comparison, detail: Detail) -> String {
    let count = comparison.measures.len() + comparison.left_out.len();
    let title = match (&comparison.sequence, count) {
        (Some(title), _) => title.clone(),
        (None, 1) => "One run".to_string(),
        (None, count) => format!("Comparison of {count} runs"),
    };
    let conclusions = match comparison.sequence {
        // The first screen has those on the true system.
        Some(_) => {
            let above = on_the_truth(&comparison.measures);
            let mut sentences = conclusions(&comparison.measures);
            sentences.retain(|sentence| !above.contains(sentence));
            shell::list(&sentences)
        }
        None => String::new(),
    };
    let drawn = |figures: &[Option<Figure>]| {
        let figures = figures.iter().flatten().cloned();
        shell::figures(&figures.collect::<Vec<_>>(), detail)
    };
    let curves = [figures::functions(comparison), figures::ratios(comparison)];
    let notes = format!(
        "<p class=\"soft\">{} Made by kmcfit {}.</p>\n",
        prose(&notes()),
        env!("CARGO_PKG_VERSION")
    );
    let sections: Vec<shell::Section> = vec![
        ("conclusions", "Conclusions", conclusions),
        ("functions", "Coefficients and ratios", drawn(&curves)),
        (
            "validation",
            "Predictions of validation records",
            drawn(&[figures::validation(comparison)]),
        ),
        (
            "residuals",
            "Residuals",
            drawn(&[figures::residuals(comparison)]),
        ),
        ("runs", "Summary of each run", runs(comparison)),
        (
            "quantities",
            "All quantities",
            all_quantities(&comparison.measures) + &notes,
        ),
        (
            "search",
            "Search",
            drawn(&[figures::convergence(comparison)]),
        ),
    ];
    shell::sectioned(&title, &first_screen(comparison, detail), sections)
}

/// Records, conclusion, table of models with its meaning in words, and main figure.
fn first_screen(comparison: &Comparison, detail: Detail) -> String {
    let is_sequence = comparison.sequence.is_some();
    let mut sentences = match is_sequence {
        true => on_the_truth(&comparison.measures),
        false => Vec::new(),
    };
    sentences.extend(selection::sentences(comparison));
    let above = records(comparison) + &state(comparison, &mut sentences);
    let models = selection::model_table(&comparison.measures, is_sequence);
    let symbols = models.runs.iter().map(|i| sample(&style(*i)));
    let table = shell::marked_table(
        "Models",
        &models.headings,
        &symbols.collect::<Vec<_>>(),
        &models.rows,
    );
    let text = shell::list(&sentences) + &left_out(comparison);
    shell::screen(&(above + &table), &text, figures::main(comparison), detail)
}

/// Data files of all runs, each once, with the date of the last change; number of samples and duration where the runs have common records.
fn records(comparison: &Comparison) -> String {
    let mut files: Vec<DataFile> = Vec::new();
    for file in comparison.runs.iter().flat_map(|run| &run.data) {
        let is_same = |other: &DataFile| {
            Path::new(&other.name).file_name() == Path::new(&file.name).file_name()
                && other.content == file.content
        };
        if !files.iter().any(is_same) {
            files.push(file.clone());
        }
    }
    let first = comparison.runs.first();
    let common = first.filter(|_| comparison.warning().is_none());
    let size = common.map(|run| extent(&run.finished.document));
    shell::source_line(&files, size)
}

/// The conclusion: the best model where models are ranked, else the agreement with the true system. The sentence of the best model moves from
/// `sentences` to it; the other follows them.
fn state(comparison: &Comparison, sentences: &mut Vec<String>) -> String {
    let is_sequence = comparison.sequence.is_some();
    let lead = lead(comparison);
    let best = selection::best(comparison).filter(|_| !is_sequence);
    match comparison.warning() {
        // The records of a sequence may differ on purpose.
        Some(warning) if is_sequence && lead.is_some() => {
            sentences.push(format!("{}.", capital(&warning)));
        }
        Some(warning) => {
            sentences.extend(lead);
            return shell::state_line("warn", "Not ranked", &warning);
        }
        None => {}
    }
    match (best, lead) {
        (Some(best), lead) => {
            sentences.retain(|sentence| *sentence != best.sentence);
            sentences.extend(lead);
            let (colour, word) = match best.is_favoured {
                true => ("good", format!("Best: {}", best.name)),
                false => ("warn", "No clear best".to_owned()),
            };
            shell::state_line(colour, &word, &best.sentence)
        }
        (None, Some(lead)) => {
            let (known, reached, _) = agreement(&comparison.measures);
            let (colour, word) = match reached {
                0 => ("bad", "Not recovered"),
                _ if reached == known => ("good", "Recovered"),
                _ => ("warn", "Recovered in part"),
            };
            shell::state_line(colour, word, &lead)
        }
        (None, None) => {
            let reason = "fewer than two runs have a likelihood of the same samples";
            shell::state_line("warn", "Not ranked", reason)
        }
    }
}

/// The summaries of the runs.
fn runs(comparison: &Comparison) -> String {
    let runs = comparison.measures.iter().enumerate();
    runs.map(|(i, run)| card(run, style(i))).collect()
}

/// The runs without a result.
fn left_out(comparison: &Comparison) -> String {
    let runs = comparison.left_out.iter();
    let runs = runs.map(|run| format!("{}: no result: {}", run.name, run.reason));
    shell::list(&runs.collect::<Vec<_>>())
}

/// Numbers of runs with a known true system, of those that recover it, and of those that are close to it.
fn agreement(runs: &[Measures]) -> (usize, usize, usize) {
    let known = runs
        .iter()
        .filter_map(|m| m.errors.as_ref().map(Agreement::of));
    let known: Vec<Agreement> = known.collect();
    let count = |which| known.iter().filter(|a| **a == which).count();
    (
        known.len(),
        count(Agreement::Recovered),
        count(Agreement::Close),
    )
}

/// The number of runs that recover the true system; `None` where it is not known for any.
fn lead(comparison: &Comparison) -> Option<String> {
    let (known, reached, close) = agreement(&comparison.measures);
    let lead = match (known, reached) {
        (0, _) => return None,
        (1, 0) => "The run with a known true system does not recover it".into(),
        (1, _) => "The run with a known true system recovers it".into(),
        (_, 0) => format!("None of the {known} runs with a known true system recovers it"),
        _ if known == reached => format!("All {known} runs with a known true system recover it"),
        _ => format!(
            "{reached} of the {known} runs with a known true system recover{} it",
            match reached {
                1 => "s",
                _ => "",
            }
        ),
    };
    Some(match close {
        0 => format!("{lead}."),
        1 => format!("{lead}; one is close to it in k/m and c/m."),
        _ => format!("{lead}; {close} are close to it in k/m and c/m."),
    })
}

fn notes() -> String {
    format!(
        "Errors are maxima over the nodes of each run's grid. The true system counts as recovered if the errors \
         of k/m and c/m are below {RECOVERY_TOLERANCE:e} of their largest true values (c/m: of critical damping \
         if the true system is undamped), as close if they are below {} %. A response without sigma counts as \
         fitted if the rms residual is at most {} % of the rms response. Without a force only k/m and c/m are \
         identifiable.",
        100.0 * CLOSE,
        100.0 * MATCHED
    )
}

fn card(run: &Measures, look: Style) -> String {
    let mut text = format!(
        "<div class=\"run\">\n<h3>{} {}</h3>\n<p>{}</p>\n<p class=\"verdict\">{}</p>\n\
         <p class=\"soft\">{}: {}</p>\n",
        sample(&look),
        escape(&run.name),
        escape(&run.title),
        prose(&capital(&run.verdict)),
        run.status.name(),
        prose(&run.reason),
    );
    if !run.assumptions.is_empty() {
        let known = prose(&run.assumptions.join("; "));
        text += &format!("<p>Assumptions: {known}.</p>\n");
    }
    for finding in &run.identifiability {
        text += &format!("<p>{}</p>\n", prose(&capital(&finding.text)));
    }
    for warning in &run.warnings {
        text += &format!("<p class=\"soft\">warning: {}</p>\n", prose(&warning.text));
    }
    text + "</div>\n"
}

/// The text with a capital first letter, unless it begins with a symbol such as `c`.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    if letters.clone().nth(1) == Some(' ') {
        return text.to_owned();
    }
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

/// Table of all quantities, one row for each.
fn all_quantities(runs: &[Measures]) -> String {
    let rows = known_rows(runs);
    // The rows of a group continue its label.
    let mut group = String::new();
    let rows = rows.iter().map(|row| {
        let label = match row.label.strip_prefix("  ") {
            Some(part) => format!("{group} {part}"),
            None => {
                let words = row.label.split(" of ").next().unwrap_or_default();
                group = words.split(" (").next().unwrap_or_default().to_owned();
                row.label.clone()
            }
        };
        let cells = row.cells.iter().map(|cell| match cell {
            Cell::Text(text) => text.clone(),
            _ => cell.short().replace('-', "−"),
        });
        std::iter::once(label.replace("= -", "= −"))
            .chain(cells)
            .collect()
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let names = runs.iter().map(|run| run.name.as_str());
    let headings: Vec<&str> = std::iter::once("quantity").chain(names).collect();
    shell::table("All quantities", &headings, &rows)
}
