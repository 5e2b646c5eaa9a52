//! Responses at the nodes of the grid.

/// Displacement and velocity at all nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Displacement in m.
    pub displacement: Vec<f64>,
    /// Velocity in m/s.
    pub velocity: Vec<f64>,
}

impl Trajectory {
    /// Trajectory of zeros over `nodes` nodes.
    pub fn zeros(nodes: usize) -> Self {
        Self {
            displacement: vec![0.0; nodes],
            velocity: vec![0.0; nodes],
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.displacement.len()
    }

    /// True if all values are finite. Once not finite, a response remains so; the last node decides.
    pub(crate) fn is_finite(&self) -> bool {
        let last = self.nodes() - 1;
        self.displacement[last].is_finite() && self.velocity[last].is_finite()
    }
}
