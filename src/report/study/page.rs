//! The page of a study, `study.html`: first screen, then each finding beside its chart.

use super::StudyDocument;
use super::figures;
use super::text::{PARTS, Part, widest_range};
use crate::report::page as shell;

/// The page: one HTML file without external resources. `source` is the line on its data.
pub fn page(study: &StudyDocument, source: &str) -> String {
    let sections = PARTS.iter();
    let sections = sections.map(|part| (part.anchor, part.heading, section(study, part)));
    let mut sections: Vec<shell::Section> = sections.collect();
    let made = format!(
        "Made by kmcfit {}; seed {}, confidence {}; the study is {}.",
        study.version, study.seed, study.confidence, study.status
    );
    sections.push(("made", "Settings", shell::paragraph(&made)));
    let title = format!("Study of identifiability: {}", study.title);
    shell::sectioned(&title, &first_screen(study, source), sections)
}

fn first_screen(study: &StudyDocument, source: &str) -> String {
    let fit = study.fit.as_ref();
    let state = fit.map_or(String::new(), |fit| match &fit.verdict {
        Some(verdict) => shell::verdict_line(verdict),
        None => shell::state_line("warn", fit.status.name(), &fit.reason),
    });
    let state = match study.status.as_str() {
        super::COMPLETE => state,
        status => state + &shell::paragraph(&format!("The study is {status}.")),
    };
    shell::screen(
        &(source.to_owned() + &state),
        &quantities(study),
        figures::main(study),
    )
}

/// Table of the functions and ratios: extremes and classification of each.
fn quantities(study: &StudyDocument) -> String {
    let known = study.bands.iter().flat_map(|bands| &bands.classification);
    let rows = known.map(|c| {
        let extremes = study.extremes.iter().find(|e| e.name == c.name);
        let text = c.text.strip_prefix(&format!("{}: ", c.name));
        vec![
            c.name.clone(),
            text.unwrap_or(&c.text).to_owned(),
            extremes.map_or(String::new(), widest_range),
        ]
    });
    let headings = [
        "quantity",
        "determined by the records",
        "data-consistent extremes",
    ];
    let rows: Vec<Vec<String>> = rows.collect();
    let table = shell::table("Quantities", &headings, &rows);
    format!("<div class=\"words\">\n{table}</div>\n")
}

/// Findings of a part beside its chart; alone where there is none.
fn section(study: &StudyDocument, part: &Part) -> String {
    let text = shell::list(&(part.sentences)(study));
    let Some(chart) = (part.figure)(study) else {
        return text;
    };
    let chart = shell::figures(&[chart]);
    format!("<div class=\"finding\">\n<div>\n{text}</div>\n<div>\n{chart}</div>\n</div>\n")
}
