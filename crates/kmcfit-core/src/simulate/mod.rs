//! Simulation: responses, their linearisation and their adjoints.
//!
//! [`reference`] implements each equation as one plain function; [`fast`] has specialisations that agree with the reference
//! to a stated tolerance; [`Engine`] chooses among them.

mod engine;
mod error;
pub(crate) mod fast;
mod gradient;
pub mod reference;
mod trajectory;

pub use engine::{Engine, EngineMode, continuous_adjoint};
pub(crate) use engine::{is_linear_midpoint, least_squares};
pub use error::{Cause, SimulationError};
pub use gradient::CoefficientGradient;
pub use reference::{Observation, StepJacobian};
pub use trajectory::Trajectory;

use crate::system::{Excitation, NodalCoefficients, State, System};

/// SIMD instruction set of responses, adjoints and tangents: `AVX-512`, `AVX2` or `scalar`, the widest that the processor
/// supports and the environment variable `KMCFIT_ARITHMETIC`, if it names one of them, permits. Results do not depend on
/// it.
pub fn arithmetic() -> &'static str {
    crate::simd::name()
}

impl System {
    /// Response, as [`reference::forward`].
    ///
    /// # Errors
    /// A [`SimulationError`] if the mass is not positive at some node or the response overflows.
    ///
    /// # Panics
    /// If `system` or `excitation` does not fit the grid and the terms.
    pub fn forward(
        &self,
        nodal: &NodalCoefficients,
        initial: State,
        excitation: Option<&Excitation>,
    ) -> Result<Trajectory, SimulationError> {
        reference::forward(self, nodal, initial, excitation)
    }
}
