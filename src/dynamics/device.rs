//! A device on the grid, and a state of its motion.

/// Displacement (m) and velocity (m/s) at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Displacement `y` in m.
    pub displacement: f64,
    /// Velocity `v = y'` in m/s.
    pub velocity: f64,
}

/// Values of the mass and of every term's coefficient function at all nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    /// Mass at the nodes, kg.
    pub mass: Vec<f64>,
    /// One coefficient function per [`Term`](super::Term), in the oscillator's order, at the nodes.
    pub coefficients: Vec<Vec<f64>>,
}

impl Device {
    /// A device with all values zero: `nodes` nodes, `terms` terms.
    pub fn zeros(nodes: usize, terms: usize) -> Self {
        Self {
            mass: vec![0.0; nodes],
            coefficients: vec![vec![0.0; nodes]; terms],
        }
    }

    /// The mass and the coefficients as one list of functions, mass first.
    pub fn functions(&self) -> impl Iterator<Item = &[f64]> {
        std::iter::once(self.mass.as_slice()).chain(self.coefficients.iter().map(Vec::as_slice))
    }

    /// As [`Device::functions`], mutable.
    pub fn functions_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        std::iter::once(&mut self.mass).chain(self.coefficients.iter_mut())
    }
}
