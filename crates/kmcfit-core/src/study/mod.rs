//! Further analyses of a fit.
//!
//! * [`Target`](crate::identifiability::Target): what a quantity is a value of;
//! * [`profile()`]: its likelihood profile, by fits with the quantity fixed at a series of values;
//! * [`extremes`]: its smallest and largest values over all parameters compatible with the data;
//! * [`equivalent_coefficients`]: other coefficients with the same response; [`equivalent_systems`] computes and confirms
//!   those of a fit;
//! * [`multistart`]: fits from many starting points, and their clusters;
//! * [`prediction`]: response to another excitation or initial state, with its uncertainty.
//!
//! Random numbers are seeded, and results do not depend on the number of threads.

mod equivalent_coefficients;
mod equivalent_systems;
mod extremes;
mod forced_prediction;
mod free_response;
mod multistart;
mod prediction;
mod profile_likelihood;
mod refit;

pub use equivalent_coefficients::{EquivalentOptions, TargetResponse, equivalent_coefficients};
pub use equivalent_systems::{Choice, EquivalentSystem, equivalent_systems};
pub use extremes::{
    Extreme, ExtremeStatus, MisfitLimit, envelopes, extreme, extreme_pairs, is_within_rounding,
    values_at,
};
pub use forced_prediction::{IdentifiedSystem, PredictedChannel};
pub use free_response::{PredictedResponse, PredictionSummary, predict};
pub use multistart::{Cluster, Multistart, MultistartFinding, Ranges, Waterfall, multistart};
pub use prediction::{BOUNDED, PredictionCase};
pub use profile_likelihood::{End, Interval, Profile, ProfileSettings, QUANTILE_95, profile};
