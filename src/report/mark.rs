//! What a panel shows: curves, dots, bands, lines across, and how they look.

/// The colours of Okabe and Ito, which readers with any colour vision can tell apart, and a grey.
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
}

/// How a line is drawn, or points, of which `width` is the diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Colour.
    pub colour: Colour,
    /// Dash pattern; points ignore it.
    pub dash: Dash,
    /// Width in pixels; a figure is 680 pixels (180 mm) wide.
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

    /// The look of series `index`, from 0: a colour and a dash pattern of its own.
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
        self.width = width;
        self
    }
}

/// Something drawn in a panel. A mark with a label appears in the legend; equal labels with equal
/// looks, in any panel, appear there once.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub enum Mark {
    /// A curve through the points in their order.
    Line {
        label: String,
        x: Vec<f64>,
        y: Vec<f64>,
        style: Style,
    },
    /// A dot at each point.
    Points {
        label: String,
        x: Vec<f64>,
        y: Vec<f64>,
        style: Style,
    },
    /// The area between two curves over the same x.
    Band {
        label: String,
        x: Vec<f64>,
        low: Vec<f64>,
        high: Vec<f64>,
        colour: Colour,
    },
    /// A shaded interval of x over the full height.
    Span { label: String, from: f64, to: f64 },
    /// A line across the panel at one y.
    HorizontalLine { label: String, y: f64, style: Style },
    /// A line from bottom to top at one x.
    VerticalLine { label: String, x: f64, style: Style },
}

impl Mark {
    /// A curve.
    pub fn line(label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::Line {
            label: label.into(),
            x: x.to_vec(),
            y: y.to_vec(),
            style,
        }
    }

    /// Dots.
    pub fn points(label: impl Into<String>, x: &[f64], y: &[f64], style: Style) -> Self {
        Self::Points {
            label: label.into(),
            x: x.to_vec(),
            y: y.to_vec(),
            style,
        }
    }

    /// The area between `low` and `high`.
    pub fn band(
        label: impl Into<String>,
        x: &[f64],
        low: &[f64],
        high: &[f64],
        colour: Colour,
    ) -> Self {
        Self::Band {
            label: label.into(),
            x: x.to_vec(),
            low: low.to_vec(),
            high: high.to_vec(),
            colour,
        }
    }

    /// A shaded interval of x.
    pub fn span(label: impl Into<String>, from: f64, to: f64) -> Self {
        Self::Span {
            label: label.into(),
            from,
            to,
        }
    }

    /// A line at one y.
    pub fn horizontal(label: impl Into<String>, y: f64, style: Style) -> Self {
        Self::HorizontalLine {
            label: label.into(),
            y,
            style,
        }
    }

    /// A line at one x.
    pub fn vertical(label: impl Into<String>, x: f64, style: Style) -> Self {
        Self::VerticalLine {
            label: label.into(),
            x,
            style,
        }
    }

    /// The label for the legend; empty for none.
    pub fn label(&self) -> &str {
        match self {
            Self::Line { label, .. }
            | Self::Points { label, .. }
            | Self::Band { label, .. }
            | Self::Span { label, .. }
            | Self::HorizontalLine { label, .. }
            | Self::VerticalLine { label, .. } => label,
        }
    }

    /// The x values that the axis should reach.
    pub(super) fn x_values(&self) -> Vec<f64> {
        match self {
            Self::Line { x, .. } | Self::Points { x, .. } | Self::Band { x, .. } => x.clone(),
            Self::Span { from, to, .. } => vec![*from, *to],
            Self::VerticalLine { x, .. } => vec![*x],
            Self::HorizontalLine { .. } => Vec::new(),
        }
    }

    /// The y values that the axis should reach.
    pub(super) fn y_values(&self) -> Vec<f64> {
        match self {
            Self::Line { y, .. } | Self::Points { y, .. } => y.clone(),
            Self::Band { low, high, .. } => [low.as_slice(), high].concat(),
            Self::HorizontalLine { y, .. } => vec![*y],
            Self::Span { .. } | Self::VerticalLine { .. } => Vec::new(),
        }
    }
}
