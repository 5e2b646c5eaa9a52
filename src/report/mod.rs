//! Reports of a run: result document, tables, figures, HTML pages and terminal summaries.
//!
//! [`figures`] builds the standard figures in the data model of [`chart`], which renders them; `page` assembles figures
//! and text into HTML pages.
//!
//! ```
//! use kmcfit::report::{render, Axis, Colour, Figure, Mark, Panel, Style};
//!
//! let t = [0.0, 1.0, 2.0];
//! let figure = Figure::new("decay", "Free decay", "Displacement against time").panel(
//!     Panel::new(Axis::linear("time t", "s"), Axis::linear("displacement y", "m"))
//!         .mark(Mark::line("measured", &t, &[3.3, 2.1, -0.4], Style::new(Colour::Blue))),
//! );
//! assert!(render(&figure).contains("time t (s)"));
//! ```

mod answer;
mod assessment;
mod assumptions;
mod channel_view;
pub mod chart;
mod columns;
pub mod compare;
mod completed_fit;
mod cost;
mod csv;
pub mod document;
mod equation;
mod extent;
pub mod figures;
pub(crate) mod findings;
mod fit_assessment;
mod fit_figures;
mod fit_quality;
mod main_figure;
mod overview;
pub(crate) mod page;
mod parameters;
mod prediction;
mod ratios;
mod record_figures;
mod result_table;
mod rule_names;
mod run;
mod run_reader;
pub mod selection;
pub mod study;
pub(crate) mod suggestions;
mod summary;
mod tables;
mod terminal;
pub(crate) mod text;
mod timings;
pub mod trial;
mod verdict;

pub use answer::{AnswerRow, answer, quantity};
pub use chart::{Axis, Colour, Dash, Figure, Mark, Panel, Scale, Style, render};
pub use compare::Comparison;
pub use completed_fit::{CoefficientCurve, CompletedFit, model_predictions};
pub use cost::{CostKind, cost_definition};
pub use csv::CsvTable;
pub use fit_assessment::RunAssessment;
pub use kmcfit_core::study::{PredictedResponse, predict};
pub use overview::overview;
pub use prediction::{ForcedPredictions, ForcedSummary, FreePredictions, Score};
pub use result_table::ResultTable;
pub use run::{FittedModel, MODEL, RequestedFiles, json};
pub use run_reader::Run;
pub use summary::{prediction_table, summary};
pub use terminal::summary_plot;
pub use timings::{OverheadTimings, PartSummary, TimingsSummary};
