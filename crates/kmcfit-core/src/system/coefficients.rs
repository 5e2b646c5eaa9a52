//! Nodal values of the coefficient functions, and the state of the system.

/// Displacements (m) of all coordinates, then their velocities (m/s), then the internal states of elements, at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    coordinates: usize,
    components: Vec<f64>,
}

impl State {
    /// Of one coordinate.
    pub fn one(displacement: f64, velocity: f64) -> Self {
        Self::from(vec![displacement, velocity])
    }

    /// At rest.
    pub fn rest(coordinates: usize) -> Self {
        Self::from(vec![0.0; 2 * coordinates])
    }

    /// The components of a state of `coordinates` coordinates.
    pub fn of_components(coordinates: usize, components: Vec<f64>) -> Self {
        Self {
            coordinates,
            components,
        }
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// Displacements, then velocities, then internal states.
    pub fn components(&self) -> &[f64] {
        &self.components
    }

    /// As [`State::components`], mutable.
    pub fn components_mut(&mut self) -> &mut [f64] {
        &mut self.components
    }

    /// Displacement of a coordinate, m.
    pub fn displacement(&self, coordinate: usize) -> f64 {
        self.components[coordinate]
    }

    /// Velocity of a coordinate, m/s.
    pub fn velocity(&self, coordinate: usize) -> f64 {
        self.components[self.coordinates + coordinate]
    }
}

/// Displacements, then as many velocities.
impl From<Vec<f64>> for State {
    fn from(components: Vec<f64>) -> Self {
        Self::of_components(components.len() / 2, components)
    }
}

/// Nodal values of the functions of a structure: its inertias, then the coefficients of its elements.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalCoefficients {
    /// Nodal values of each inertia, kg.
    pub inertias: Vec<Vec<f64>>,
    /// Nodal values of one coefficient per element, in the structure's order. The coefficients of the last elements are zero in derivatives
    /// if there are fewer functions than elements.
    pub coefficients: Vec<Vec<f64>>,
}

impl NodalCoefficients {
    /// Zero values of `inertias` inertias and `coefficients` elements at `nodes` nodes.
    pub fn zeros(nodes: usize, inertias: usize, coefficients: usize) -> Self {
        // One by one: zeroed memory comes from the operating system, copies would be written.
        let zeros = |count: usize| (0..count).map(|_| vec![0.0; nodes]).collect();
        Self {
            inertias: zeros(inertias),
            coefficients: zeros(coefficients),
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.inertias[0].len()
    }

    /// All functions as one list, inertias first.
    pub fn functions(&self) -> impl Iterator<Item = &[f64]> {
        let all = self.inertias.iter().chain(&self.coefficients);
        all.map(Vec::as_slice)
    }

    /// Function `f` of that list.
    #[inline(always)]
    pub(crate) fn function_mut(&mut self, f: usize) -> &mut Vec<f64> {
        match f.checked_sub(self.inertias.len()) {
            None => &mut self.inertias[f],
            Some(f) => &mut self.coefficients[f],
        }
    }

    /// As [`NodalCoefficients::functions`], mutable.
    pub fn functions_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.inertias.iter_mut().chain(&mut self.coefficients)
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
