//! The data model of a figure: panels, axes and marks, independent of the renderer.
//!
//! Values that cannot be drawn (not finite, or not positive on a logarithmic axis) leave gaps. If `x` and `y` differ in
//! length, the excess values are ignored.

use super::axis::Axis;
use super::plot_mark::{Mark, MarkKind};
use super::thin::{Detail, thinned};
use serde::Serialize;

/// Ranges below this share of the largest value are rounding errors.
const ROUNDING: f64 = 1e-9;

/// Width of a figure in print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureWidth {
    /// One column of a journal, 85 mm; the panels stand below each other.
    Single,
    /// Two columns, 180 mm.
    Double,
}

impl FigureWidth {
    /// Both widths.
    pub const ALL: [Self; 2] = [Self::Single, Self::Double];

    /// Width in mm.
    pub fn millimetres(self) -> u32 {
        match self {
            Self::Single => 85,
            Self::Double => 180,
        }
    }
}

/// One figure: a grid of panels with a common legend above them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// File stem, as in `convergence` for `convergence.svg`.
    #[serde(skip)]
    pub name: String,
    /// Title in the metadata of the file; it is not drawn, because captions belong to the surrounding text.
    #[serde(skip)]
    pub title: String,
    /// Description for screen readers.
    #[serde(skip)]
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

    /// The figure with its curves thinned to a detail.
    pub(in crate::report) fn thinned(mut self, detail: Detail) -> Self {
        for panel in &mut self.panels {
            let scales = [panel.x.scale, panel.y.scale];
            let marks = std::mem::take(&mut panel.marks).into_iter();
            panel.marks = marks.map(|mark| thinned(mark, scales, 0, detail)).collect();
        }
        self
    }

    /// Adds panels.
    #[must_use]
    pub fn panels(mut self, panels: impl IntoIterator<Item = Panel>) -> Self {
        self.panels.extend(panels);
        self
    }
}

/// One pair of axes with its marks; later marks lie on top of earlier ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Heading above the panel; none where empty.
    pub title: String,
    /// Horizontal axis. Equal axes in one column share their range and labels.
    pub x: Axis,
    /// Vertical axis. Equal axes in one row share their range and labels.
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
        let marks = marks
            .into_iter()
            .map(|mark| thinned(mark, scales, Detail::FULL.few, Detail::FULL));
        self.marks.extend(marks);
        self
    }
}
