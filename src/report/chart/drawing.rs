//! Primitives of a drawing in pixels; origin at the upper left corner, x to the right, y downward.

use super::plot_mark::{Colour, Dash, Style};

/// A position in pixels.
pub(super) type Point = (f64, f64);

/// A colour with its opacity, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ink {
    pub rgb: (u8, u8, u8),
    pub opacity: f64,
}

impl Ink {
    pub const fn solid(rgb: (u8, u8, u8)) -> Self {
        Self { rgb, opacity: 1.0 }
    }

    pub fn of(colour: Colour) -> Self {
        Self::solid(match colour {
            Colour::Black => (0, 0, 0),
            Colour::Blue => (0, 114, 178),
            Colour::Vermillion => (213, 94, 0),
            Colour::Green => (0, 158, 115),
            Colour::Purple => (204, 121, 167),
            Colour::Orange => (230, 159, 0),
            Colour::Sky => (86, 180, 233),
            Colour::Grey => (168, 168, 168),
        })
    }

    pub fn opacity(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

/// Thinnest and thickest curve in pixels: 0.5 and 1 pt.
const THINNEST: f64 = 96.0 / 72.0 / 2.0;
const THICKEST: f64 = 96.0 / 72.0;

/// Stroke of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub ink: Ink,
    pub width: f64,
    pub dash: Dash,
}

impl Stroke {
    pub fn solid(ink: Ink, width: f64) -> Self {
        Self {
            ink,
            width,
            dash: Dash::Solid,
        }
    }

    /// Of a curve in print: 0.5 to 1 pt wide.
    pub fn of_curve(style: &Style) -> Self {
        let stroke = Self::of(style);
        Self {
            width: stroke.width.clamp(THINNEST, THICKEST),
            ..stroke
        }
    }

    /// Of dots, whose diameter is the width.
    pub fn of(style: &Style) -> Self {
        Self {
            ink: Ink::of(style.colour),
            width: style.width,
            dash: style.dash,
        }
    }
}

/// Horizontal alignment of a text at its position; vertically it is centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Words {
    pub at: Point,
    pub text: String,
    pub size: f64,
    pub anchor: Anchor,
    pub bold: bool,
    /// True for text rotated upward, as beside a vertical axis.
    pub upward: bool,
}

impl Words {
    pub fn new(at: Point, text: impl Into<String>, size: f64, anchor: Anchor) -> Self {
        Self {
            at,
            text: text.into(),
            size,
            anchor,
            bold: false,
            upward: false,
        }
    }
}

/// A primitive of a drawing.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Primitive {
    Path(Vec<Point>, Stroke),
    Area(Vec<Point>, Ink),
    Dot(Point, f64, Ink),
    Text(Words),
}

/// A rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The corners, in order around the rectangle.
    pub fn corners(&self) -> Vec<Point> {
        let (left, top, right, bottom) = (self.left, self.top, self.right(), self.bottom());
        vec![(left, top), (right, top), (right, bottom), (left, bottom)]
    }
}

/// A finished drawing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sheet {
    pub width: f64,
    pub height: f64,
    pub shapes: Vec<Primitive>,
}
