//! What the samples say beyond one fit.
//!
//! * [`Linear`]: a number that is linear in the parameters, the thing asked about;
//! * [`profile()`]: which values of it the samples allow, by fits with it held fixed;
//! * [`extremes`]: the extreme systems among all that explain the samples as well as stated;
//! * [`equivalent`]: other systems with the very same response; [`equivalent_systems`] finds and checks those of a fit;
//! * [`multistart`]: fits from many starts, their clusters, and whether two optima share a valley;
//! * [`variation`]: whether a function varies at all;
//! * [`bootstrap`]: intervals from fits to simulated samples;
//! * [`prediction`]: what an optimum says of an unseen run, and how surely.
//!
//! What is random is seeded, and what runs on several threads gives the same bits on any number of
//! them.

pub mod bootstrap;
pub mod constancy_test;
pub mod equivalent_coefficients;
mod equivalent_systems;
pub mod extremes;
mod free_response;
mod functional;
pub mod multistart;
mod parallel;
pub mod prediction;
pub mod profile;
mod refit;
mod simulate;

pub use equivalent_systems::{Choice, EquivalentSystem, equivalent_systems};
pub use free_response::{PredictedResponse, PredictionSummary, predict};
pub use functional::{Linear, Target};
pub use profile::{Profile, ProfileSettings, profile, profiles};
