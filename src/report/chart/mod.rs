//! Charts: the data model of a figure, and its two renderers.
//!
//! [`figure`], [`plot_mark`] and `axis` describe the contents of a figure. `layout`, `panel`, `legend`, `axis` and `curve` turn it
//! into primitives in pixels, which [`svg`] writes; `data` serialises the same description for the script of a page.

mod axis;
mod curve;
mod data;
mod drawing;
pub mod figure;
mod layout;
mod legend;
mod numbers;
mod panel;
pub mod plot_mark;
pub mod svg;
mod thin;

pub use axis::{Axis, Scale};
pub(super) use data::{data, text_for_script};
pub use figure::{Figure, FigureWidth, Panel};
pub(super) use plot_mark::MarkKind;
pub use plot_mark::{Colour, Dash, Mark, Style};
pub(super) use svg::sample;
pub use svg::{render, render_at};
pub(crate) use thin::Detail;
