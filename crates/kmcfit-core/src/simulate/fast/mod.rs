//! Specialisations of [`reference`](super::reference): vector arithmetic, parallel in time, batches of steps.
//!
//! Each states which reference function it equals and to what tolerance; `tests.rs` holds it to that over random
//! systems, records, steppers and excitations. [`Engine`](super::Engine) chooses among them.

pub(crate) mod blocks;
pub(crate) mod continuous_adjoint;
mod elements;
pub(crate) mod nodal_observations;
pub(crate) mod padded_loads;
pub(crate) mod prefactored;
pub(crate) mod sensitivities;
pub(crate) mod simd_adjoint;
pub(crate) mod step_batch;
mod step_linearisation;
#[cfg(test)]
mod tests;
