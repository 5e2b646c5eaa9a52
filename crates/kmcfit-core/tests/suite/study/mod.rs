//! Further analyses of a fit: profiles, extremes, equivalent systems, multistart, bootstrap, predictions.

mod bootstrap;
mod constancy_test;
mod equivalent;
mod extremes;
mod forced;
mod multistart;
mod prediction;
mod problems;
mod profile;
