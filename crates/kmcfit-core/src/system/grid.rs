//! Equally spaced time grid, and points of time on it.

/// Grid of `nodes` equally spaced times from `start` to `start + duration`: `t_i = start + i dt`, `dt = duration / (nodes - 1)`,
/// with `nodes - 1` steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    start: f64,
    duration: f64,
    nodes: usize,
}

impl Grid {
    /// Smallest number of nodes, as second differences require.
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

    /// Start in s.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Duration in s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Time of node `i` in s.
    pub fn time(&self, i: usize) -> f64 {
        self.start + i as f64 * self.step()
    }

    /// Index of the node nearest to a time (s).
    pub fn nearest(&self, time: f64) -> usize {
        let position = ((time - self.start) / self.step()).round().max(0.0);
        (position as usize).min(self.nodes - 1)
    }

    /// Times of all nodes in s.
    pub fn times(&self) -> Vec<f64> {
        (0..self.nodes).map(|i| self.time(i)).collect()
    }

    /// Time rounded to a decimal place below a tenth of a step.
    pub fn round_time(&self, time: f64) -> f64 {
        round_time(time, self.step())
    }

    /// Grid over the same interval with another number of nodes; `None` as in [`Grid::new`].
    pub fn with_nodes(&self, nodes: usize) -> Option<Self> {
        Self::new(self.start, self.duration, nodes)
    }
}

/// Time rounded to a decimal place below a tenth of `spacing`, both in s, so that a written time still identifies its sample.
pub fn round_time(time: f64, spacing: f64) -> f64 {
    let decimals = (1.0 - spacing.log10().floor()).clamp(0.0, 12.0);
    let written = format!("{time:.*}", decimals as usize);
    written.parse().unwrap_or(time)
}

/// A point of time on a grid: `fraction` of a step after the left node of step `step`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimePoint {
    /// Step, from 0.
    pub step: usize,
    /// Fraction of the step, 0 at the left node to 1 at the right one.
    pub fraction: f64,
}

impl TimePoint {
    /// Largest distance from a node, in steps, of a time that is taken as the node.
    pub const SAME_TIME: f64 = 1e-6;

    /// Point of `time` (s) on `grid`; `None` outside.
    pub fn of(grid: &Grid, time: f64) -> Option<Self> {
        let x = (time - grid.start()) / grid.step();
        let last = grid.nodes() - 1;
        let nearest = x.round();
        if !(nearest >= 0.0 && nearest <= last as f64) {
            return None;
        }
        if (x - nearest).abs() <= Self::SAME_TIME {
            return Some(Self::node(nearest as usize, grid.nodes()));
        }
        let step = x.floor();
        let inside = step >= 0.0 && step < last as f64;
        inside.then_some(Self {
            step: step as usize,
            fraction: x - step,
        })
    }

    /// Node `node` of a response over `nodes` nodes: the left node of a step, except for the last.
    pub fn node(node: usize, nodes: usize) -> Self {
        match node + 1 < nodes {
            true => Self {
                step: node,
                fraction: 0.0,
            },
            false => Self {
                step: node.saturating_sub(1),
                fraction: 1.0,
            },
        }
    }

    /// Node of this point, if it is one.
    pub fn as_node(self) -> Option<usize> {
        match self.fraction {
            0.0 => Some(self.step),
            1.0 => Some(self.step + 1),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::round_time;

    #[test]
    fn rounded_times_keep_their_samples() {
        let given = [
            (1_700_006_005.02, 0.02),
            (100_005.2 + 1e-11, 0.02),
            (0.1 + 0.2, 0.1),
            (1234.0, 500.0),
        ];
        let expected = [1_700_006_005.02, 100_005.2, 0.3, 1234.0];
        assert_eq!(
            given.map(|(time, spacing)| round_time(time, spacing)),
            expected
        );
    }
}
