//! A simulated record with the system that produced it, and its directional derivative.

use crate::simulate::{Engine, EngineMode, Trajectory};
use crate::system::{Excitation, NodalCoefficients, System, SystemTangent};

/// A simulated record.
#[derive(Debug, Clone, Copy)]
pub struct SimulatedRecord<'a> {
    /// Grid, stepper and terms.
    pub system: &'a System,
    /// Nodal values of mass and coefficients.
    pub nodal: &'a NodalCoefficients,
    /// Excitation.
    pub excitation: Option<&'a Excitation>,
    /// Response.
    pub response: &'a Trajectory,
    /// Values of all scalars.
    pub scalars: &'a [f64],
}

/// Directional derivative of a simulated record.
#[derive(Debug, Clone, Copy)]
pub struct RecordTangent<'a> {
    /// Change of the nodal values.
    pub nodal: &'a NodalCoefficients,
    /// Change of the response.
    pub response: &'a Trajectory,
    /// Change of the scalars.
    pub scalars: &'a [f64],
}

impl SimulatedRecord<'_> {
    /// Engine of the response and its derivatives.
    pub(crate) fn engine(&self) -> Engine {
        let nodes = self.response.nodes();
        Engine::choose(self.system, self.excitation, nodes, EngineMode::Fastest)
    }

    /// [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()) of the response.
    pub(crate) fn discrete_adjoint(&self, source: &Trajectory) -> SystemTangent {
        let Self {
            system,
            nodal,
            excitation,
            response,
            ..
        } = self;
        (self.engine()).discrete_adjoint(system, nodal, *excitation, response, source)
    }
}
