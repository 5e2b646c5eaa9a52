//! A simulated record with the system that produced it, and its directional derivative.

use crate::step::{Driven, Trajectory};
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

impl<'a> SimulatedRecord<'a> {
    /// The system with its functions and excitation.
    pub(crate) fn driven(&self) -> Driven<'a> {
        Driven {
            system: self.system,
            nodal: self.nodal,
            excitation: self.excitation,
        }
    }

    /// Derivatives, with respect to the nodal values and the initial state, of a cost with the derivatives `source` with respect to the
    /// response.
    pub(crate) fn discrete_adjoint(&self, source: &Trajectory) -> SystemTangent {
        self.driven().nodal_adjoint(self.response, source)
    }
}
