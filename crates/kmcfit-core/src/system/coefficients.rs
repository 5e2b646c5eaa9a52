//! Nodal values of the coefficient functions, and the state of the system.

/// Displacement (m) and velocity (m/s) at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Displacement `y` in m.
    pub displacement: f64,
    /// Velocity `v = y'` in m/s.
    pub velocity: f64,
}

/// Nodal values of the mass and of each term's coefficient function.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCoefficients {
    /// Mass at the nodes, kg.
    pub mass: Vec<f64>,
    /// Nodal values of one coefficient function per [`Law`](super::Law), in the system's order. The coefficients of the last terms
    /// are zero in derivatives if there are fewer functions than terms.
    pub coefficients: Vec<Vec<f64>>,
}

impl NodalCoefficients {
    /// Zero coefficients: `nodes` nodes, `terms` terms.
    pub fn zeros(nodes: usize, terms: usize) -> Self {
        Self {
            mass: vec![0.0; nodes],
            // One by one: zeroed memory comes from the operating system, copies would be written.
            coefficients: (0..terms).map(|_| vec![0.0; nodes]).collect(),
        }
    }

    /// The mass and the coefficients as one list of functions, mass first.
    pub fn functions(&self) -> impl Iterator<Item = &[f64]> {
        std::iter::once(self.mass.as_slice()).chain(self.coefficients.iter().map(Vec::as_slice))
    }

    /// Function `f` of that list.
    #[inline(always)]
    pub(crate) fn function_mut(&mut self, f: usize) -> &mut Vec<f64> {
        match f {
            0 => &mut self.mass,
            f => &mut self.coefficients[f - 1],
        }
    }

    /// As [`NodalCoefficients::functions`], mutable.
    pub fn functions_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        std::iter::once(&mut self.mass).chain(self.coefficients.iter_mut())
    }
}

/// A direction of change of the coefficients and the initial state.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemTangent {
    /// Change of the nodal values.
    pub nodal: NodalCoefficients,
    /// Change of the initial state.
    pub initial: State,
}
