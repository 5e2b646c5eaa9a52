//! States at the nodes of the grid.

use crate::structure::Structure;

/// States at all nodes: a matrix with a row for each node and a column for each component, the displacements of the coordinates, then their
/// velocities, then the internal states of elements; stored by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    coordinates: usize,
    nodes: usize,
    columns: Vec<f64>,
}

impl Trajectory {
    /// States of zero of `coordinates` coordinates at `nodes` nodes.
    pub fn zeros(coordinates: usize, nodes: usize) -> Self {
        Self::with_internal_states(coordinates, 0, nodes)
    }

    /// [`Trajectory::zeros`] with internal states.
    pub fn with_internal_states(coordinates: usize, internal: usize, nodes: usize) -> Self {
        Self {
            coordinates,
            nodes,
            columns: vec![0.0; (2 * coordinates + internal) * nodes],
        }
    }

    /// States of zero of a structure at `nodes` nodes.
    pub fn of(structure: &Structure, nodes: usize) -> Self {
        Self::with_internal_states(structure.coordinates(), structure.internal_states(), nodes)
    }

    /// States of zero of the same structure at the same nodes.
    pub(crate) fn like(other: &Self) -> Self {
        Self {
            columns: vec![0.0; other.columns.len()],
            ..*other
        }
    }

    /// The states with these columns: displacements (m), then velocities (m/s).
    ///
    /// # Panics
    /// If the columns differ in length or their number is odd.
    pub fn of_columns(columns: &[&[f64]]) -> Self {
        let nodes = columns.first().map_or(0, |column| column.len());
        assert!(
            columns.len().is_multiple_of(2),
            "displacements and velocities"
        );
        assert!(
            columns.iter().all(|column| column.len() == nodes),
            "columns of one length"
        );
        Self {
            coordinates: columns.len() / 2,
            nodes,
            columns: columns.concat(),
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// Number of columns: twice the coordinates, and the internal states.
    pub fn components(&self) -> usize {
        match self.nodes {
            0 => 0,
            nodes => self.columns.len() / nodes,
        }
    }

    /// Column `c`: the displacements of coordinate `c`, the velocities of the coordinate as many columns before as there are coordinates, or
    /// an internal state.
    #[inline(always)]
    pub fn component(&self, c: usize) -> &[f64] {
        &self.columns[c * self.nodes..(c + 1) * self.nodes]
    }

    /// [`Trajectory::component`], mutable.
    #[inline(always)]
    pub fn component_mut(&mut self, c: usize) -> &mut [f64] {
        &mut self.columns[c * self.nodes..(c + 1) * self.nodes]
    }

    /// [`Trajectory::columns`], mutable.
    pub(super) fn columns_mut<const N: usize>(&mut self) -> [[&mut [f64]; N]; 2] {
        let mut columns = self.columns.chunks_exact_mut(self.nodes);
        std::array::from_fn(|_| std::array::from_fn(|_| columns.next().unwrap_or_default()))
    }

    /// Displacements and velocities of `N` coordinates.
    pub(super) fn columns<const N: usize>(&self) -> [[&[f64]; N]; 2] {
        std::array::from_fn(|k| std::array::from_fn(|j| self.component(k * N + j)))
    }

    /// Displacement of a coordinate, m.
    #[inline(always)]
    pub fn displacement(&self, coordinate: usize) -> &[f64] {
        self.component(coordinate)
    }

    /// Velocity of a coordinate, m/s.
    #[inline(always)]
    pub fn velocity(&self, coordinate: usize) -> &[f64] {
        self.component(self.coordinates() + coordinate)
    }

    /// Copies the state at a node.
    pub(crate) fn read(&self, node: usize, state: &mut [f64]) {
        for (c, value) in state.iter_mut().enumerate() {
            *value = self.component(c)[node];
        }
    }

    /// Sets the state at a node.
    pub(crate) fn write(&mut self, node: usize, state: &[f64]) {
        for (c, value) in state.iter().enumerate() {
            self.component_mut(c)[node] = *value;
        }
    }

    /// The first node whose state is not finite; `None` for a response that is finite. Once not finite, it remains so: the last node decides.
    pub(crate) fn first_not_finite(&self) -> Option<usize> {
        let is_finite = |i: usize| (0..self.components()).all(|c| self.component(c)[i].is_finite());
        match is_finite(self.nodes - 1) {
            true => None,
            false => (0..self.nodes).find(|i| !is_finite(*i)),
        }
    }
}
