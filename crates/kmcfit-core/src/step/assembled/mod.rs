//! Structures of any size, with explicit and implicit steps: matrices assembled from rows, and solved by banded factors.
//!
//! `stage` solves the equation of motion at one stage, `stage_derivatives` transposes it, `step` goes through the stages of a step, forwards and back, `sweeps` along a record.
//! The small structures of [`Model`](super::stage::Model) are steps of the same methods in SIMD lanes.

mod driven;
mod observer;
mod stage;
mod stage_derivatives;
mod step;
mod sweeps;
#[cfg(test)]
mod tests;

pub use observer::{RowObservation, RowObserver};
pub(in crate::step) use sweeps::StepRow;
pub use sweeps::{Motion, MotionError};
