//! Tables of readings: CSV files, and what their times must be like.

mod table;
pub mod times;

pub use table::Table;
