//! A simulated record, and its change along a direction.

use crate::simulate::{Engine, Purpose, Trajectory};
use crate::system::{Excitation, NodalCoefficients, System, SystemTangent};

/// A simulated record.
#[derive(Debug, Clone, Copy)]
pub struct SimulatedRecord<'a> {
    /// Grid, stepper and terms.
    pub system: &'a System,
    /// The system that moves.
    pub nodal: &'a NodalCoefficients,
    /// What drives it.
    pub excitation: Option<&'a Excitation>,
    /// Its response.
    pub response: &'a Trajectory,
    /// Values of all scalars.
    pub scalars: &'a [f64],
}

/// How a view changes along a direction.
#[derive(Debug, Clone, Copy)]
pub struct RecordTangent<'a> {
    /// Change of the system.
    pub nodal: &'a NodalCoefficients,
    /// Change of the response.
    pub response: &'a Trajectory,
    /// Change of the scalars.
    pub scalars: &'a [f64],
}

impl SimulatedRecord<'_> {
    /// The engine of its response and derivatives.
    pub(crate) fn engine(&self) -> Engine {
        let nodes = self.response.nodes();
        Engine::choose(self.system, self.excitation, nodes, Purpose::Estimation)
    }

    /// [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()) of its response.
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
