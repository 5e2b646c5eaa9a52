//! The problems of the core's tests, and the commands that pages show.
#![allow(dead_code, unused_imports)]

#[path = "../../crates/kmcfit-core/tests/common/mod.rs"]
mod problems;

#[cfg(unix)]
pub mod pages;

pub use problems::*;
