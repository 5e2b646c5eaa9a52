//! Rendering of one panel: grid, marks, axes.

use super::axis::Ruler;
use super::curve;
use super::drawing::{Anchor, Frame, Ink, Point, Primitive, Stroke, Words};
use super::figure::Panel;
use super::plot_mark::{Dash, Mark, MarkKind, Style};
use crate::report::text;

/// Font size of labels and ticks, in pixels.
pub(super) const SIZE: f64 = 12.0;
const TICK_SIZE: f64 = 11.0;
const TICK: f64 = 4.5;
const MINOR_TICK: f64 = 2.5;
/// Gap between ticks, their labels and the axis label.
const GAP: f64 = 5.0;
/// Most points drawn as dots; more overlap and are drawn as a thick thinned line.
const MOST_DOTS: usize = 2000;

const AXIS: Ink = Ink::solid((51, 51, 51));
const GRID: Ink = Ink::solid((228, 228, 228));
pub(super) const SPAN: Ink = Ink::solid((238, 238, 238));
/// Opacity of a band; that of one with dashed edges is lower, so that bands differ without colours.
const BAND_OPACITY: f64 = 0.25;
const EDGED_OPACITY: f64 = 0.1;
/// Width of the dashed edges of a band, in pixels.
pub(super) const EDGE: f64 = 1.2;

/// A panel with its frame and rulers.
pub(super) struct Placed<'a> {
    pub panel: &'a Panel,
    pub frame: Frame,
    pub x: Ruler,
    pub y: Ruler,
    /// True if tick labels and axis label are drawn; false if the panel below has them.
    pub x_labels: bool,
    /// The same for the vertical axis and the panel to the left.
    pub y_labels: bool,
    /// Width of the labels left of the frame, common to a column so that its axis labels align.
    pub label_width: f64,
}

/// Opacity of the area of a band.
pub(super) fn band_opacity(style: &Style) -> f64 {
    match style.dash {
        Dash::Solid => BAND_OPACITY,
        _ => EDGED_OPACITY,
    }
}

/// Height needed below a frame for the labels of the horizontal axis.
pub(super) fn label_height(labels: bool) -> f64 {
    if labels {
        TICK + 2.0 * GAP + TICK_SIZE + SIZE + 2.0
    } else {
        TICK
    }
}

/// Width needed left of a frame for the labels of the vertical axis.
pub(super) fn label_width(ruler: &Ruler, labels: bool) -> f64 {
    if labels {
        TICK + 2.0 * GAP + ruler.widest(TICK_SIZE) + SIZE + 2.0
    } else {
        TICK
    }
}

impl Placed<'_> {
    /// All primitives of the panel, from back to front.
    pub fn shapes(&self) -> Vec<Primitive> {
        let mut shapes = Vec::new();
        self.spans(&mut shapes);
        self.grid(&mut shapes);
        for mark in &self.panel.marks {
            self.mark(mark, &mut shapes);
        }
        self.axes(&mut shapes);
        self.titles(&mut shapes);
        shapes
    }

    fn x_pixel(&self, share: f64) -> f64 {
        self.frame.left + share * self.frame.width
    }

    fn y_pixel(&self, share: f64) -> f64 {
        self.frame.bottom() - share * self.frame.height
    }

    fn pixel(&self, x: f64, y: f64) -> Point {
        (self.x_pixel(self.x.share(x)), self.y_pixel(self.y.share(y)))
    }

    fn pixels<'b>(&'b self, x: &'b [f64], y: &'b [f64]) -> impl Iterator<Item = Point> + 'b {
        x.iter().zip(y).map(|(&x, &y)| self.pixel(x, y))
    }

    /// Draws spans; they are behind the grid regardless of their order among the marks.
    fn spans(&self, shapes: &mut Vec<Primitive>) {
        for mark in (self.panel.marks.iter()).filter(|mark| mark.kind == MarkKind::Span) {
            let [from, to] = [0, 1].map(|end| self.x.share(mark.x[end]));
            if from.is_nan() || to.is_nan() {
                continue;
            }
            let left = self.x_pixel(from.min(to).clamp(0.0, 1.0));
            let area = Frame {
                left,
                width: self.x_pixel(from.max(to).clamp(0.0, 1.0)) - left,
                ..self.frame
            };
            shapes.push(Primitive::Area(area.corners(), SPAN));
        }
    }

    fn grid(&self, shapes: &mut Vec<Primitive>) {
        let stroke = Stroke::solid(GRID, 0.67);
        for tick in &self.x.major {
            shapes.push(self.rule_at_x(tick.share, stroke));
        }
        for tick in &self.y.major {
            shapes.push(self.rule_at_y(tick.share, stroke));
        }
    }

    fn rule_at_x(&self, share: f64, stroke: Stroke) -> Primitive {
        let x = self.x_pixel(share);
        Primitive::Path(vec![(x, self.frame.bottom()), (x, self.frame.top)], stroke)
    }

    fn rule_at_y(&self, share: f64, stroke: Stroke) -> Primitive {
        let y = self.y_pixel(share);
        Primitive::Path(vec![(self.frame.left, y), (self.frame.right(), y)], stroke)
    }

    fn mark(&self, mark: &Mark, shapes: &mut Vec<Primitive>) {
        let stroke = Stroke::of_curve(&mark.style);
        let is_inside = |share: &f64| (0.0..=1.0).contains(share);
        match mark.kind {
            MarkKind::Points if mark.x.len().min(mark.y.len()) <= MOST_DOTS => {
                let dots = self.pixels(&mark.x, &mark.y);
                dots.for_each(|dot| self.dot(dot, &mark.style, shapes));
            }
            MarkKind::Line | MarkKind::Points => self.line(mark, shapes),
            MarkKind::Stems => self.stems(mark, shapes),
            MarkKind::Band => self.band(mark, shapes),
            MarkKind::Span => {}
            MarkKind::Across => {
                let share = mark.y.iter().map(|y| self.y.share(*y)).find(is_inside);
                shapes.extend(share.map(|share| self.rule_at_y(share, stroke)));
            }
            MarkKind::Upright => {
                let share = mark.x.iter().map(|x| self.x.share(*x)).find(is_inside);
                shapes.extend(share.map(|share| self.rule_at_x(share, stroke)));
            }
        }
    }

    fn line(&self, mark: &Mark, shapes: &mut Vec<Primitive>) {
        let Mark { x, y, style, .. } = mark;
        let stroke = match mark.kind {
            MarkKind::Points => Stroke::of(style),
            _ => Stroke::of_curve(style),
        };
        for run in curve::runs(self.pixels(x, y)) {
            // A point between two gaps has no line segment and is drawn as a dot.
            if let [alone] = run[..] {
                self.dot(alone, &style.width(2.0 * style.width), shapes);
            }
            for piece in curve::clip(&curve::thin(&run), &self.frame) {
                shapes.push(Primitive::Path(piece, stroke));
            }
        }
    }

    fn stems(&self, Mark { x, y, style, .. }: &Mark, shapes: &mut Vec<Primitive>) {
        for (foot, head) in x
            .iter()
            .zip(y)
            .map(|(x, y)| (self.pixel(*x, 0.0), self.pixel(*x, *y)))
        {
            if (foot.0 + foot.1 + head.1).is_finite() {
                let pieces = curve::clip(&[foot, head], &self.frame);
                let stroke = Stroke::of_curve(style);
                shapes.extend(
                    pieces
                        .into_iter()
                        .map(|piece| Primitive::Path(piece, stroke)),
                );
            }
        }
    }

    fn dot(&self, point: Point, style: &Style, shapes: &mut Vec<Primitive>) {
        if curve::inside(point, &self.frame) {
            let stroke = Stroke::of(style);
            shapes.push(Primitive::Dot(point, stroke.width / 2.0, stroke.ink));
        }
    }

    fn band(&self, mark: &Mark, shapes: &mut Vec<Primitive>) {
        let ink = Ink::of(mark.style.colour).opacity(band_opacity(&mark.style));
        let stroke = Stroke {
            width: EDGE,
            ..Stroke::of(&mark.style)
        };
        let low = self.pixels(&mark.x, &mark.y);
        let edges: Vec<_> = low.zip(self.pixels(&mark.x, &mark.high)).collect();
        let drawable = |(low, high): &(Point, Point)| (low.0 + low.1 + high.1).is_finite();
        let runs = edges.split(|edge| !drawable(edge));
        for run in runs.filter(|run| run.len() > 1) {
            let edge = |of: fn(&(Point, Point)) -> Point| {
                let path = curve::thin(&run.iter().map(of).collect::<Vec<_>>());
                path.into_iter()
                    .map(|point| curve::clamp(point, &self.frame))
            };
            let outline = edge(|edge| edge.0).chain(edge(|edge| edge.1).rev());
            shapes.push(Primitive::Area(outline.collect(), ink));
            if mark.style.dash == Dash::Solid {
                continue;
            }
            for of in [|e: &(Point, Point)| e.0, |e: &(Point, Point)| e.1] {
                let path: Vec<Point> = run.iter().map(of).collect();
                let pieces = curve::clip(&curve::thin(&path), &self.frame).into_iter();
                shapes.extend(pieces.map(|piece| Primitive::Path(piece, stroke)));
            }
        }
    }

    fn axes(&self, shapes: &mut Vec<Primitive>) {
        let stroke = Stroke::solid(AXIS, 0.8);
        let mut outline = self.frame.corners();
        outline.push(outline[0]);
        shapes.push(Primitive::Path(outline, stroke));
        let Frame { left, .. } = self.frame;
        let bottom = self.frame.bottom();
        let x_tick = |share: f64, length: f64| {
            let x = self.x_pixel(share);
            Primitive::Path(vec![(x, bottom), (x, bottom + length)], stroke)
        };
        let y_tick = |share: f64, length: f64| {
            let y = self.y_pixel(share);
            Primitive::Path(vec![(left, y), (left - length, y)], stroke)
        };
        for tick in &self.x.major {
            shapes.push(x_tick(tick.share, TICK));
            if self.x_labels {
                let at = (
                    self.x_pixel(tick.share),
                    bottom + TICK + GAP + TICK_SIZE / 2.0,
                );
                shapes.push(words(at, &tick.label, TICK_SIZE, Anchor::Middle));
            }
        }
        for tick in &self.y.major {
            shapes.push(y_tick(tick.share, TICK));
            if self.y_labels {
                let at = (left - TICK - GAP, self.y_pixel(tick.share));
                shapes.push(words(at, &tick.label, TICK_SIZE, Anchor::End));
            }
        }
        shapes.extend(self.x.minor.iter().map(|share| x_tick(*share, MINOR_TICK)));
        shapes.extend(self.y.minor.iter().map(|share| y_tick(*share, MINOR_TICK)));
    }

    /// Axis labels and heading, reduced in size where they would overlap a neighbour.
    fn titles(&self, shapes: &mut Vec<Primitive>) {
        let Frame {
            left,
            top,
            width,
            height,
        } = self.frame;
        if self.x_labels {
            let y = self.frame.bottom() + label_height(true) - SIZE / 2.0;
            let caption = self.panel.x.caption();
            let size = text::fit(&caption, SIZE, width);
            let at = (left + width / 2.0, y);
            shapes.push(words(at, &caption, size, Anchor::Middle));
        }
        if self.y_labels {
            let caption = self.panel.y.caption();
            let size = text::fit(&caption, SIZE, height);
            let at = (left - self.label_width + SIZE / 2.0, top + height / 2.0);
            let caption = Words::new(at, caption, size, Anchor::Middle);
            shapes.push(Primitive::Text(Words {
                upward: true,
                ..caption
            }));
        }
        let size = text::fit(&self.panel.title, SIZE, 0.9 * width);
        let at = (left, top - 0.5 * SIZE - GAP);
        let title = Words::new(at, self.panel.title.as_str(), size, Anchor::Start);
        shapes.push(Primitive::Text(Words {
            bold: true,
            ..title
        }));
    }
}

fn words(at: Point, text: &str, size: f64, anchor: Anchor) -> Primitive {
    Primitive::Text(Words::new(at, text, size, anchor))
}
