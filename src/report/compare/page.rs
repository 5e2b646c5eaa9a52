//! The comparison as a page.

use super::conclusions::conclusions;
use super::figures::{self, style};
use super::measures::Measures;
use super::selection;
use super::table::{QuantityRow, known_rows};
use super::{CLOSE, Comparison, MATCHED};
use crate::report::chart::{Style, sample};
use crate::report::page as shell;
use crate::report::text::{escape, prose};
use kmcfit_core::internals::assessment::RECOVERY_TOLERANCE;

pub(super) fn page(comparison: &Comparison) -> String {
    let count = comparison.measures.len() + comparison.left_out.len();
    let title = match (&comparison.sequence, count) {
        (Some(title), _) => title.clone(),
        (None, 1) => "One run".to_string(),
        (None, count) => format!("Comparison of {count} runs"),
    };
    let mut body = format!("<p>{}</p>\n", prose(&lead(comparison)));
    if comparison.sequence.is_some() {
        body += "<h2>Conclusions</h2>\n";
        body += &shell::list(&conclusions(&comparison.measures));
    }
    body += "<h2>Summary of each run</h2>\n";
    for (i, run) in comparison.measures.iter().enumerate() {
        body += &card(run, style(i));
    }
    if let Some(warning) = comparison.warning() {
        body += &format!("<p class=\"soft\">warning: {}</p>\n", prose(&warning));
    }
    for left_out in &comparison.left_out {
        body += &format!(
            "<section class=\"run\">\n<h3>{}</h3>\n<p class=\"verdict\">no result: {}</p>\n</section>\n",
            escape(&left_out.name),
            prose(&left_out.reason)
        );
    }
    let sentences = selection::sentences(comparison);
    if !sentences.is_empty() {
        body += "<h2>Model selection</h2>\n";
        body += &shell::list(&sentences);
    }
    body += "<h2>Table</h2>\n";
    body += &table(&comparison.measures);
    body += &format!("<p class=\"soft\">{}</p>\n", prose(&notes()));
    body += "<h2>Figures</h2>\n";
    body += &shell::help();
    body += &shell::figures(&figures::all(comparison));
    body += &format!(
        "<p class=\"soft\">Made by kmcfit {}.</p>\n",
        env!("CARGO_PKG_VERSION")
    );
    shell::page(&title, &body)
}

/// First sentence: the number of runs that recover the true system.
fn lead(comparison: &Comparison) -> String {
    let runs = &comparison.measures;
    let known = runs.iter().filter(|m| m.is_true_system.is_some()).count();
    let reached = runs
        .iter()
        .filter(|m| m.is_true_system == Some(true))
        .count();
    match (known, reached) {
        (0, _) => "The true system is not known for any run.".into(),
        (1, 0) => "The run with a known true system does not recover it.".into(),
        (1, _) => "The run with a known true system recovers it.".into(),
        (_, 0) => format!("None of the {known} runs with a known true system recovers it."),
        _ if known == reached => format!("All {known} runs with a known true system recover it."),
        _ => format!(
            "{reached} of the {known} runs with a known true system recover{} it.",
            match reached {
                1 => "s",
                _ => "",
            }
        ),
    }
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
        "<section class=\"run\">\n<h3>{} {}</h3>\n<p>{}</p>\n<p class=\"verdict\">{}</p>\n\
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
    text + "</section>\n"
}

/// The text with a capital first letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

fn table(runs: &[Measures]) -> String {
    let mut text =
        String::from("<div class=\"scroll\" tabindex=\"0\">\n<table>\n<thead>\n<tr><td></td>");
    for (i, run) in runs.iter().enumerate() {
        let (sample, name) = (sample(&style(i)), escape(&run.name));
        text += &format!("<th scope=\"col\">{sample} {name}</th>");
    }
    text += "</tr>\n</thead>\n<tbody>\n";
    known_rows(runs)
        .iter()
        .for_each(|row| text += &table_row(row));
    text + "</tbody>\n</table>\n</div>\n"
}

fn table_row(row: &QuantityRow) -> String {
    let part = if row.label.starts_with(' ') {
        " class=\"part\""
    } else {
        ""
    };
    let label = escape(row.label.trim_start()).replace("= -", "= −");
    let cells = row.cells.iter().map(|cell| {
        let text = escape(&cell.short()).replace('-', "−");
        match cell {
            super::table::Cell::Text(text) => format!("<td>{}</td>", escape(text)),
            _ => format!("<td>{text}</td>"),
        }
    });
    let cells: String = cells.collect();
    format!("<tr><th scope=\"row\"{part}>{label}</th>{cells}</tr>\n")
}
