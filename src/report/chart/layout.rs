//! Layout of the panels and the legend of a figure.

use super::axis::{self, Axis, Range, Ruler, Scale};
use super::drawing::{Frame, Sheet};
use super::figure::{Figure, FigureWidth, Panel};
use super::legend;
use super::panel::{Placed, SIZE, label_height, label_width};

/// Pixels of a millimetre: 96 to the inch.
const PIXELS: f64 = 96.0 / 25.4;
/// Blank edge around everything.
const EDGE: f64 = 8.0;
/// Margin right of the last column, for a tick label that extends beyond its axis.
const RIGHT: f64 = 10.0;
/// Gap between neighbouring columns and rows, beside their labels.
const COLUMN_GAP: f64 = 24.0;
const ROW_GAP: f64 = 7.0;
/// Least width of the axes.
const NARROWEST: f64 = 60.0;
const TITLE: f64 = 1.6 * SIZE;
/// Height of the axes in pixels: alone, alone in one column of a journal, side by side, and in a stack.
const ALONE: f64 = 320.0;
const ALONE_SINGLE: f64 = 220.0;
const BESIDE: f64 = 260.0;
const STACKED: f64 = 165.0;

/// Draws a figure.
pub(super) fn sheet(figure: &Figure, width: FigureWidth) -> Sheet {
    let grid = PanelGrid::new(figure, width);
    let rulers: Vec<Ruler> = (0..figure.panels.len()).map(|i| grid.y_ruler(i)).collect();
    let columns = grid.columns(&rulers);
    let left = columns.first().map_or(EDGE, |column| column.left);
    let entries = legend::entries(figure);
    let (mut shapes, height) = legend::draw(&entries, left, EDGE, grid.width - RIGHT - EDGE - left);
    let mut top = EDGE + height + if height > 0.0 { 6.0 } else { 0.0 };
    for row in 0..grid.rows() {
        top += grid.title_height(row);
        for (index, _) in grid.row(row) {
            let column = &columns[index % grid.columns];
            let placed = grid.place(index, column, top, rulers[index].clone());
            shapes.extend(placed.shapes());
        }
        top += grid.height() + grid.footer_height(row);
    }
    let right = columns
        .last()
        .map_or(0.0, |column| column.left + column.width);
    Sheet {
        width: (right + RIGHT + EDGE).max(grid.width),
        height: (top + EDGE).ceil(),
        shapes,
    }
}

/// A column of panels, in pixels.
struct PanelColumn {
    /// Width of the labels left of the axes.
    labels: f64,
    /// Left edge of the axes.
    left: f64,
    /// Width of the axes.
    width: f64,
}

/// The panels in rows and columns, with their ranges.
struct PanelGrid<'a> {
    panels: &'a [Panel],
    columns: usize,
    width: f64,
    x: Vec<Option<Range>>,
    y: Vec<Option<Range>>,
}

impl<'a> PanelGrid<'a> {
    fn new(figure: &'a Figure, width: FigureWidth) -> Self {
        let panels = figure.panels.as_slice();
        let extents = |of: &dyn Fn(&'a Panel) -> (Scale, Vec<f64>)| {
            let extent = |panel| {
                let (scale, values) = of(panel);
                axis::extent(scale, &values)
            };
            panels.iter().map(extent).collect()
        };
        Self {
            panels,
            columns: match width {
                FigureWidth::Single => 1,
                FigureWidth::Double => figure.columns.clamp(1, panels.len().max(1)),
            },
            width: PIXELS * f64::from(width.millimetres()),
            x: extents(&|p| {
                (
                    p.x.scale,
                    p.marks.iter().flat_map(|m| &m.x).copied().collect(),
                )
            }),
            y: extents(&|p| {
                let values = p.marks.iter().flat_map(|m| m.y.iter().chain(&m.high));
                (p.y.scale, values.copied().collect())
            }),
        }
    }

    fn rows(&self) -> usize {
        self.panels.len().div_ceil(self.columns)
    }

    fn row(&self, row: usize) -> impl Iterator<Item = (usize, &'a Panel)> {
        let panels = self.panels.iter().enumerate();
        panels.skip(row * self.columns).take(self.columns)
    }

    fn height(&self) -> f64 {
        match (self.rows(), self.columns) {
            (1, 1) if self.width < ALONE + ALONE_SINGLE => ALONE_SINGLE,
            (1, 1) => ALONE,
            (1, _) => BESIDE,
            _ => STACKED,
        }
    }

    /// The common range of the panels in the column that have the same horizontal axis.
    fn x_range(&self, index: usize) -> Range {
        let axis = &self.panels[index].x;
        let column = (index % self.columns..self.panels.len()).step_by(self.columns);
        let alike = column.filter(|&i| self.panels[i].x == *axis);
        common(axis, alike.filter_map(|i| self.x[i]), false)
    }

    /// The common range of the panels in the row that have the same vertical axis.
    fn y_range(&self, index: usize) -> Range {
        let axis = &self.panels[index].y;
        let row = self.row(index / self.columns);
        let alike = row.filter(|(_, panel)| panel.y == *axis);
        common(axis, alike.filter_map(|(i, _)| self.y[i]), true)
    }

    fn y_ruler(&self, index: usize) -> Ruler {
        let most = (self.height() / 33.0) as usize;
        Ruler::new(self.panels[index].y.scale, self.y_range(index), most)
    }

    /// True if the panel below has the labels of this one's horizontal axis.
    fn x_labels(&self, index: usize) -> bool {
        let below = self.panels.get(index + self.columns);
        below.is_none_or(|below| below.x != self.panels[index].x)
    }

    /// True if the panel to the left has the labels of this one's vertical axis.
    fn y_labels(&self, index: usize) -> bool {
        index.is_multiple_of(self.columns) || self.panels[index - 1].y != self.panels[index].y
    }

    /// The columns of the grid; their axes are equally wide.
    fn columns(&self, rulers: &[Ruler]) -> Vec<PanelColumn> {
        let mut labels = vec![0.0_f64; self.columns];
        for (index, ruler) in rulers.iter().enumerate() {
            let label = &mut labels[index % self.columns];
            *label = label.max(label_width(ruler, self.y_labels(index)));
        }
        let gaps = COLUMN_GAP * (self.columns - 1) as f64;
        let room = self.width - 2.0 * EDGE - RIGHT - gaps - labels.iter().sum::<f64>();
        let width = (room / self.columns as f64).max(NARROWEST);
        let mut left = EDGE;
        let mut columns = Vec::new();
        for labels in labels {
            left += labels;
            columns.push(PanelColumn {
                labels,
                left,
                width,
            });
            left += width + COLUMN_GAP;
        }
        columns
    }

    fn title_height(&self, row: usize) -> f64 {
        let titled = self.row(row).any(|(_, panel)| !panel.title.is_empty());
        if titled { TITLE } else { 4.0 }
    }

    fn footer_height(&self, row: usize) -> f64 {
        let labels = self.row(row).any(|(index, _)| self.x_labels(index));
        let last = row + 1 == self.rows();
        label_height(labels) + if last { 0.0 } else { ROW_GAP }
    }

    fn place(&self, index: usize, column: &PanelColumn, top: f64, y: Ruler) -> Placed<'a> {
        let panel = &self.panels[index];
        Placed {
            panel,
            frame: Frame {
                left: column.left,
                top,
                width: column.width,
                height: self.height(),
            },
            x: Ruler::across(panel.x.scale, self.x_range(index), column.width, SIZE),
            y,
            x_labels: self.x_labels(index),
            y_labels: self.y_labels(index),
            label_width: column.labels,
        }
    }
}

/// The range of an axis for data of these extents.
fn common(axis: &Axis, extents: impl Iterator<Item = Range>, pad: bool) -> Range {
    let all = extents.fold(None, |sum, one| Some(axis::union(sum, one)));
    axis::range(axis, all, pad)
}
