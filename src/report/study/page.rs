//! A study as a page.

use super::StudyDocument;
use super::figures;
use super::text::sections;
use crate::report::page as shell;
use crate::report::text::escape;

/// One file, nothing to load.
pub fn page(study: &StudyDocument) -> String {
    let mut body = String::new();
    for (heading, sentences) in sections(study) {
        body += &format!("<h2>{}</h2>\n{}", escape(heading), shell::list(&sentences));
    }
    body += "<h2>In pictures</h2>\n";
    body += &shell::help();
    body += &shell::figures(&figures::all(study));
    body += &format!(
        "<p class=\"soft\">Made by kmcfit {}; seed {}, confidence {}; the study is {}.</p>\n",
        escape(&study.version),
        study.seed,
        study.confidence,
        escape(&study.status)
    );
    shell::page(&format!("What the data tell: {}", study.title), &body)
}
