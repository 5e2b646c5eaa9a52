//! Drawing of one panel: grid, marks, axes.

use super::axis::{Axis, Ruler, Scale};
use super::elements::{SIZE, area, path, words};
use super::figure::Panel;
use super::plot_mark::{Dash, Mark, MarkKind, Style};
use crate::report::text::{self, escape};
use std::fmt::Write;

/// Font size of tick labels, and length of the short ticks, in pixels.
const TICK_SIZE: f64 = 11.0;
const SHORT: f64 = 3.0;
/// Room of the labels left of the axis.
const TICK_ROOM: f64 = 44.0;
/// Largest coordinate: points far outside the frame are moved closer to it.
const FAR: f64 = 20_000.0;

pub(super) const SPAN: &str = "#EEEEEE";
/// Opacity of a band; that of one with dashed edges is lower, so that bands differ without colours.
const BAND_OPACITY: f64 = 0.25;
const EDGED_OPACITY: f64 = 0.1;

/// A rectangle in pixels.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

/// Opacity of the area of a band.
pub(super) fn band_opacity(style: &Style) -> f64 {
    match style.dash {
        Dash::Solid => BAND_OPACITY,
        _ => EDGED_OPACITY,
    }
}

/// Writes a panel. The marks stand in a nested drawing, which clips them.
pub(super) fn draw(
    body: &mut String,
    panel: &Panel,
    frame: Frame,
    [x, y]: [Ruler; 2],
    has_labels: bool,
) {
    let Frame {
        left,
        top,
        width,
        height,
    } = frame;
    let axis = |name: &str, axis: &Axis, ruler: &Ruler| {
        let log = ruler.scale == Scale::Log;
        let (low, high) = ruler.range;
        let (label, unit) = (escape(&axis.label), escape(&axis.unit));
        format!(
            " data-{name}=\"{low:?} {high:?} {log}\" data-{name}label=\"{label}\" data-{name}unit=\"{unit}\""
        )
    };
    let _ = writeln!(
        body,
        "<g class=\"panel\" data-frame=\"{left} {top} {width} {height}\"{}{}>",
        axis("x", &panel.x, &x),
        axis("y", &panel.y, &y)
    );
    let title = text::fit(&panel.title, SIZE, 0.9 * width);
    let bold = " font-weight=\"bold\"";
    words(
        body,
        (left, top - 0.5 * SIZE - 5.0),
        &panel.title,
        title,
        bold,
    );
    let [bottom, right] = [top + height, left + width];
    let mut lines = [String::new(), String::new()];
    body.push_str("<g class=\"x\">\n");
    // As many labels as there is room for.
    let most = ((width / 45.0) as usize).clamp(2, 8);
    let is_narrow = |most: &usize| {
        let ticks = x.ticks(*most);
        let labels = ticks.iter().filter(|tick| !tick.label.is_empty());
        let widths = labels.clone().map(|tick| text::width(&tick.label, SIZE));
        widths.fold(0.0, f64::max) + SIZE < width / labels.count().max(1) as f64
    };
    let most = (2..=most).rev().find(is_narrow).unwrap_or(2);
    for tick in x.ticks(most) {
        let at = left + tick.share * width;
        if tick.label.is_empty() {
            lines[1] += &format!("M{at:.2} {bottom}v{}", -SHORT);
            continue;
        }
        lines[0] += &format!("M{at:.2} {bottom}V{top}");
        if has_labels {
            let position = (at, bottom + 8.0 + 0.5 * TICK_SIZE);
            words(
                body,
                position,
                &tick.label,
                TICK_SIZE,
                " text-anchor=\"middle\"",
            );
        }
    }
    body.push_str("</g>\n<g class=\"y\">\n");
    for tick in y.ticks((height / 33.0) as usize) {
        let at = bottom - tick.share * height;
        if tick.label.is_empty() {
            lines[1] += &format!("M{left} {at:.2}h{SHORT}");
            continue;
        }
        lines[0] += &format!("M{left} {at:.2}H{right}");
        let size = text::fit(&tick.label, TICK_SIZE, TICK_ROOM);
        words(
            body,
            (left - 5.0, at),
            &tick.label,
            size,
            " text-anchor=\"end\"",
        );
    }
    let _ = writeln!(
        body,
        "</g>\n<path class=\"grid\" fill=\"none\" stroke=\"#E4E4E4\" stroke-width=\"0.7\" d=\"{}\"/>",
        lines[0]
    );
    let _ = writeln!(
        body,
        "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         preserveAspectRatio=\"none\">"
    );
    let marks = Marks { x, y, frame };
    // Spans are behind all others.
    let is_span = |mark: &&Mark| mark.kind == MarkKind::Span;
    for mark in panel.marks.iter().filter(is_span) {
        marks.draw(body, mark);
    }
    for mark in panel.marks.iter().filter(|mark| !is_span(mark)) {
        marks.draw(body, mark);
    }
    let _ = writeln!(
        body,
        "</svg>\n<path class=\"frame\" fill=\"none\" stroke=\"#333333\" stroke-width=\"0.8\" d=\"M{left} {top}H{right}V{bottom}H{left}Z{}\"/>",
        lines[1]
    );
    if has_labels {
        let caption = panel.x.caption();
        let size = text::fit(&caption, SIZE, width);
        let at = (left + width / 2.0, bottom + 13.0 + TICK_SIZE + 0.6 * SIZE);
        words(body, at, &caption, size, " text-anchor=\"middle\"");
    }
    let caption = panel.y.caption();
    let size = text::fit(&caption, SIZE, height);
    let (x, y) = (left - TICK_ROOM - 1.1 * SIZE, top + height / 2.0);
    let turned = format!(" text-anchor=\"middle\" transform=\"rotate(270 {x:.2} {y:.2})\"");
    words(body, (x, y), &caption, size, &turned);
    body.push_str("</g>\n");
}

/// The coordinates of marks in the frame of their panel.
struct Marks {
    x: Ruler,
    y: Ruler,
    frame: Frame,
}

impl Marks {
    fn x(&self, value: f64) -> f64 {
        (self.x.share(value) * self.frame.width).clamp(-FAR, FAR)
    }

    fn y(&self, value: f64) -> f64 {
        ((1.0 - self.y.share(value)) * self.frame.height).clamp(-FAR, FAR)
    }

    fn points<'a>(&'a self, xs: &'a [f64], ys: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
        xs.iter().zip(ys).map(|(x, y)| (self.x(*x), self.y(*y)))
    }

    fn draw(&self, body: &mut String, mark: &Mark) {
        let Mark {
            style, x, y, high, ..
        } = mark;
        let label = match mark.label.as_str() {
            "" => String::new(),
            label => format!(" data-label=\"{}\"", escape(label)),
        };
        let kind = |name: &str| format!(" class=\"{name}\"{label}");
        match mark.kind {
            MarkKind::Line => path(body, &self.curve(x, y), style, &kind("line"), false),
            MarkKind::Points => {
                let mut d = String::new();
                for point in self.points(x, y).filter(is_drawable) {
                    push(&mut d, 'M', point);
                    d.push_str("h0");
                }
                path(body, &d, style, &kind("points"), true);
            }
            MarkKind::Stems => {
                let (mut d, foot) = (String::new(), self.y(0.0));
                for point in self.points(x, y).filter(is_drawable) {
                    push(&mut d, 'M', point);
                    let _ = write!(d, "V{foot:.2}");
                }
                path(body, &d, style, &kind("points"), false);
            }
            MarkKind::Band => {
                let edges: Vec<_> = self.points(x, y).zip(self.points(x, high)).collect();
                let mut d = String::new();
                let runs = edges.split(|(low, high)| !is_drawable(low) || !is_drawable(high));
                for run in runs.filter(|run| run.len() > 1) {
                    let outline = run.iter().map(|edge| edge.0);
                    let outline = outline.chain(run.iter().rev().map(|edge| edge.1));
                    for (i, point) in outline.enumerate() {
                        push(&mut d, if i == 0 { 'M' } else { 'L' }, point);
                    }
                    d.push('Z');
                }
                area(
                    body,
                    &d,
                    style.colour.hex(),
                    band_opacity(style),
                    &kind("band"),
                );
                if style.dash != Dash::Solid {
                    let d = self.curve(x, y) + &self.curve(x, high);
                    path(body, &d, &style.width(1.2), "", false);
                }
            }
            MarkKind::Span => {
                let [from, to] = [0, 1].map(|end| self.x(x[end]));
                if (from + to).is_finite() {
                    let d = format!("M{from:.2} 0H{to:.2}V{}H{from:.2}Z", self.frame.height);
                    area(body, &d, SPAN, 1.0, "");
                }
            }
            MarkKind::Across => {
                if let Some(y) = y.iter().map(|y| self.y(*y)).find(|y| y.is_finite()) {
                    let d = format!("M0 {y:.2}H{}", self.frame.width);
                    path(body, &d, style, "", false);
                }
            }
            MarkKind::Upright => {
                if let Some(x) = x.iter().map(|x| self.x(*x)).find(|x| x.is_finite()) {
                    let d = format!("M{x:.2} 0V{}", self.frame.height);
                    path(body, &d, style, "", false);
                }
            }
        }
    }

    /// A curve with its gaps; a point between two gaps is a dot.
    fn curve(&self, xs: &[f64], ys: &[f64]) -> String {
        let points: Vec<(f64, f64)> = self.points(xs, ys).collect();
        let (mut d, mut dots) = (String::new(), String::new());
        for run in points.split(|point| !is_drawable(point)) {
            if let [(x, y)] = run {
                let _ = write!(dots, "M{:.2} {y:.2}h2", x - 1.0);
            }
            for (i, point) in run.iter().enumerate().filter(|_| run.len() > 1) {
                push(&mut d, if i == 0 { 'M' } else { 'L' }, *point);
            }
        }
        d + &dots
    }
}

fn is_drawable((x, y): &(f64, f64)) -> bool {
    (x + y).is_finite()
}

/// Adds a point to a path, in hundredths of a pixel.
fn push(d: &mut String, command: char, (x, y): (f64, f64)) {
    let mut digits = itoa::Buffer::new();
    d.push(command);
    for (i, value) in [x, y].into_iter().enumerate() {
        let hundredths = (100.0 * value).round() as i64;
        if i == 1 {
            d.push(' ');
        }
        if hundredths < 0 {
            d.push('-');
        }
        d.push_str(digits.format(hundredths.abs() / 100));
        let rest = hundredths.abs() % 100;
        if rest > 0 {
            d.push('.');
            d.push(char::from(b'0' + (rest / 10) as u8));
            if rest % 10 > 0 {
                d.push(char::from(b'0' + (rest % 10) as u8));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_have_two_decimals() {
        let mut d = String::new();
        push(&mut d, 'M', (1.5, -0.004));
        push(&mut d, 'L', (-12.055, 100.0));
        assert_eq!(d, "M1.5 0L-12.06 100");
    }

    /// Gaps split a curve; a point between two of them is a short line.
    #[test]
    fn gaps_stay_gaps() {
        let ruler = Ruler {
            scale: Scale::Linear,
            range: (0.0, 10.0),
        };
        let frame = Frame {
            left: 0.0,
            top: 0.0,
            width: 10.0,
            height: 10.0,
        };
        let marks = Marks {
            x: ruler,
            y: ruler,
            frame,
        };
        let nan = f64::NAN;
        let d = marks.curve(
            &[0.0, 1.0, 2.0, 3.0, 4.0],
            &[1.0, 2.0, nan, 4.0, f64::INFINITY],
        );
        assert_eq!(d, "M0 9L1 8M2.00 6.00h2");
    }
}
