//! Charts: the description of a figure, and its drawing as SVG.
//!
//! [`figure`], [`plot_mark`] and `axis` describe the contents of a figure; [`svg`] draws them, with the panels by `panel`. The script of
//! a page reads and zooms this drawing.

mod axis;
mod elements;
pub mod figure;
mod panel;
pub mod plot_mark;
pub mod svg;
mod thin;

pub use axis::{Axis, Scale};
pub use figure::{Figure, Panel};
pub use plot_mark::{Colour, Dash, Mark, Style, sides};
pub use svg::render;
