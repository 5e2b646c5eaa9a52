//! The system: time grid, integrator, force terms, coefficient functions and excitation.
//!
//! `m(t) (y'' + b''(t)) + sum_j p_j(t) phi_j(y, y') = f(t)` with given `y(0)`, `y'(0)`, integrated by an explicit Runge–Kutta method
//! ([`Method`]) on an equally spaced [`Grid`]. Coefficient functions are given at the nodes and linear in between, so a stage at
//! mid-step uses the mean of two nodes.

mod coefficients;
mod grid;
mod input;
mod method;
pub(crate) mod quadrature;
mod stability;

pub use coefficients::{NodalCoefficients, State, SystemTangent};
pub use grid::{Grid, TimePoint, round_time};
pub use input::{Excitation, InputQuantity, InputSample, StageSamples, SupportMotion};
pub use method::Method;
pub use quadrature::{trapezoid, trapezoid_weights};

use crate::structure::{Law, MOST_ELEMENTS, Structure};

/// Largest number of functions of a system: the mass and one per term.
pub(crate) const FUNCTIONS: usize = MOST_ELEMENTS + 1;

/// Grid, integrator and structure; the values of its functions are a [`NodalCoefficients`].
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Time nodes.
    pub grid: Grid,
    /// Integrator.
    pub method: Method,
    /// Inertias and elements.
    pub structure: Structure,
}

impl System {
    /// Laws of the elements.
    pub fn laws(&self) -> &[Law] {
        self.structure.laws()
    }

    /// Width of Coulomb friction, m/s; `None` without it.
    pub fn friction_width(&self) -> Option<f64> {
        self.laws().iter().find_map(|law| match law {
            Law::CoulombFriction { width } => Some(*width),
            _ => None,
        })
    }
}
