//! Equally spaced time nodes.

/// `nodes` equally spaced times from `start` to `start + duration`: `t_i = start + i dt`,
/// `dt = duration / (nodes - 1)`. `nodes` counts nodes, so there are `nodes - 1` steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    start: f64,
    duration: f64,
    nodes: usize,
}

impl Grid {
    /// The fewest nodes that second differences can be taken on.
    pub const FEWEST_NODES: usize = 3;

    /// A grid of `nodes` nodes over `[start, start + duration]` (s), or `None` unless the numbers
    /// are finite, the duration is positive and there are at least [`Grid::FEWEST_NODES`] nodes.
    pub fn new(start: f64, duration: f64, nodes: usize) -> Option<Self> {
        let usable = start.is_finite()
            && duration.is_finite()
            && duration > 0.0
            && nodes >= Self::FEWEST_NODES
            && duration / (nodes - 1) as f64 > 0.0;
        usable.then_some(Self {
            start,
            duration,
            nodes,
        })
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Step `dt` in s.
    pub fn step(&self) -> f64 {
        self.duration / (self.nodes - 1) as f64
    }

    /// First time in s.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Length in s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Time of node `i` in s.
    pub fn time(&self, i: usize) -> f64 {
        self.start + i as f64 * self.step()
    }

    /// All times in s.
    pub fn times(&self) -> Vec<f64> {
        (0..self.nodes).map(|i| self.time(i)).collect()
    }

    /// The same interval with another number of nodes; `None` as in [`Grid::new`].
    pub fn with_nodes(&self, nodes: usize) -> Option<Self> {
        Self::new(self.start, self.duration, nodes)
    }
}
