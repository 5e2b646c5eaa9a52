//! kmcfit
pub mod dynamics;
pub mod error;
pub mod functions;
pub mod objective;
pub mod problem;
pub mod report;
pub mod solvers;
