//! kmcfit
#![allow(
    clippy::result_large_err,
    reason = "an input error ends the program: its size costs nothing, its detail helps"
)]
pub mod cli;
pub mod config;
pub mod constraints;
pub mod dynamics;
pub mod error;
pub mod functions;
mod input;
mod near;
pub mod objective;
pub mod observations;
pub mod problem;
pub mod qp;
pub mod report;
pub mod solvers;
