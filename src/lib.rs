//! kmcfit
pub mod error;
