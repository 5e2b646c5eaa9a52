//! Fleets: one model fitted to many records.
//!
//! Every record takes the place of the data of the model's only experiment. Its result is a [`Row`], which is appended to the journal of
//! a shard; the coefficients that vary are [`Curve`]s in a second file. [`collect`] joins the shards.

mod collect;
mod figures;
mod fit;
mod folder;
mod index;
mod journal;
mod model;
mod page;
mod parquet;
mod records;
mod row;
mod run;
mod shard;
mod statistics;
mod summary;
mod trend;

pub use collect::{Collected, collect};
pub use fit::{Fitted, Limits, fit_record};
pub use folder::{FleetFolder, FleetIdentity};
pub use index::RowIndex;
pub use journal::Journal;
pub use model::FleetModel;
pub use page::{fleet_page, page_folder};
pub use records::{Record, RecordList};
pub use row::{Curve, Row};
pub use run::{Progress, RunOptions, RunSummary, run};
pub use shard::Shard;
pub use statistics::{Distribution, Outlier, Statistics};
pub use summary::fleet_summary;
pub use trend::Trend;
