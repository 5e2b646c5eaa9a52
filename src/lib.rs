//! The application kmcfit: identifies time-varying mass, damping and stiffness of a vibrating system from measured
//! records. The numerics are in [`kmcfit_core`].
//!
//! [`guide`] is the user guide: tutorial, choice of methods, theory.
//!
//! # Modules, in the order in which data flow
//!
//! 1. [`config`] reads a model file, and through [`tables`] its tables, and builds a problem of [`kmcfit_core`]
//!    from it; errors in the input are an [`mod@error`]; [`units`] has units and their factors to SI.
//! 2. [`fitting`] fits the problem.
//! 3. [`report`] writes tables, figures, pages and the result document, loads them back ([`Run::open`]), and compares
//!    runs; [`results`] makes folders of runs, which appear whole or not at all.
//! 4. [`analyse`] does this in memory, without files and threads, and builds for WebAssembly without the feature `program`.
//! 5. [`fleet`] fits one model to many records, with a row of results for each.
//! 6. [`cli`] is one file per command.
// All output passes `cli::output`, all changes of files `results`, all thread starts `threads` of the core.
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_macros))]
#![allow(
    clippy::result_large_err,
    reason = "an input error ends the program: its size costs nothing, its detail helps"
)]
pub mod analysis;
#[cfg(feature = "program")]
pub mod cli;
mod clock;
pub mod config;
pub mod digest;
pub mod error;
mod escape;
pub mod fitting;
#[cfg(feature = "program")]
pub mod fleet;
pub mod formats;
pub mod guide;
mod headings;
mod magnitudes;
mod memory;
pub mod quantity_names;
pub mod report;
pub mod results;
mod spelling;
pub mod tables;
mod text_io;
pub mod units;

pub use analysis::{Analysis, analyse};
pub use report::Run;
