//! Further analyses of a fit.
//!
//! * [`Linear`]: a quantity that is linear in the parameters;
//! * [`profile()`]: its likelihood profile, by fits with the quantity fixed at a series of values;
//! * [`extremes`]: its smallest and largest values over all parameters compatible with the data;
//! * [`equivalent_coefficients`]: other coefficients with the same response; [`equivalent_systems`] computes and confirms
//!   those of a fit;
//! * [`multistart`]: fits from many starting points, and their clusters;
//! * [`prediction`]: response to another excitation or initial state, with its uncertainty.
//!
//! Random numbers are seeded, and results do not depend on the number of threads.

pub mod equivalent_coefficients;
mod equivalent_systems;
pub mod extremes;
mod forced_prediction;
mod free_response;
pub mod multistart;
pub mod prediction;
pub mod profile_likelihood;
mod refit;

pub use equivalent_systems::{Choice, EquivalentSystem, equivalent_systems};
pub use forced_prediction::{IdentifiedSystem, PredictedChannel};
pub use free_response::{PredictedResponse, PredictionSummary, predict};
pub use profile_likelihood::{Profile, ProfileSettings, profile};
