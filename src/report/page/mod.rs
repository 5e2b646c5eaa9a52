//! HTML pages: one file without external resources, in light and dark, for screens of any width and for print; also
//! well-formed XML. Each figure is an SVG drawing, which a script reads and zooms.
//!
//! A content security policy permits only the style sheet and script of the page, by their SHA-256 digests, so that no
//! text of a model can run as a script.

mod checks;
mod first_screen;
mod fit;
mod overview;
mod reproducibility;
mod table;
mod validation;

pub(crate) use first_screen::{screen, state_line};
pub(super) use first_screen::{source_line, verdict_line};
pub(super) use fit::page as fit_page;
pub(super) use table::list;
pub(crate) use table::{paragraph, table};

use super::chart::{Figure, Mark, render};
use super::text::escape;
use data_encoding::BASE64;
use sha2::{Digest, Sha256};

const STYLE: &str = include_str!("page.css");

const SCRIPT: &str = include_str!("charts.js");

/// Instructions for charts, referenced by every chart.
const KEYS: &str = "Charts: hover or touch for values; drag to zoom; double click shows all. Keys: arrows move the cursor, with Shift in \
     larger steps; + and - zoom; Escape shows all.";

/// A page from its title and its body, which must be escaped.
fn page(title: &str, body: &str) -> String {
    let title = escape(title);
    let (style, script) = (format!("\n{STYLE}"), script());
    let (style_hash, script_hash) = (hash(&style), hash(&script));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         base-uri 'none'; form-action 'none'; style-src '{style_hash}'; \
         script-src '{script_hash}'\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n\
         <title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n{body}\
         <p id=\"chart-keys\" class=\"visually-hidden\">{}</p>\n\
         </main>\n\
         <script>{script}</script>\n</body>\n</html>\n",
        escape(KEYS)
    )
}

/// A section of a page: anchor, heading, body.
pub(crate) type Section = (&'static str, &'static str, String);

/// A page with a first screen and, beside contents that stay in sight, its sections; those without a body are omitted.
pub(crate) fn sectioned(title: &str, first: &str, mut sections: Vec<Section>) -> String {
    sections.retain(|(_, _, body)| !body.is_empty());
    let links = sections
        .iter()
        .map(|(anchor, heading, _)| format!("<a href=\"#{anchor}\">{}</a>\n", escape(heading)));
    let parts = sections.iter().map(|(anchor, heading, body)| {
        format!(
            "<section id=\"{anchor}\">\n<h2>{}</h2>\n{body}</section>\n",
            escape(heading)
        )
    });
    let body = format!(
        "{first}<div class=\"sections\">\n<nav aria-label=\"Contents\">\n{}</nav>\n<div>\n<p class=\"soft screen\">{}</p>\n{}</div>\n</div>\n",
        links.collect::<String>(),
        escape(KEYS),
        parts.collect::<String>()
    );
    page(title, &body)
}

/// The script of every page. The marks around it are comments in HTML and delimit character data in XML.
fn script() -> String {
    format!(
        "//<![CDATA[\n(() => {{\n\"use strict\";\n{}}})();\n//]]>",
        SCRIPT
    )
}

fn hash(text: &str) -> String {
    format!("sha256-{}", BASE64.encode(&Sha256::digest(text)))
}

/// A figure with its caption. Title and description of the figure are its text for screen readers.
fn figure(figure: &Figure) -> String {
    let is_sentence = figure.description.is_empty() || figure.description.ends_with('.');
    let end = if is_sentence { "" } else { "." };
    let mut marks = figure.panels.iter().flat_map(|panel| &panel.marks);
    let thinned = match marks.any(Mark::is_thinned) {
        true => format!(
            "{end} Long series are thinned for display: every peak is kept; kmcfit fit --tables writes all values to the tables."
        ),
        false => String::new(),
    };
    format!(
        "<figure class=\"chart\" id=\"figure-{}\">\n<figcaption><strong>{}</strong> \
         <span>{}{thinned}</span></figcaption>\n\
         <div class=\"still\">{}</div>\n</figure>\n",
        escape(&figure.name),
        escape(&figure.title),
        escape(&figure.description),
        inline(&render(figure)),
    )
}

/// Figures one below the other.
pub(crate) fn figures(figures: &[Figure]) -> String {
    figures.iter().map(figure).collect()
}

/// An SVG drawing for inclusion in HTML, without a name space.
fn inline(svg: &str) -> String {
    svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)
        .trim_end()
        .to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn the_script_stands_in_any_page() {
        for end in ["]]>", "</script", "<!--"] {
            assert!(!SCRIPT.contains(end), "{end}");
        }
        assert!(!STYLE.contains(['<', '&', '\r']) && !SCRIPT.contains('\r'));
    }
}
