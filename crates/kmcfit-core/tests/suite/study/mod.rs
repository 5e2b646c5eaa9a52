//! Further analyses of a fit: profiles, extremes, equivalent systems, multistart, predictions.

mod equivalent;
mod extremes;
mod forced;
mod multistart;
mod prediction;
mod problems;
mod profile;
