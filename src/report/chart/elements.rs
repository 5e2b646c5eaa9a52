//! Elements of an SVG drawing.

use super::plot_mark::Style;
use crate::report::text::escape;
use std::fmt::Write;

/// Font size of labels, in pixels.
pub(super) const SIZE: f64 = 12.0;

/// A stroked path; `more` are further attributes. Dots are lines without length and round ends.
pub(super) fn path(body: &mut String, d: &str, style: &Style, more: &str, is_dots: bool) {
    let dash = style.dash.lengths();
    let dash = match dash.is_empty() || is_dots {
        true => String::new(),
        false => format!(" stroke-dasharray=\"{dash}\""),
    };
    let cap = if is_dots {
        " stroke-linecap=\"round\""
    } else {
        ""
    };
    let _ = writeln!(
        body,
        "<path{more} fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"{cap}{dash} d=\"{d}\"/>",
        style.colour.hex(),
        style.width
    );
}

/// A filled path.
pub(super) fn area(body: &mut String, d: &str, fill: &str, opacity: f64, more: &str) {
    let _ = writeln!(
        body,
        "<path{more} fill=\"{fill}\" fill-opacity=\"{opacity}\" d=\"{d}\"/>"
    );
}

/// A line of text, vertically centred; `more` are further attributes.
pub(super) fn words(body: &mut String, (x, y): (f64, f64), text: &str, size: f64, more: &str) {
    if !text.is_empty() {
        let [x, y, size] = [x, y, size].map(|v| (100.0 * v).round() / 100.0);
        let _ = writeln!(
            body,
            "<text x=\"{x}\" y=\"{y}\" dy=\"0.35em\" font-size=\"{size}\" fill=\"#000000\"{more}>{}</text>",
            escape(text)
        );
    }
}
