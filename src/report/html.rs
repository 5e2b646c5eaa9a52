//! A page in one file: no scripts, nothing to load, light and dark, for screens of any width and for
//! paper. What is written is well-formed XML as well.

use super::figure::Figure;
use super::text::escape;
use super::{render, render_narrow};

/// A page: its title and what follows the heading, which must be escaped already.
pub(super) fn page(title: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n{body}</main>\n</body>\n</html>\n"
    )
}

/// A figure with its caption: a wide drawing, and one for narrow screens. Title and description of
/// the figure are its text for readers who cannot see it.
pub(super) fn figure(figure: &Figure) -> String {
    let caption = escape(&figure.title);
    format!(
        "<figure>\n<figcaption>{caption}</figcaption>\n\
         <div class=\"wide\">{}</div>\n<div class=\"narrow\">{}</div>\n</figure>\n",
        inline(&render(figure)),
        inline(&render_narrow(figure)),
    )
}

/// A drawing as part of a page, where it needs no name space.
fn inline(svg: &str) -> String {
    svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)
        .trim_end()
        .to_string()
}

/// In the dark the drawings keep their colours, some lightened; paper, frames, grids and letters
/// change.
const STYLE: &str = include_str!("html.css");
