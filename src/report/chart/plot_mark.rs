//! Marks of a panel (curves, dots, bands, spans, reference lines) and their style.

/// The colours of Okabe and Ito, distinguishable with any colour vision, and a grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Colour {
    Black,
    Blue,
    Vermillion,
    Green,
    Purple,
    Orange,
    Sky,
    Grey,
}

impl Colour {
    /// All colours, in the order in which series take them.
    pub const ALL: [Colour; 8] = [
        Colour::Blue,
        Colour::Vermillion,
        Colour::Green,
        Colour::Purple,
        Colour::Orange,
        Colour::Sky,
        Colour::Black,
        Colour::Grey,
    ];

    /// Red, green and blue in hexadecimal digits.
    pub(super) fn hex(self) -> &'static str {
        match self {
            Colour::Black => "#000000",
            Colour::Blue => "#0072B2",
            Colour::Vermillion => "#D55E00",
            Colour::Green => "#009E73",
            Colour::Purple => "#CC79A7",
            Colour::Orange => "#E69F00",
            Colour::Sky => "#56B4E9",
            Colour::Grey => "#A8A8A8",
        }
    }

    /// The colour of series `index`, from 0; starts again after the last.
    pub fn nth(index: usize) -> Self {
        Self::ALL[index % Self::ALL.len()]
    }
}

/// Dash pattern of a line, so that series differ in grey print as well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Dash {
    Solid,
    Dashed,
    Dotted,
    DashDot,
}

impl Dash {
    /// The pattern of series `index`, from 0; starts again after the last.
    pub fn nth(index: usize) -> Self {
        [Self::Solid, Self::Dashed, Self::DashDot, Self::Dotted][index % 4]
    }

    /// Lengths of dashes and gaps in pixels.
    pub(super) fn lengths(self) -> &'static str {
        match self {
            Dash::Solid => "",
            Dash::Dashed => "6 3.2",
            Dash::Dotted => "1.6 2.2",
            Dash::DashDot => "7 2.6 1.6 2.6",
        }
    }
}

/// Style of a line or of points; for points `width` is the diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Colour.
    pub colour: Colour,
    /// Dash pattern of a line, and of the edges of a band; a band with solid style has no edges. Points ignore it.
    pub dash: Dash,
    /// Width in pixels, from 0.1 to 20; a figure is 680 pixels (180 mm) wide.
    pub width: f64,
}

impl Style {
    /// A solid line, 1.5 pixels wide.
    pub fn new(colour: Colour) -> Self {
        Self {
            colour,
            dash: Dash::Solid,
            width: 1.5,
        }
    }

    /// The style of series `index`, from 0: its colour and dash pattern.
    pub fn nth(index: usize) -> Self {
        Self::new(Colour::nth(index)).dash(Dash::nth(index))
    }

    /// Sets the dash pattern.
    #[must_use]
    pub fn dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }

    /// Sets the width in pixels.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = width.clamp(0.1, 20.0);
        self
    }
}

/// Kind of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// A curve through the points in their order.
    Line,
    /// A dot at each point.
    Points,
    /// A line from zero to each point.
    Stems,
    /// The area between two curves over the same x.
    Band,
    /// A shaded interval of x over the full height.
    Span,
    /// A line across the panel at one y.
    Across,
    /// A line from bottom to top at one x.
    Upright,
}

/// A mark in a panel. A mark with a label appears in the legend; equal labels with equal colour, in any panel, appear
/// there once.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Kind.
    pub kind: MarkKind,
    /// The label for the legend; empty for none.
    pub label: String,
    /// Style; spans ignore it.
    pub style: Style,
    /// x values; empty for a horizontal line.
    pub x: Vec<f64>,
    /// y values, for a band those of its lower edge; empty for a span or a vertical line.
    pub y: Vec<f64>,
    /// The upper edge of a band.
    pub high: Vec<f64>,
    /// True if points were removed that would be visible when zoomed.
    pub(super) is_thinned: bool,
}

impl Mark {
    fn new(kind: MarkKind, label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::of(kind, label, [x.to_vec(), y.to_vec()], style)
    }

    fn of(kind: MarkKind, label: impl Into<String>, [x, y]: [Vec<f64>; 2], style: Style) -> Self {
        Self {
            kind,
            label: label.into(),
            style,
            x,
            y,
            high: Vec::new(),
            is_thinned: false,
        }
    }

    /// True if points were removed that would be visible when zoomed.
    pub(in crate::report) fn is_thinned(&self) -> bool {
        self.is_thinned
    }

    /// Smallest and largest finite y; the first is infinite without any.
    pub(in crate::report) fn range(&self) -> [f64; 2] {
        let finite = self.y.iter().filter(|y| y.is_finite());
        finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| {
            [low.min(*y), high.max(*y)]
        })
    }

    /// A curve.
    pub fn line(label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::new(MarkKind::Line, label, x, y, style)
    }

    /// Dots.
    pub fn points(label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::new(MarkKind::Points, label, x, y, style.dash(Dash::Solid))
    }

    /// Dots at places that are no longer needed: a long record has few copies of its samples.
    pub fn points_of(label: impl Into<String>, positions: [Vec<f64>; 2], style: Style) -> Self {
        Self::of(MarkKind::Points, label, positions, style.dash(Dash::Solid))
    }

    /// Lines from zero to the points.
    pub fn stems(label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::new(MarkKind::Stems, label, x, y, style)
    }

    /// The area between `low` and `high`.
    pub fn band(
        label: impl Into<String>,
        x: &[f64],
        low: &[f64],
        high: &[f64],
        colour: Colour,
    ) -> Self {
        Self {
            high: high.to_vec(),
            ..Self::new(MarkKind::Band, label, x, low, Style::new(colour))
        }
    }

    /// A band between pairs of ends.
    pub fn band_of(label: &str, x: &[f64], ends: &[[f64; 2]], colour: Colour) -> Self {
        let [low, high] = sides(ends);
        Self::band(label, x, &low, &high, colour)
    }

    /// Sets the dash pattern.
    #[must_use]
    pub fn dash(mut self, dash: Dash) -> Self {
        self.style.dash = dash;
        self
    }

    /// A shaded interval of x.
    pub fn span(label: impl Into<String>, from: f64, to: f64) -> Self {
        Self::new(
            MarkKind::Span,
            label,
            &[from, to],
            &[],
            Style::new(Colour::Grey),
        )
    }

    /// A line at one y.
    pub fn horizontal(label: impl Into<String>, y: f64, style: Style) -> Self {
        Self::new(MarkKind::Across, label, &[], &[y], style)
    }

    /// A line at one x.
    pub fn vertical(label: impl Into<String>, x: f64, style: Style) -> Self {
        Self::new(MarkKind::Upright, label, &[x], &[], style)
    }
}
/// Lower and upper ends.
pub fn sides(ends: &[[f64; 2]]) -> [Vec<f64>; 2] {
    [0, 1].map(|side| ends.iter().map(|ends| ends[side]).collect())
}
