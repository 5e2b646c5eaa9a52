//! The data model of a figure: panels, axes and marks, independent of the renderer.
//!
//! Values that cannot be drawn (not finite, or not positive on a logarithmic axis) leave gaps. If `x` and `y` differ in
//! length, the excess values are ignored.

use super::axis::Axis;
use super::plot_mark::{Mark, MarkKind};
use super::thin::thinned;

/// Ranges below this share of the largest value are rounding errors.
const ROUNDING: f64 = 1e-9;

/// One figure: a grid of panels with a common legend above them.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File stem, as in `convergence` for `convergence.svg`.
    pub name: String,
    /// Title in the metadata of the file; it is not drawn, because captions belong to the surrounding text.
    pub title: String,
    /// Description for screen readers.
    pub description: String,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels side by side in one row, at least 1.
    pub columns: usize,
}

impl Figure {
    /// A figure without panels, in one column.
    pub fn new(
        name: impl Into<String>,
        title: impl Into<String>,
        description: impl Into<String>,
    ) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            description: description.into(),
            panels: Vec::new(),
            columns: 1,
        }
    }

    /// Sets the number of panels in one row.
    #[must_use]
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns.max(1);
        self
    }

    /// Adds a panel.
    #[must_use]
    pub fn panel(self, panel: Panel) -> Self {
        self.panels([panel])
    }

    /// The figure without the panels of constants; `None` where no panel is left.
    pub(in crate::report) fn varying(mut self) -> Option<Self> {
        self.panels.retain(|panel| !panel.is_constant());
        (!self.panels.is_empty()).then_some(self)
    }

    /// Adds panels.
    #[must_use]
    pub fn panels(mut self, panels: impl IntoIterator<Item = Panel>) -> Self {
        self.panels.extend(panels);
        self
    }
}

/// One pair of axes with its marks; later marks lie on top of earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Heading above the panel; none where empty.
    pub title: String,
    /// Horizontal axis. Equal axes in one column share their range, and the lowest has the labels.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Marks, from back to front.
    pub marks: Vec<Mark>,
}

impl Panel {
    /// An empty panel without a heading.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            x,
            y,
            marks: Vec::new(),
        }
    }

    /// True if each curve, and each edge of a band, has one value only.
    pub(in crate::report) fn is_constant(&self) -> bool {
        let is_level = |values: &[f64]| {
            let finite = values.iter().filter(|y| y.is_finite());
            let low = finite.clone().copied().fold(f64::INFINITY, f64::min);
            let high = finite.copied().fold(f64::NEG_INFINITY, f64::max);
            high - low <= ROUNDING * low.abs().max(high.abs())
        };
        let mut curves = self.marks.iter().filter(|mark| match mark.kind {
            MarkKind::Line => true,
            MarkKind::Band => !mark.y.is_empty(),
            _ => false,
        });
        curves.all(|mark| is_level(&mark.y) && (mark.high.is_empty() || is_level(&mark.high)))
    }

    /// Sets the heading.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// An empty panel of a quantity against time.
    pub fn of_time(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self::new(Axis::linear("time t", "s"), Axis::linear(label, unit))
    }

    /// Adds a mark.
    #[must_use]
    pub fn mark(self, mark: Mark) -> Self {
        self.marks([mark])
    }

    /// Adds marks; an `Option` adds at most one. Long ones are thinned for the scales of the axes.
    #[must_use]
    pub fn marks(mut self, marks: impl IntoIterator<Item = Mark>) -> Self {
        let scales = [self.x.scale, self.y.scale];
        self.marks
            .extend(marks.into_iter().map(|mark| thinned(mark, scales)));
        self
    }
}
