//! A page in one file: nothing to load, light and dark, for screens of any width and for paper. What
//! is written is well-formed XML as well. Without scripts each figure is a drawing; with them it is a
//! chart that can be zoomed and read off.
//!
//! The page forbids itself everything but its own style sheet and script, which it names by their
//! SHA-256: a title or a name that were taken for a script by mistake could not run.

mod fit;
mod overview;
mod reproducibility;
mod settings;
mod table;

pub(super) use fit::page as fit_page;
pub(crate) use reproducibility::quoted as shell_quoted;
pub(super) use table::list;

use super::chart::{Figure, data, render};
use super::text::escape;
use data_encoding::BASE64;
use sha2::{Digest, Sha256};

const STYLE: &str = include_str!("page.css");

/// In the order in which they need each other.
const SCRIPTS: [&str; 6] = [
    include_str!("script/scale.js"),
    include_str!("script/draw.js"),
    include_str!("script/interaction.js"),
    include_str!("script/chart.js"),
    include_str!("script/panel.js"),
    include_str!("script/start.js"),
];

/// How a chart is used; every chart refers to it.
const KEYS: &str = "Hover over a chart to show values; drag to zoom. Click, then use the wheel to zoom in time, with Shift \
     in the value. Keys: arrows, Home and End move the cursor, with Shift in larger steps; + and - zoom; Escape or a \
     double click resets the view. The legend entries show and hide curves.";

/// A page: its title and what follows the heading, which must be escaped already.
pub(super) fn page(title: &str, body: &str) -> String {
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
         <h1>{title}</h1>\n{body}</main>\n\
         <p id=\"chart-keys\" class=\"unseen\">{}</p>\n\
         <div id=\"chart-reading\" class=\"unseen\" aria-live=\"polite\"></div>\n\
         <script>{script}</script>\n</body>\n</html>\n",
        escape(KEYS)
    )
}

/// The script of every page. In HTML the marks around it are comments, in XML they say that what is
/// between them is text.
fn script() -> String {
    format!(
        "//<![CDATA[\n(() => {{\n\"use strict\";\n{}}})();\n//]]>",
        SCRIPTS.concat()
    )
}

fn hash(text: &str) -> String {
    format!("sha256-{}", BASE64.encode(&Sha256::digest(text)))
}

/// A figure with its caption: a drawing, and its numbers for the chart. Title and description of the
/// figure are its text for readers who cannot see it.
fn figure(figure: &Figure, off: &[&str]) -> String {
    let drawn = data(figure, off);
    let thinned = match drawn.thinned {
        true => {
            " Long series are thinned for display: every peak is kept; all values are in the tables."
        }
        false => "",
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

/// How the charts below are used, where they can be.
pub(super) fn help() -> String {
    format!("<p class=\"soft screen\">{}</p>\n", escape(KEYS))
}

/// Figures one below the other.
pub(super) fn figures(figures: &[Figure]) -> String {
    figures_without(&[], figures)
}

/// Figures whose charts show the curves of these labels only when asked to: what is far away would make
/// everything else flat.
fn figures_without(off: &[&str], figures: &[Figure]) -> String {
    figures.iter().map(|f| figure(f, off)).collect()
}

/// A drawing as part of a page, where it needs no name space.
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
        let script = SCRIPTS.concat();
        for end in ["]]>", "</script", "<!--"] {
            assert!(!script.contains(end), "{end}");
        }
        assert!(!STYLE.contains(['<', '&', '\r']) && !script.contains('\r'));
    }
}
