//! Reproducibility section of the page of a fit: command, model file and data files with digests; and the citation.

use super::table::{pairs, paragraph, table};
use crate::config::ModelSource;
use crate::escape::shell_quoted;
use crate::report::FittedModel;
use crate::report::document::ResultDocument;
use crate::report::text::escape;
use kmcfit_core::step::arithmetic;

/// The command, versions, overrides, model file and data files.
pub(super) fn reproducibility(run: &FittedModel, document: &ResultDocument) -> String {
    let mut rows = vec![
        ("program", format!("kmcfit {}", document.version)),
        (
            "arithmetic",
            format!("{} (results are identical on all processors)", arithmetic()),
        ),
    ];
    rows.extend(
        document
            .weights
            .as_ref()
            .map(|w| ("seed", format!("{} (choice of the weight)", w.seed))),
    );
    let source = &run.model.source;
    command("fit", document)
        + &pairs(&rows)
        + &data(source)
        + "<h3>The model file</h3>\n"
        + &block(source.text.trim_end())
        + "<h3 id=\"cite\">How to cite</h3>\n"
        + &cite()
}

/// A command of the program on the model of the run.
pub(super) fn command(name: &str, document: &ResultDocument) -> String {
    let mut line = format!("kmcfit {name} {}", shell_quoted(&document.model.file));
    for change in &document.model.overrides {
        line += &format!(" --set {}", shell_quoted(change));
    }
    block(&line)
}

fn data(source: &ModelSource) -> String {
    let row = |file: &crate::config::DataFile| {
        vec![
            file.name.clone(),
            file.bytes.to_string(),
            file.sha256.clone(),
        ]
    };
    let rows: Vec<Vec<String>> = source.data.iter().map(row).collect();
    table("Data files", &["data file", "bytes", "SHA-256"], &rows)
}

/// The program, and the paper whose problem it solves.
fn cite() -> String {
    let program = format!(
        "kmcfit, version {}: {}.",
        env!("CARGO_PKG_VERSION"),
        env!("CARGO_PKG_DESCRIPTION")
    );
    paragraph(&program)
        + "<p>The problem and the method of its first solution: D. A. Buchta, <cite>Automatically find \
           spring-mass-damper behavior to match observations using adjoint-based sensitivity: Part I \
           Linear system</cite>.</p>\n"
}

/// Preformatted text in a scrolling box.
fn block(text: &str) -> String {
    format!("<pre tabindex=\"0\"><code>{}</code></pre>\n", escape(text))
}
