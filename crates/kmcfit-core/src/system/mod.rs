//! The oscillator: time grid, integrator, force terms, coefficient functions and input.
//!
//! `m(t) (y'' + b''(t)) + sum_j p_j(t) phi_j(y, y') = f(t)` with `y(0)`, `y'(0)` given, stepped by an explicit
//! Runge-Kutta method ([`Method`]) on an equally spaced [`Grid`]. Coefficient functions live on the
//! nodes and are linear in between, so a stage at mid-step has the mean of two nodes.

mod coefficients;
mod elements;
mod grid;
mod input;
mod integrator;
pub mod quadrature;

pub(crate) use integrator::{MIDPOINT, RK4, StagePosition, Tableau};

pub use coefficients::{NodalCoefficients, State, SystemTangent};
pub use elements::{MOST_TERMS, Term};
pub use grid::{Grid, TimePoint, round_time};
pub use input::{Excitation, InputSample, StageSamples};
pub use integrator::Method;

/// Most functions of a system: the mass and one for each term.
pub(crate) const FUNCTIONS: usize = MOST_TERMS + 1;

/// Grid, stepper and force terms of an oscillator. The values of the coefficient functions are a [`NodalCoefficients`].
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Time nodes.
    pub grid: Grid,
    /// Stepper.
    pub method: Method,
    /// Force terms, in the order of [`NodalCoefficients::coefficients`].
    pub terms: Vec<Term>,
}

impl System {
    /// Whether the response is linear in the initial state and nothing drives it.
    pub fn is_linear_and_free(&self, excitation: Option<&Excitation>) -> bool {
        let is_free = || excitation.is_none_or(Excitation::is_zero);
        self.terms.iter().all(|term| term.is_linear()) && is_free()
    }
}
