//! First screen of the page of a fit: data file, verdict with its reasons, answer, main figure, advice.

use super::figures;
use super::overview::state;
use super::table::{list, paragraph, table};
use crate::config::DataFile;
use crate::report::FittedModel;
use crate::report::answer::{AnswerRow, answer};
use crate::report::chart::Figure;
use crate::report::document::{ResultDocument, Verdict, level_in_words};
use crate::report::extent::extent;
use crate::report::summary::additions;
use crate::report::text::{escape, prose};
use kmcfit_core::assessment::VerdictLevel;
use kmcfit_core::finding::Finding;
use kmcfit_core::number_format::{and_list, count};
use std::path::Path;

/// Number of further files from which they are counted and not named.
const MOST_FILES: usize = 4;

/// Everything above the contents.
pub(super) fn first_screen(run: &FittedModel, document: &ResultDocument) -> String {
    let source = source_line(&run.model.source.data, Some(extent(document)));
    let state = match &document.verdict {
        Some(verdict) => verdict_line(verdict),
        None => state(document),
    };
    let answer = answers(document) + &added(document) + &scope(run, document) + &advice(document);
    screen(&(source + &state), &answer, run.main_figure(document))
}

/// What stands above the contents: lines over the whole width, and below them a text beside the main figure.
pub(crate) fn screen(above: &str, text: &str, main: Option<Figure>) -> String {
    let part = |inner: &str| match inner.is_empty() {
        true => String::new(),
        false => format!("<div>\n{inner}</div>\n"),
    };
    let main = main.map(|main| figures(&[main]));
    format!(
        "{above}<div class=\"first\">\n{}{}</div>\n",
        part(text),
        part(&main.unwrap_or_default())
    )
}

/// Data files, number of samples and duration where all records of the page have the same; empty without any of them.
pub(in crate::report) fn source_line(files: &[DataFile], size: Option<String>) -> String {
    let names: Vec<String> = files.iter().map(name).collect();
    let mut parts = Vec::new();
    parts.extend(match names.as_slice() {
        [] => None,
        [first, rest @ ..] if rest.len() >= MOST_FILES => {
            Some(format!("{first} and {}", count(rest.len(), "further file")))
        }
        few => Some(and_list(few)),
    });
    parts.extend(size);
    match escape(&parts.join(": ")) {
        text if text.is_empty() => text,
        text => format!("<p class=\"soft\">{text}</p>\n"),
    }
}

/// What `--select` added to the model of the file.
fn added(document: &ResultDocument) -> String {
    match additions(document) {
        steps if steps.is_empty() => String::new(),
        steps => paragraph(&format!("Added to the model: {}.", steps.join("; "))),
    }
}

/// Scope of the answer: the records to which the coefficients belong, and what the intervals contain.
fn scope(run: &FittedModel, document: &ResultDocument) -> String {
    let mut text = String::new();
    let problem = &run.model.problem;
    let records = problem.experiments.len();
    if records > 1 {
        text += &match problem.functions.coefficient_sets().len() {
            1 => format!(
                "Coefficients, frequency and damping ratio are common to the {records} records. "
            ),
            _ => "Frequency and damping ratio are those of the shared coefficients. ".to_owned(),
        };
    }
    let has_intervals = answer(document).iter().any(|row| !row.interval.is_empty());
    if has_intervals {
        text += "The intervals cover the noise of the samples and the uncertainty of all fitted parameters. They exclude errors of calibration.";
    }
    match text.trim() {
        "" => String::new(),
        text => paragraph(text).replace("<p>", "<p class=\"soft\">"),
    }
}

/// Name of a file without its folder.
fn name(file: &DataFile) -> String {
    let name = Path::new(&file.name).file_name();
    name.map_or(file.name.clone(), |name| {
        name.to_string_lossy().into_owned()
    })
}

/// Verdict as a coloured word, and its reasons.
pub(in crate::report) fn verdict_line(verdict: &Verdict) -> String {
    let colour = match verdict.level {
        VerdictLevel::Adequate => "good",
        VerdictLevel::Check => "warn",
        VerdictLevel::Inadequate => "bad",
    };
    let reasons = match verdict.reasons.as_slice() {
        [] => vec![verdict.passed.clone()],
        reasons => Finding::texts(reasons),
    };
    state_line(colour, level_in_words(verdict.level), &reasons.join("; "))
}

/// A word in one of the colours `good`, `warn` and `bad`, and a sentence.
pub(crate) fn state_line(colour: &str, word: &str, sentence: &str) -> String {
    format!(
        "<p class=\"verdict-line\"><span class=\"state {colour}\">{}</span> {}</p>\n",
        escape(word),
        prose(sentence)
    )
}

/// Table of the answer.
fn answers(document: &ResultDocument) -> String {
    let row = |row: AnswerRow| {
        let status = row.status_and_range();
        let estimate = match row.estimate.as_str() {
            "" => String::new(),
            estimate => format!("{estimate} {}", row.unit).trim_end().to_owned(),
        };
        vec![row.quantity, estimate, row.interval, status]
    };
    let mut rows: Vec<Vec<String>> = answer(document).into_iter().map(row).collect();
    let mut headings = vec!["quantity", "estimate", "95 % CI", "status"];
    // Samples without noise have no intervals.
    if rows.iter().all(|row| row[2].is_empty()) {
        headings.remove(2);
        for row in &mut rows {
            row.remove(2);
        }
    }
    table("Answer", &headings, &rows)
}

/// The recommendations, the most urgent first.
fn advice(document: &ResultDocument) -> String {
    match Finding::texts(&document.advice).as_slice() {
        [] => String::new(),
        [only] => format!("<p><strong>Next:</strong> {}</p>\n", prose(only)),
        several => format!("<p><strong>Next:</strong></p>\n{}", list(several)),
    }
}
