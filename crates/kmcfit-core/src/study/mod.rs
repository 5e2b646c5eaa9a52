//! Further analyses of a fit.
//!
//! * [`Linear`]: a quantity that is linear in the parameters;
//! * [`profile()`]: its likelihood profile, by fits with the quantity fixed at a series of values;
//! * [`extremes`]: its smallest and largest values over all parameters compatible with the data;
//! * [`equivalent_coefficients`]: other coefficients with the same response; [`equivalent_systems`] computes and confirms
//!   those of a fit;
//! * [`multistart`]: fits from many starting points, their clusters, and paths between minima;
//! * [`constancy_test`]: likelihood-ratio test of a constant against a time-varying function;
//! * [`bootstrap`]: intervals from fits to simulated samples;
//! * [`prediction`]: response to another excitation or initial state, with its uncertainty.
//!
//! Random numbers are seeded, and results do not depend on the number of threads.

pub mod bootstrap;
pub mod constancy_test;
pub mod equivalent_coefficients;
mod equivalent_systems;
pub mod extremes;
mod forced_prediction;
mod free_response;
mod functional;
pub mod multistart;
pub mod prediction;
pub mod profile_likelihood;
mod refit;
mod simulate;
mod verification;

pub use equivalent_systems::{Choice, EquivalentSystem, equivalent_systems};
pub use forced_prediction::{IdentifiedSystem, PredictedChannel};
pub use free_response::{PredictedResponse, PredictionSummary, predict};
pub use functional::{Linear, Target};
pub use profile_likelihood::{Profile, ProfileSettings, profile, profiles};
pub use verification::ReferenceValues;
