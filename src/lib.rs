//! kmcfit
#![allow(
    clippy::result_large_err,
    reason = "an input error ends the program: its size costs nothing, its detail helps"
)]
pub mod config;
pub mod error;
pub mod input;
pub mod near;
pub mod observations;
