//! Steps of the equation of motion: responses, their linearisation and their adjoints, written once for any number type.
//!
//! | file | what |
//! |---|---|
//! | `stage` | accelerations at a stage, and one step |
//! | `response` | sweeps forward: by matrices of eight steps, by stages |
//! | `linearised` | eight steps about a known response, and their transpose |
//! | `adjoint` | the exact transpose of the tangent along a record |
//! | `maps`, `tangents` | derivatives of each step; tangents along many directions |
//! | `trials` | the paper's trial steps, eight systems at once |
//! | `paper` | Eq. 2, 13 and 15-17, as the paper writes them |
//! | `observation`, `nodal_observations` | displacement, velocity and acceleration at any time |
//! | `engine` | these operations on a system |
//! | `assembled` | the same for structures of any size, with general rows, moving supports and implicit steps |
//!
//! What is local to a step is computed for eight steps in SIMD lanes, what depends on the step before by products of small matrices. A
//! number type implements [`Real`](crate::simd::Real), a method is a `Tableau`.

#![allow(
    clippy::needless_range_loop,
    reason = "sums over coordinates read several arrays at the same index"
)]

mod adjoint;
mod assembled;
mod engine;
mod error;
mod gradient;
mod linearised;
mod maps;
pub(crate) mod nodal_observations;
mod observation;
mod paper;
mod response;
mod stage;
mod step_jacobian;
#[cfg(test)]
mod structures_tests;
mod tableau;
pub(crate) mod tangents;
#[cfg(test)]
mod tests;
mod trajectory;
mod trials;

pub(crate) use assembled::{RowObservation, RowObserver};
pub use engine::{Driven, EngineMode};
pub(crate) use engine::{is_linear_midpoint, least_squares};
pub use error::{Cause, SimulationError};
pub(crate) use gradient::CoefficientGradient;
pub use observation::observe;
pub(crate) use observation::{Observation, observe_value};
pub use paper::continuous_adjoint;
pub(crate) use stage::eight;
pub(crate) use step_jacobian::StepJacobians;
pub use trajectory::Trajectory;
pub(crate) use trials::SearchRay;

/// SIMD instruction set of responses, adjoints and tangents: `AVX-512`, `AVX2` or `scalar`, the widest that the processor
/// supports and the environment variable `KMCFIT_ARITHMETIC`, if it names one of them, permits. Results do not depend on
/// it.
pub fn arithmetic() -> &'static str {
    crate::simd::name()
}
