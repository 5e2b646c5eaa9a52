//! HTML pages: one file without external resources, in light and dark, for screens of any width and for print; also
//! well-formed XML. Without scripts each figure is an SVG drawing, with them an interactive chart.
//!
//! A content security policy permits only the style sheet and script of the page, by their SHA-256 digests, so that no
//! text of a model can run as a script; and images within the page, by which a drawing becomes a PNG file.

mod animation;
mod checks;
mod first_screen;
mod fit;
mod glossary;
mod overview;
mod reproducibility;
mod settings;
mod table;
mod validation;

pub(crate) use first_screen::{screen, state_line};
pub(super) use first_screen::{source_line, verdict_line};
pub(super) use fit::page as fit_page;
pub(crate) use reproducibility::quoted as shell_quoted;
pub(super) use table::{list, marked_table};
pub(crate) use table::{paragraph, table};

use super::chart::{Detail, Figure, data, render};
use super::text::escape;
use data_encoding::BASE64;
use sha2::{Digest, Sha256};

const STYLE: &str = include_str!("page.css");

/// In order of dependence.
const SCRIPTS: [&str; 8] = [
    include_str!("script/scale.js"),
    include_str!("script/draw.js"),
    include_str!("script/interaction.js"),
    include_str!("script/download.js"),
    include_str!("script/chart.js"),
    include_str!("script/panel.js"),
    include_str!("script/animation.js"),
    include_str!("script/start.js"),
];

/// Instructions for charts, referenced by every chart.
const KEYS: &str = "Charts: hover or touch for values; drag to zoom; double click or Reset shows all. After a click the wheel zooms in \
     time, with Shift the vertical axis. Keys: arrows, Home and End move the cursor, with Shift in larger steps; + and - zoom; \
     Escape shows all. The legend entries show and hide curves.";

/// The same in one line.
const HELP: &str = "Charts: hover or touch for values; drag to zoom; double click or Reset shows all. Keys: arrows move the cursor, + and - zoom, \
     Escape shows all.";

/// A page from its title and its body, which must be escaped.
fn page(title: &str, body: &str) -> String {
    let title = escape(title);
    let (style, script) = (format!("\n{STYLE}"), script());
    let (style_hash, script_hash) = (hash(&style), hash(&script));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         base-uri 'none'; form-action 'none'; style-src '{style_hash}'; \
         script-src '{script_hash}'; img-src data:\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n\
         <title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n{body}\
         <p id=\"chart-keys\" class=\"visually-hidden\">{}</p>\n\
         <div id=\"chart-cursor\" class=\"visually-hidden\" aria-live=\"polite\"></div>\n</main>\n\
         <script>{script}</script>\n</body>\n</html>\n",
        escape(KEYS)
    )
}

/// Largest page, bytes.
const LARGEST: usize = 1_900_000;

/// A page of at most [`LARGEST`] bytes: the curves of a larger one are thinned further, down to the coarsest detail.
pub(crate) fn within_limit(page: impl Fn(Detail) -> String) -> String {
    let mut detail = Detail::FULL;
    loop {
        let text = page(detail);
        match detail.coarser().filter(|_| text.len() > LARGEST) {
            Some(coarser) => detail = coarser,
            None => return text,
        }
    }
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
        "{first}<div class=\"sections\">\n<nav aria-label=\"Contents\">\n{}</nav>\n<div>\n{}{}</div>\n</div>\n",
        links.collect::<String>(),
        help(),
        parts.collect::<String>()
    );
    page(title, &body)
}

/// The script of every page. The marks around it are comments in HTML and delimit character data in XML.
fn script() -> String {
    format!(
        "//<![CDATA[\n(() => {{\n\"use strict\";\n{}}})();\n//]]>",
        SCRIPTS.concat()
    )
}

fn hash(text: &str) -> String {
    format!("sha256-{}", BASE64.encode(&Sha256::digest(text)))
}

/// A figure with its caption: a drawing, and its numbers for the chart. Title and description of the figure are its
/// text for screen readers.
fn figure(figure: &Figure, off: &[&str], detail: Detail) -> String {
    let coarse = (detail != Detail::FULL).then(|| figure.clone().thinned(detail));
    let figure = coarse.as_ref().unwrap_or(figure);
    let drawn = data(figure, off);
    let is_sentence = figure.description.is_empty() || figure.description.ends_with('.');
    let end = if is_sentence { "" } else { "." };
    let thinned = match drawn.thinned {
        true => format!(
            "{end} Long series are thinned for display: every peak is kept; kmcfit fit --tables writes all values to the tables."
        ),
        false => String::new(),
    };
    format!(
        "<figure class=\"chart\" id=\"figure-{}\">\n<figcaption><strong>{}</strong> \
         <span>{}{thinned}</span></figcaption>\n\
         <div class=\"still\" tabindex=\"-1\">{}</div>\n\
         <script type=\"application/json\">{}</script>\n</figure>\n",
        escape(&figure.name),
        escape(&figure.title),
        escape(&figure.description),
        inline(&render(figure)),
        drawn.json
    )
}

/// Instructions for the charts in one line, shown only with scripts.
fn help() -> String {
    format!("<p class=\"soft screen\">{}</p>\n", escape(HELP))
}

/// Figures one below the other.
pub(crate) fn figures(figures: &[Figure], detail: Detail) -> String {
    figures_without(&[], figures, detail)
}

/// Figures whose curves with the labels `off` are initially hidden, because their range would flatten the others.
fn figures_without(off: &[&str], figures: &[Figure], detail: Detail) -> String {
    figures.iter().map(|f| figure(f, off, detail)).collect()
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
    use crate::report::chart::{Mark, Panel, Style};

    /// Thirty records of 4000 samples, noise that no straight line replaces, exceed the limit at full detail. Every peak stays.
    #[test]
    fn a_large_page_is_thinned_to_the_limit() {
        let t: Vec<f64> = (0..4000).map(f64::from).collect();
        let mut y: Vec<f64> = t.iter().map(|t| (t * t).sin()).collect();
        y[1234] = 7.25;
        let line = Mark::points("samples", &t, &y, Style::nth(0));
        let drawn = Figure::new("record", "", "noise").panel(Panel::of_time("y", "m").mark(line));
        let drawn = vec![drawn; 30];
        let of = |detail| figures(&drawn, detail);
        assert!(of(Detail::FULL).len() > LARGEST && !of(Detail::FULL).contains("are thinned"));
        let page = within_limit(of);
        assert!(page.len() <= LARGEST, "{}", page.len());
        assert_eq!(page.matches("7.25").count(), 30, "the peak of each");
        assert_eq!(page.matches("noise. Long series are thinned").count(), 30);
        let small = |detail| figures(&drawn[..1], detail);
        assert!(within_limit(small) == small(Detail::FULL));
    }

    #[test]
    fn the_script_stands_in_any_page() {
        let script = SCRIPTS.concat();
        for end in ["]]>", "</script", "<!--"] {
            assert!(!script.contains(end), "{end}");
        }
        assert!(!STYLE.contains(['<', '&', '\r']) && !script.contains('\r'));
    }
}
