//! Drawing of a figure as SVG: legend, and panels in rows and columns.

use super::axis::{self, Axis, Range, Ruler};
use super::elements::{SIZE, area, path, words};
use super::figure::{Figure, Panel};
use super::panel::{Frame, SPAN, band_opacity, draw};
use super::plot_mark::{Dash, Mark, MarkKind};
use crate::report::text::{self, escape};

/// Width in pixels, of 96 to the inch: 180 mm, two columns of a journal.
const WIDTH: f64 = 680.0;
/// Millimetres of a pixel.
const MILLIMETRES: f64 = 25.4 / 96.0;
/// Margins of a panel: left of the axes and right of them.
const LEFT: f64 = 66.0;
const RIGHT: f64 = 18.0;
/// Blank edge above and below everything.
const EDGE: f64 = 8.0;
/// Height of a panel's title, and of the labels below its axis.
const TITLE: f64 = 1.6 * SIZE;
const LABELS: f64 = 45.0;
/// Gap between a panel without labels and the one below.
const GAP: f64 = 10.0;
/// Height of the axes: alone, side by side, and in a stack.
const ALONE: f64 = 320.0;
const SIDE_BY_SIDE: f64 = 260.0;
const STACKED: f64 = 165.0;
/// Length of the sample beside a label of the legend, and height of its rows.
const SAMPLE: f64 = 28.0;
const ROW: f64 = 18.0;

/// The figure as an SVG document 180 mm wide: white background, generic sans-serif, no scripts, no links.
///
/// The same figure always gives the same bytes. Title and description stand in `<title>` and `<desc>`; all text is escaped. The
/// attributes `data-` of a panel are its axes, by which the script of a page reads values.
pub fn render(figure: &Figure) -> String {
    let panels = figure.panels.as_slice();
    let columns = figure.columns.clamp(1, panels.len().max(1));
    let width = WIDTH / columns as f64;
    let height = match (panels.len().div_ceil(columns), columns) {
        (1, 1) => ALONE,
        (1, _) => SIDE_BY_SIDE,
        _ => STACKED,
    };
    let mut body = String::new();
    let mut top = EDGE + legend(&mut body, figure);
    for (row, panels) in panels.chunks(columns).enumerate() {
        let is_titled = panels.iter().any(|panel| !panel.title.is_empty());
        top += if is_titled { TITLE } else { 4.0 };
        let mut footer = GAP;
        for (column, panel) in panels.iter().enumerate() {
            let below = figure.panels.get((row + 1) * columns + column);
            let has_labels = below.is_none_or(|below| below.x != panel.x);
            if has_labels {
                footer = LABELS;
            }
            let frame = Frame {
                left: column as f64 * width + LEFT,
                top,
                width: width - LEFT - RIGHT,
                height,
            };
            let beside = figure.panels.iter().skip(column).step_by(columns);
            let rulers = [x_ruler(panel, beside), y_ruler(panel)];
            draw(&mut body, panel, frame, rulers, has_labels);
        }
        top += height + footer;
    }
    let (all, page) = (WIDTH, (top + EDGE).ceil());
    let [across, down] = [all, page].map(|side| (100.0 * MILLIMETRES * side).round() / 100.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{across}mm\" height=\"{down}mm\" viewBox=\"0 0 {all} {page}\" \
         font-family=\"sans-serif\">\n<title>{}</title>\n<desc>{}</desc>\n\
         <rect width=\"{all}\" height=\"{page}\" fill=\"#FFFFFF\"/>\n{body}</svg>\n",
        escape(&figure.title),
        escape(&figure.description),
    )
}

/// The common range of the panels of a column that have the same horizontal axis.
fn x_ruler<'a>(panel: &Panel, column: impl Iterator<Item = &'a Panel>) -> Ruler {
    let alike = column.filter(|other| other.x == panel.x);
    let marks = alike.flat_map(|panel| &panel.marks);
    let extents = marks.filter_map(|mark| axis::extent(panel.x.scale, &mark.x));
    Ruler::new(&panel.x, extents, false)
}

fn y_ruler(panel: &Panel) -> Ruler {
    let Axis { scale, .. } = panel.y;
    let of_mark = |mark: &Mark| -> [Option<Range>; 2] {
        [&mark.y, &mark.high].map(|values| axis::extent(scale, values))
    };
    Ruler::new(
        &panel.y,
        panel.marks.iter().flat_map(of_mark).flatten(),
        true,
    )
}

/// The marks in the legend: labelled marks, those with equal label and colour once, by their curve if they have one.
fn entries(figure: &Figure) -> Vec<&Mark> {
    let mut entries: Vec<&Mark> = Vec::new();
    let marks = figure.panels.iter().flat_map(|panel| &panel.marks);
    for mark in marks.filter(|mark| !mark.label.is_empty()) {
        let is_same = |entry: &&mut &Mark| {
            entry.label == mark.label && entry.style.colour == mark.style.colour
        };
        match entries.iter_mut().find(is_same) {
            None => entries.push(mark),
            Some(entry) if entry.kind != MarkKind::Line && mark.kind == MarkKind::Line => {
                *entry = mark;
            }
            Some(_) => {}
        }
    }
    entries
}

/// Writes the legend, its entries side by side in as many rows as they need; returns its height.
fn legend(body: &mut String, figure: &Figure) -> f64 {
    let (mut x, mut y) = (LEFT, EDGE + 0.5 * ROW);
    let entries = entries(figure);
    for mark in &entries {
        let room = WIDTH - LEFT - RIGHT - SAMPLE - 6.0;
        let size = text::fit(&mark.label, SIZE, room);
        let length = SAMPLE + 6.0 + text::width(&mark.label, size);
        if x > LEFT && x + length > WIDTH - RIGHT {
            (x, y) = (LEFT, y + ROW);
        }
        let end = x + SAMPLE;
        let [low, high] = [y - 0.4 * SIZE, y + 0.4 * SIZE];
        let block = format!("M{x} {low}H{end}V{high}H{x}Z");
        let line = format!("M{x} {y}H{end}");
        let dots = format!("M{} {y}h0M{} {y}h0M{} {y}h0", x + 5.0, x + 14.0, x + 23.0);
        let style = &mark.style;
        match mark.kind {
            MarkKind::Points => path(body, &dots, style, "", true),
            MarkKind::Band => {
                area(body, &block, style.colour.hex(), band_opacity(style), "");
                if style.dash != Dash::Solid {
                    let edges = format!("M{x} {low}H{end}M{x} {high}H{end}");
                    path(body, &edges, &style.width(1.0), "", false);
                }
            }
            MarkKind::Span => area(body, &block, SPAN, 1.0, ""),
            _ => path(body, &line, style, "", false),
        }
        words(body, (end + 6.0, y), &mark.label, size, "");
        x += length + 18.0;
    }
    match entries.is_empty() {
        true => 0.0,
        false => y + 0.5 * ROW - EDGE + 6.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Colour, Style};

    /// Dots and a band of a curve have its entry; another colour has its own.
    #[test]
    fn equal_labels_of_one_colour_are_one_entry() {
        let t = [0.0, 1.0];
        let blue = Style::new(Colour::Blue);
        let panel = Panel::of_time("k", "N/m")
            .mark(Mark::band("fit", &t, &t, &t, Colour::Blue).dash(Dash::Dashed))
            .mark(Mark::line("fit", &t, &t, blue))
            .mark(Mark::points("fit", &t, &t, blue))
            .mark(Mark::points("fit", &t, &t, Style::new(Colour::Green)));
        let figure = Figure::new("", "", "").panel(panel);
        let kinds: Vec<MarkKind> = entries(&figure).iter().map(|mark| mark.kind).collect();
        assert_eq!(kinds, [MarkKind::Line, MarkKind::Points]);
    }
}
