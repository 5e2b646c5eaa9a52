//! Responses at the nodes.

/// Displacement and velocity at all nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Displacement in m.
    pub displacement: Vec<f64>,
    /// Velocity in m/s.
    pub velocity: Vec<f64>,
}

impl Trajectory {
    /// A response of zeros over `nodes` nodes.
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

    /// Whether all of it is finite. A response that has left the finite numbers never returns, so the last node
    /// decides.
    pub(crate) fn is_finite(&self) -> bool {
        let last = self.nodes() - 1;
        self.displacement[last].is_finite() && self.velocity[last].is_finite()
    }
}
