//! Specialisations of [`reference`](super::reference): SIMD arithmetic, parallel-in-time blocks, batches of steps.
//!
//! Each module states its reference function and the tolerance of agreement; `tests.rs` checks it over random systems,
//! records, steppers and excitations. [`Engine`](super::Engine) chooses among them.

pub(crate) mod blocks;
pub(crate) mod continuous_adjoint;
mod elements;
pub(crate) mod lane_reads;
pub(crate) mod nodal_observations;
pub(crate) mod prefactored;
pub(crate) mod sensitivities;
pub(crate) mod simd_adjoint;
pub(crate) mod step_batch;
mod step_linearisation;
#[cfg(test)]
mod tests;
