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

    /// As [`Device::functions`], mutable.
    pub fn functions_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        std::iter::once(&mut self.mass).chain(self.coefficients.iter_mut())
    }
}

/// Where derivatives with respect to the functions of a device are added.
#[derive(Debug)]
pub enum Slopes<'a> {
    /// To those with respect to the values at the nodes.
    AtNodes(&'a mut Device),
    /// To their sums over the nodes, one a function, mass first: all that a constant asks for.
    Summed(&'a mut [f64]),
}

impl Slopes<'_> {
    /// Number of functions.
    pub(crate) fn functions(&self) -> usize {
        match self {
            Slopes::AtNodes(device) => 1 + device.coefficients.len(),
            Slopes::Summed(sums) => sums.len(),
        }
    }

    /// Adds the derivative with respect to the value of function `f` at a node.
    #[inline(always)]
    pub(crate) fn add(&mut self, f: usize, node: usize, slope: f64) {
        match self {
            Slopes::AtNodes(device) => device.function_mut(f)[node] += slope,
            Slopes::Summed(sums) => sums[f] += slope,
        }
    }
}
