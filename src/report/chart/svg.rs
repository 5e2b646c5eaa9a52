//! Rendering of a figure as SVG.
//!
//! Coordinates are integers in tenths of a pixel; `viewBox` scales them. Consecutive primitives of equal style form a
//! group that has the style.

use super::drawing::{Anchor, Ink, Point, Primitive, Words};
use super::figure::{Figure, FigureWidth};
use super::layout;
use super::plot_mark::{Dash, Style};
use crate::report::text::escape;

/// Units per pixel.
const UNITS: f64 = 10.0;

/// Millimetres of a pixel: 96 to the inch.
const MILLIMETRES: f64 = 25.4 / 96.0;

/// The figure as an SVG document 180 mm wide: white background, generic sans-serif, no scripts, no links.
///
/// The same figure always gives the same bytes. Title and description stand in `<title>` and
/// `<desc>`; all text is escaped.
pub fn render(figure: &Figure) -> String {
    render_at(figure, FigureWidth::Double)
}

/// [`render`] at a width for print. Fonts and lines have the same size at both: 7 to 9 pt, smaller only where a label is too long, and
/// 0.5 to 1 pt.
pub fn render_at(figure: &Figure, width: FigureWidth) -> String {
    let sheet = layout::sheet(figure, width);
    let (across, down) = (units(sheet.width), units(sheet.height));
    let [width, height] =
        [sheet.width, sheet.height].map(|side| (100.0 * MILLIMETRES * side).round() / 100.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}mm\" \
         height=\"{height}mm\" viewBox=\"0 0 {across} {down}\">\n\
         <title>{}</title>\n<desc>{}</desc>\n\
         <rect width=\"{across}\" height=\"{down}\" fill=\"#FFFFFF\"/>\n",
        escape(&figure.title),
        escape(&figure.description),
    );
    for group in sheet.shapes.chunk_by(|a, b| common(a) == common(b)) {
        svg += &format!("<g stroke-linejoin=\"round\"{}>\n", common(&group[0]));
        svg.extend(group.iter().map(draw));
        svg += "</g>\n";
    }
    svg + "</svg>\n"
}

/// The attributes of the group of a primitive: dash pattern, and colour of dots. Repeated for each dot they would
/// dominate the size of the file.
fn common(shape: &Primitive) -> String {
    match shape {
        Primitive::Path(_, stroke) => pattern(stroke.dash),
        Primitive::Dot(_, _, ink) => format!(" fill=\"{}\"", hex(ink)),
        _ => String::new(),
    }
}

fn pattern(dash: Dash) -> String {
    let lengths: Vec<String> = dash.lengths().iter().map(u16::to_string).collect();
    match lengths.is_empty() {
        true => String::new(),
        false => format!(" stroke-dasharray=\"{}\"", lengths.join(" ")),
    }
}

fn draw(shape: &Primitive) -> String {
    match shape {
        Primitive::Path(points, stroke) => format!(
            "<polyline fill=\"none\"{} stroke=\"{}\" stroke-width=\"{}\" points=\"{}\"/>\n",
            opacity(&stroke.ink),
            hex(&stroke.ink),
            units(stroke.width),
            places(points)
        ),
        Primitive::Area(points, ink) => format!(
            "<polygon{} fill=\"{}\" points=\"{}\"/>\n",
            opacity(ink),
            hex(ink),
            places(points)
        ),
        Primitive::Dot((x, y), radius, ink) => format!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"{}/>\n",
            units(*x),
            units(*y),
            units(*radius).max(1),
            opacity(ink)
        ),
        Primitive::Text(words) if words.text.is_empty() => String::new(),
        Primitive::Text(words) => text(words),
    }
}

fn text(words: &Words) -> String {
    let (x, y) = (units(words.at.0), units(words.at.1));
    let anchor = match words.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let weight = match words.bold {
        true => " font-weight=\"bold\"",
        false => "",
    };
    let turn = match words.upward {
        true => format!(" transform=\"rotate(270, {x}, {y})\""),
        false => String::new(),
    };
    format!(
        "<text x=\"{x}\" y=\"{y}\" dy=\"0.5ex\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" \
         font-size=\"{}\" fill=\"#000000\"{weight}{turn}>\n{}\n</text>\n",
        units(words.size),
        escape(&words.text)
    )
}

fn units(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn places(points: &[Point]) -> String {
    let mut places = String::new();
    let mut digits = itoa::Buffer::new();
    for (x, y) in points {
        if !places.is_empty() {
            places.push(' ');
        }
        places += digits.format(units(*x));
        places.push(',');
        places += digits.format(units(*y));
    }
    places
}

fn hex(ink: &Ink) -> String {
    let (r, g, b) = ink.rgb;
    format!("#{r:02X}{g:02X}{b:02X}")
}

fn opacity(ink: &Ink) -> String {
    match ink.opacity {
        1.0 => String::new(),
        opacity => format!(" opacity=\"{opacity}\""),
    }
}

/// A short line in a style as an inline SVG: the symbol of a run in the text of a page.
pub(in crate::report) fn sample(style: &Style) -> String {
    format!(
        "<svg aria-hidden=\"true\" viewBox=\"0 0 400 100\"><path d=\"M0 50H400\" fill=\"none\" \
         stroke=\"{}\" stroke-width=\"26\"{}/></svg>",
        hex(&Ink::of(style.colour)),
        pattern(style.dash)
    )
}
