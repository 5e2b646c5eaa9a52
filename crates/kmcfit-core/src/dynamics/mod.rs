//! The motion of one device, its linearisation and its adjoints.
//!
//! `m(t) (y'' + b''(t)) + sum_j p_j(t) phi_j(y, y') = f(t)` with `y(0)`, `y'(0)` given, stepped by an explicit
//! Runge–Kutta method ([`Method`]) on an equally spaced [`Grid`]. Coefficient functions live on the
//! nodes and are interpolated linearly in between, so a stage at mid-step sees the mean of two nodes.
//!
//! * [`Oscillator::forward`]: the motion ([`Trajectory`]), or where it broke down ([`Breakdown`]);
//! * [`Oscillator::sense`]: what a sensor at any time sees of it;
//! * [`Oscillator::tangent`]: its directional derivative;
//! * [`adjoint::discrete`]: the exact transpose of the stepper;
//! * [`adjoint::continuous`]: Eq. 13 of the paper, discretised as the paper does.

pub mod adjoint;
mod blocks;
mod device;
mod excitation;
mod forward;
mod grid;
mod maps;
pub mod quadrature;
mod rates;
mod sense;
mod sense_nodes;
mod stages;
mod step_jacobian;
mod tableau;
mod tangent;
mod tangents;
mod term;
mod trials;
pub(crate) mod window;

pub(crate) use maps::FUNCTIONS;
pub(crate) use sense_nodes::{Accelerations, Sight};
pub(crate) use tangents::{Change, Course, Slot, Steady, TILE, TILE_NODES, Tangents};

pub use device::{Device, Slopes, State};
pub use excitation::{Excitation, Stepwise};
pub use forward::{Breakdown, Cause, Oscillator, Trajectory};
pub use grid::Grid;
pub use sense::{ChannelKind, Place, Sensed, Surroundings};
pub use step_jacobian::{StateChange, StepJacobian};
pub use tableau::Method;
pub use tangent::DeviceTangent;
pub use term::{MOST_TERMS, Term};
pub(crate) use trials::{Layout, Ray, Trials, replay};

/// What motions, adjoints and tangents are computed with: `AVX-512`, `AVX2` or `scalar`, the widest that this
/// processor has and the environment's `KMCFIT_ARITHMETIC`, if it names one of them, allows. All give the
/// same bits.
pub fn arithmetic() -> &'static str {
    crate::lanes::name()
}
