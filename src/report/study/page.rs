//! The page of a study, `study.html`.

use super::StudyDocument;
use super::figures;
use super::text::sections;
use crate::report::page as shell;
use crate::report::text::escape;

/// The page: one HTML file without external resources.
pub fn page(study: &StudyDocument) -> String {
    let mut body = String::new();
    for (heading, sentences) in sections(study) {
        body += &format!("<h2>{}</h2>\n{}", escape(heading), shell::list(&sentences));
    }
    body += "<h2>Figures</h2>\n";
    body += &shell::help();
    body += &shell::figures(&figures::all(study));
    body += &format!(
        "<p class=\"soft\">Made by kmcfit {}; seed {}, confidence {}; the study is {}.</p>\n",
        escape(&study.version),
        study.seed,
        study.confidence,
        escape(&study.status)
    );
    shell::page(&format!("Study of identifiability: {}", study.title), &body)
}
