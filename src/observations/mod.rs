//! Tables of readings: CSV files, what their times must be like, and reading between them.

mod resample;
mod table;
pub mod times;

pub use resample::resample;
pub use table::Table;
pub use times::{equally_spaced, increasing};
