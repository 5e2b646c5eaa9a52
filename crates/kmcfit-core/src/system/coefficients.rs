//! Nodal values of the coefficient functions, and a state of the response.

/// Displacement (m) and velocity (m/s) at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Displacement `y` in m.
    pub displacement: f64,
    /// Velocity `v = y'` in m/s.
    pub velocity: f64,
}

impl State {
    pub(crate) fn is_finite(self) -> bool {
        self.displacement.is_finite() && self.velocity.is_finite()
    }
}

/// Values of the mass and of every term's coefficient function at all nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCoefficients {
    /// Mass at the nodes, kg.
    pub mass: Vec<f64>,
    /// One coefficient function per [`Term`](super::Term), in the system's order, at the nodes.
    pub coefficients: Vec<Vec<f64>>,
}

impl NodalCoefficients {
    /// A system with all values zero: `nodes` nodes, `terms` terms.
    pub fn zeros(nodes: usize, terms: usize) -> Self {
        Self {
            mass: vec![0.0; nodes],
            // One by one: zeros come from the system as they are, copies of them are made.
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

/// A direction in which system and initial state change.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemTangent {
    /// Change of every function at the nodes.
    pub nodal: NodalCoefficients,
    /// Change of the initial state.
    pub initial: State,
}

impl SystemTangent {
    pub(crate) fn is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().fold(true, |all, x| all & x.is_finite());
        self.nodal.functions().all(finite) && self.initial.is_finite()
    }
}
