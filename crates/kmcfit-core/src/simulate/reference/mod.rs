//! Reference implementation of the equations: scalar arithmetic, sequential steps, any stepper.
//!
//! | function | equation |
//! |---|---|
//! | `forward` | Eq. 2, the response |
//! | `tangent` | its directional derivative |
//! | `discrete_adjoint` | the exact transpose of the tangent |
//! | `continuous_adjoint` | Eq. 13, with the gradients of Eqs. 15-17 |
//! | `step_jacobians`, `input_derivatives` | the linearisation of single steps |
//! | `observe` | displacement, velocity or acceleration at any time |
//!
//! The order of operations is the paper's. Each function in [`fast`](super::fast) agrees with one of these functions to a
//! stated tolerance.

mod continuous_adjoint;
mod discrete_adjoint;
pub(crate) mod equation;
mod forward;
mod observation;
mod step_jacobian;
mod tangent;

pub use continuous_adjoint::continuous_adjoint;
pub(crate) use continuous_adjoint::{Adjoint, AdjointEquation};
pub use discrete_adjoint::discrete_adjoint;
pub use forward::{forward, forward_into};
pub use observation::{Observation, observe, observe_value};
pub use step_jacobian::{StateChange, StepJacobian, input_derivatives, step_jacobians};
pub use tangent::tangent;
