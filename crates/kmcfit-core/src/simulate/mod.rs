//! Responses, their linearisation and their adjoints.
//!
//! [`reference`] has the equations, one plain function each; [`fast`] has specialisations, each equal to a reference
//! function to a stated tolerance; [`Engine`] chooses among them.

mod engine;
mod error;
pub(crate) mod fast;
mod gradient;
pub mod reference;
mod trajectory;

pub use engine::{Engine, Purpose, continuous_adjoint};
pub(crate) use engine::{is_linear_midpoint, least_squares};
pub use error::{Cause, SimulationError};
pub use gradient::CoefficientGradient;
pub use reference::{Observation, StepJacobian};
pub use trajectory::Trajectory;

use crate::system::{Excitation, NodalCoefficients, State, System};

/// The vector instructions of responses, adjoints and tangents: `AVX-512`, `AVX2` or `scalar`, the widest that this
/// processor has and the environment's `KMCFIT_ARITHMETIC`, if it names one of them, allows. All give the
/// same bits.
pub fn arithmetic() -> &'static str {
    crate::simd::name()
}

impl System {
    /// [`reference::forward`].
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
