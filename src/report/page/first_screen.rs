//! First screen of the page of a fit: data file and date, verdict with its reasons, answer, main figure, advice.

use super::figures;
use super::glossary::glossary;
use super::overview::state;
use super::table::{list, paragraph, table};
use crate::config::DataFile;
use crate::finding::Finding;
use crate::report::FittedModel;
use crate::report::answer::{AnswerRow, answer};
use crate::report::chart::{Detail, Figure};
use crate::report::document::{ResultDocument, Verdict, level_in_words};
use crate::report::extent::extent;
use crate::report::summary::count;
use crate::report::text::{and_list, escape, prose};
use kmcfit_core::internals::assessment::{EstimateStatus, VerdictLevel};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Number of further files from which they are counted and not named.
const MOST_FILES: usize = 4;

/// Seconds of a day.
const DAY: u64 = 86_400;

/// Everything above the contents.
pub(super) fn first_screen(run: &FittedModel, document: &ResultDocument, detail: Detail) -> String {
    let source = source_line(&run.model.source.data, Some(extent(document)));
    let state = match &document.verdict {
        Some(verdict) => verdict_line(verdict),
        None => state(document),
    };
    let answer =
        answers(document) + &scope(run, document) + &glossary(document) + &advice(document);
    screen(
        &(source + &state),
        &answer,
        run.main_figure(document),
        detail,
    )
}

/// What stands above the contents: lines over the whole width, and below them a text beside the main figure.
pub(crate) fn screen(above: &str, text: &str, main: Option<Figure>, detail: Detail) -> String {
    let part = |inner: &str| match inner.is_empty() {
        true => String::new(),
        false => format!("<div>\n{inner}</div>\n"),
    };
    let main = main.map(|main| figures(&[main], detail));
    format!(
        "{above}<div class=\"first\">\n{}{}</div>\n",
        part(text),
        part(&main.unwrap_or_default())
    )
}

/// Data files, number of samples and duration where all records of the page have the same, and date of the last change of a file.
/// Empty without any of them.
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
    let mut text = escape(&parts.join(": "));
    let modified = files.iter().filter_map(|f| f.modified).max();
    if let Some(day) = modified.and_then(date) {
        let what = match files.len() {
            1 => "file",
            _ => "files",
        };
        text += &format!("; {what} last changed on <time>{day}</time>");
    }
    match text.is_empty() {
        true => text,
        false => format!("<p class=\"soft\">{text}</p>\n"),
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
        text += &intervals(document);
    }
    match text.trim() {
        "" => String::new(),
        text => paragraph(text).replace("<p>", "<p class=\"soft\">"),
    }
}

/// What the intervals contain, and what an error of calibration changes.
fn intervals(document: &ResultDocument) -> String {
    let noise = match document.channels().any(|c| c.noise.is_some()) {
        true => "correlated noise of the samples",
        false => "noise of the samples",
    };
    let is_state = |name: &str| name.starts_with("initial ");
    let names = || document.nuisance_parameters.iter().map(|p| p.name.as_str());
    let fitted = match (names().any(is_state), names().any(|name| !is_state(name))) {
        (false, false) => "",
        (true, false) => " and the uncertainty of the fitted initial states",
        (false, true) => " and the uncertainty of the fitted sensor parameters",
        (true, true) => " and the uncertainty of the fitted initial states and sensor parameters",
    };
    let assumes = |kind: &str| {
        let mut all = document.verdict.iter().flat_map(|v| &v.assumptions);
        all.any(|assumption| assumption.kind == kind)
    };
    let force = match document.is_rotation() {
        true => "torque",
        false => "force",
    };
    // Only a force determines a mass that is estimated.
    let estimates = || document.estimates.0.iter();
    let is_forced = document
        .experiments
        .iter()
        .any(|e| e.driven_by.iter().any(|d| d == "force"));
    let has_scale = is_forced
        && estimates().any(|(name, e)| name == "mass" && e.status == EstimateStatus::Estimated);
    let example = match (has_scale, assumes("clock")) {
        (true, _) => {
            format!(": a {force} sensor that reads 1 % high makes m, c and k 1 % too large")
        }
        (false, true) => ": a clock that is 1 % fast makes the frequency 1 % too low".to_owned(),
        (false, false) => String::new(),
    };
    format!("The intervals cover the {noise}{fitted}. They exclude errors of calibration{example}.")
}

/// Name of a file without its folder.
fn name(file: &DataFile) -> String {
    let name = Path::new(&file.name).file_name();
    name.map_or(file.name.clone(), |name| {
        name.to_string_lossy().into_owned()
    })
}

/// The day of a time as `2026-03-02`, in universal time; `None` before 1970.
fn date(time: SystemTime) -> Option<String> {
    let days = time.duration_since(UNIX_EPOCH).ok()?.as_secs() / DAY;
    let is_leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    let (mut year, mut day) = (1970, days);
    while day >= 365 + u64::from(is_leap(year)) {
        day -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let mut month = 1;
    for length in [
        31,
        28 + u64::from(is_leap(year)),
        31,
        30,
        31,
        30,
        31,
        31,
        30,
        31,
        30,
    ] {
        if day < length {
            break;
        }
        day -= length;
        month += 1;
    }
    Some(format!("{year}-{month:02}-{:02}", day + 1))
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Seconds since 1970 of the tool `date -d DAY +%s`.
    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (1_709_251_199, "2024-02-29"),
            (1_709_251_200, "2024-03-01"),
            (1_772_409_600, "2026-03-02"),
            (4_107_542_400, "2100-03-01"),
        ] {
            let time = UNIX_EPOCH + Duration::from_secs(seconds);
            assert_eq!(date(time).as_deref(), Some(expected));
        }
        assert_eq!(date(UNIX_EPOCH - Duration::from_secs(1)), None);
    }
}
