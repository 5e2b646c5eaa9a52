//! The legend: one or more lines above the panels.

use super::drawing::{Anchor, Frame, Point, Primitive, Stroke, Words};
use super::figure::Figure;
use super::panel::{EDGE, SIZE, SPAN, band_opacity};
use super::plot_mark::{Dash, Mark, MarkKind};
use crate::report::text;

/// Length of the sample beside a label.
const SAMPLE: f64 = 28.0;
const SAMPLE_GAP: f64 = 6.0;
const ENTRY_GAP: f64 = 18.0;
const ROW: f64 = 18.0;

/// The marks in the legend: labelled marks, those with equal label and colour once, by their curve if they have one.
pub(super) fn entries(figure: &Figure) -> Vec<&Mark> {
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

/// Draws the legend from `left`, `top` on, within a width; returns the shapes and their height.
pub(super) fn draw(entries: &[&Mark], left: f64, top: f64, width: f64) -> (Vec<Primitive>, f64) {
    let places = places(entries, width);
    let mut shapes = Vec::new();
    for (mark, (x, row)) in entries.iter().zip(&places) {
        let (x, y) = (left + x, top + (*row as f64 + 0.5) * ROW);
        shapes.extend(sample(mark, (x, y)));
        let room = width - SAMPLE - SAMPLE_GAP;
        let at = (x + SAMPLE + SAMPLE_GAP, y);
        let size = text::fit(&mark.label, SIZE, room);
        let words = Words::new(at, mark.label.as_str(), size, Anchor::Start);
        shapes.push(Primitive::Text(words));
    }
    let rows = places.last().map_or(0, |(_, row)| row + 1);
    (shapes, rows as f64 * ROW)
}

/// Horizontal position and row of each entry: side by side if they fit, else in equal columns.
fn places(entries: &[&Mark], width: f64) -> Vec<(f64, usize)> {
    let need = |mark: &&Mark| SAMPLE + SAMPLE_GAP + text::width(&mark.label, SIZE) + ENTRY_GAP;
    let needs: Vec<f64> = entries.iter().map(need).collect();
    if needs.iter().sum::<f64>() <= width + ENTRY_GAP {
        let starts = needs.iter().scan(0.0, |end, need| {
            *end += need;
            Some((*end - need, 0))
        });
        return starts.collect();
    }
    let widest = needs
        .iter()
        .fold(0.0, |widest: f64, &need| widest.max(need));
    let columns = (((width + ENTRY_GAP) / widest) as usize).max(1);
    // The same number of rows with the entries spread evenly over them.
    let columns = entries.len().div_ceil(entries.len().div_ceil(columns));
    let place = |index| ((index % columns) as f64 * widest, index / columns);
    (0..entries.len()).map(place).collect()
}

/// A sample of a mark, with its left end at a point at mid-height of the row.
fn sample(mark: &Mark, (x, y): Point) -> Vec<Primitive> {
    let line = vec![(x, y), (x + SAMPLE, y)];
    let block = |ink| {
        let (left, top) = (x, y - 0.4 * SIZE);
        let frame = Frame {
            left,
            top,
            width: SAMPLE,
            height: 0.8 * SIZE,
        };
        vec![Primitive::Area(frame.corners(), ink)]
    };
    let stroke = Stroke::of(&mark.style);
    match mark.kind {
        MarkKind::Line | MarkKind::Stems | MarkKind::Across | MarkKind::Upright => {
            vec![Primitive::Path(line, Stroke::of_curve(&mark.style))]
        }
        MarkKind::Points => {
            let dot =
                |share| Primitive::Dot((x + share * SAMPLE, y), stroke.width / 2.0, stroke.ink);
            vec![dot(0.2), dot(0.5), dot(0.8)]
        }
        MarkKind::Band if mark.style.dash != Dash::Solid => {
            let edge = |dy| {
                let ends = vec![(x, y + dy), (x + SAMPLE, y + dy)];
                let stroke = Stroke {
                    width: EDGE,
                    ..stroke
                };
                Primitive::Path(ends, stroke)
            };
            let mut shapes = block(stroke.ink.opacity(band_opacity(&mark.style)));
            shapes.extend([-0.4 * SIZE, 0.4 * SIZE].map(edge));
            shapes
        }
        MarkKind::Band => block(stroke.ink.opacity(band_opacity(&mark.style))),
        MarkKind::Span => block(SPAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Colour, Panel, Style};

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

    /// Pointwise and simultaneous bands differ without colours: by edges and tone.
    #[test]
    fn a_dashed_band_has_edges() {
        let t = [0.0, 1.0];
        let plain = Mark::band("", &t, &t, &t, Colour::Grey);
        let edged = plain.clone().dash(Dash::Dashed);
        assert_eq!(sample(&plain, (0.0, 0.0)).len(), 1);
        assert_eq!(sample(&edged, (0.0, 0.0)).len(), 3);
        assert!(band_opacity(&edged.style) < band_opacity(&plain.style));
    }
}
