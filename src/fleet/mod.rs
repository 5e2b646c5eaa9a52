//! Fleets: one model fitted to many records.
//!
//! Every record takes the place of the data of the model's only experiment. Its result is a [`Row`], which is appended to `rows.jsonl` in
//! the folder of the fleet; the same command goes on after the rows that are there. A table and a page follow when all have their rows.

mod fit;
mod folder;
mod records;
mod report;
mod run;
mod statistics;
mod trend;

pub use fit::{Row, check_model, fit_record};
pub use folder::FleetFolder;
pub use records::{FleetRecord, RecordList};
pub use report::finish;
pub use run::run;

pub use trend::Trend;
