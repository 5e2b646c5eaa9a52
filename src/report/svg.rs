//! Writes a figure as SVG; the only file that knows the plotting crate.
//!
//! The crate draws on whole numbers and knows no dashes. So the drawing is ten times as large as
//! the picture (a unit is a tenth of a pixel, `viewBox` scales it back), and shapes of one dash
//! pattern are drawn together and wrapped in a group that carries it.

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontFamily, FontStyle, FontTransform, RGBAColor, RGBColor};
use plotters::style::{ShapeStyle, TextStyle};

use super::figure::Figure;
use super::layout;
use super::mark::{Dash, Style};
use super::shape::{Anchor, Ink, Point, Shape, Sheet, Stroke, Words};
use super::text;

/// Units of the drawing in one pixel of the picture.
const UNITS: f64 = 10.0;
/// The crate divides font sizes by this before it writes them.
const FONT: f64 = 1.24;

/// The figure as an SVG document: white background, generic sans-serif, no scripts, no links.
///
/// The same figure always gives the same bytes. Title and description stand in `<title>` and
/// `<desc>`; all text is escaped.
pub fn render(figure: &Figure) -> String {
    render_sheet(figure, &layout::sheet(figure, layout::WIDTH))
}

/// The same figure for a narrow screen: 380 pixels wide, its text as large as in [`render`].
pub fn render_narrow(figure: &Figure) -> String {
    render_sheet(figure, &layout::sheet(figure, layout::NARROW))
}

fn render_sheet(figure: &Figure, sheet: &Sheet) -> String {
    let mut svg = head(figure, sheet);
    for group in sheet.shapes.chunk_by(|a, b| common(a) == common(b)) {
        let common = common(&group[0]);
        let content = shorten(&round_sizes(&draw(group, sheet)), &common);
        svg.push_str(&format!(
            "<g stroke-linejoin=\"round\"{common}>\n{content}</g>\n"
        ));
    }
    svg.push_str("</svg>\n");
    svg
}

fn head(figure: &Figure, sheet: &Sheet) -> String {
    let (width, height) = (sheet.width, sheet.height);
    let (across, down) = size(sheet);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" \
         height=\"{height}\" viewBox=\"0 0 {across} {down}\">\n\
         <title>{}</title>\n<desc>{}</desc>\n\
         <rect width=\"{across}\" height=\"{down}\" fill=\"#FFFFFF\"/>\n",
        text::escape(&figure.title),
        text::escape(&figure.description),
    )
}

/// Width and height of the drawing in its own units.
fn size(sheet: &Sheet) -> (u32, u32) {
    ((sheet.width * UNITS) as u32, (sheet.height * UNITS) as u32)
}

/// The attributes of the group to which a shape belongs: its dash pattern, and the colour of dots,
/// which would be most of the file if each dot said it again.
fn common(shape: &Shape) -> String {
    match shape {
        Shape::Path(_, stroke) => pattern(stroke.dash).to_string(),
        Shape::Dot(_, _, Ink { rgb: (r, g, b), .. }) => format!(" fill=\"#{r:02X}{g:02X}{b:02X}\""),
        _ => String::new(),
    }
}

fn pattern(dash: Dash) -> &'static str {
    match dash {
        Dash::Solid => "",
        Dash::Dashed => " stroke-dasharray=\"60 32\"",
        Dash::Dotted => " stroke-dasharray=\"16 22\"",
        Dash::DashDot => " stroke-dasharray=\"70 26 16 26\"",
    }
}

/// Draws shapes with the crate and takes its own `<svg>` element off again.
fn draw(shapes: &[Shape], sheet: &Sheet) -> String {
    let mut svg = String::new();
    {
        let mut backend = SVGBackend::with_string(&mut svg, size(sheet));
        for shape in shapes {
            paint(&mut backend, shape);
        }
    }
    let start = svg.find('\n').map_or(0, |end| end + 1);
    let end = svg.rfind("</svg>").unwrap_or(svg.len());
    svg[start..end].to_string()
}

/// Paints one shape. Errors are dropped: they come from files and fonts, and neither is used here.
fn paint(backend: &mut SVGBackend, shape: &Shape) {
    match shape {
        Shape::Path(points, stroke) => {
            backend
                .draw_path(points.iter().map(units), &path_style(stroke))
                .ok();
        }
        Shape::Area(points, ink) => {
            backend
                .fill_polygon(points.iter().map(units), &colour(ink))
                .ok();
        }
        Shape::Dot(centre, radius, ink) => {
            let radius = (radius * UNITS).round().max(1.0) as u32;
            backend
                .draw_circle(units(centre), radius, &colour(ink), true)
                .ok();
        }
        Shape::Text(words) if words.text.is_empty() => {}
        Shape::Text(words) => {
            let text = text::clean(&words.text);
            backend
                .draw_text(&text, &text_style(words), units(&words.at))
                .ok();
        }
    }
}

fn units(point: &Point) -> (i32, i32) {
    (
        (point.0 * UNITS).round() as i32,
        (point.1 * UNITS).round() as i32,
    )
}

fn colour(ink: &Ink) -> RGBAColor {
    let (red, green, blue) = ink.rgb;
    RGBColor(red, green, blue).mix(ink.opacity)
}

fn path_style(stroke: &Stroke) -> ShapeStyle {
    ShapeStyle {
        color: colour(&stroke.ink),
        filled: false,
        stroke_width: (stroke.width * UNITS).round() as u32,
    }
}

fn text_style(words: &Words) -> TextStyle<'static> {
    let style = if words.bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    let font = (FontFamily::SansSerif, words.size * UNITS * FONT, style);
    let turn = if words.upward {
        FontTransform::Rotate270
    } else {
        FontTransform::None
    };
    let across = match words.anchor {
        Anchor::Start => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::End => HPos::Right,
    };
    TextStyle::from(font)
        .transform(turn)
        .pos(Pos::new(across, VPos::Center))
}

/// Leaves out attributes that say what holds anyway, or what the group says in `common`.
/// Text cannot be hit: its quotes are escaped.
fn shorten(svg: &str, common: &str) -> String {
    let svg = svg
        .replace(" opacity=\"1\"", "")
        .replace(" stroke=\"none\" stroke-width=\"1\"", "")
        .replace(" \"/>", "\"/>");
    match common {
        "" => svg,
        common => svg.replace(common, ""),
    }
}

/// Rounds font sizes, which the crate writes with all their digits.
fn round_sizes(svg: &str) -> String {
    const KEY: &str = "font-size=\"";
    let mut parts = svg.split(KEY);
    let mut rounded = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (size, rest) = part.split_once('"').unwrap_or((part, ""));
        let size = size.parse().unwrap_or(0.0_f64).round();
        rounded.push_str(&format!("{KEY}{size}\"{rest}"));
    }
    rounded
}

/// A short line in a style as a small drawing for the text of a page, where it stands for a run.
pub(super) fn sample(style: &Style) -> String {
    let Ink { rgb, .. } = Ink::of(style.colour);
    let (r, g, b) = rgb;
    format!(
        "<svg aria-hidden=\"true\" viewBox=\"0 0 400 100\"><path d=\"M0 50H400\" fill=\"none\" \
         stroke=\"#{r:02X}{g:02X}{b:02X}\" stroke-width=\"26\"{}/></svg>",
        pattern(style.dash)
    )
}
