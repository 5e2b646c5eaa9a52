//! What the readings say beyond one fit.

#[path = "../common/mod.rs"]
mod common;

mod bootstrap;
mod equivalent;
mod multistart;
mod prediction;
mod problems;
mod profile;
mod pull_apart;
mod variation;
