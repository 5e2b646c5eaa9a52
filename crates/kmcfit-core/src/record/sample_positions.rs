//! Positions of the samples of a channel on the grid.

use crate::system::{Grid, TimePoint};
use std::sync::Arc;

/// Positions of samples on the grid, without a delay.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum SamplePositions {
    /// Sample `i` lies on node `i` of a response over `nodes` nodes.
    Nodes {
        /// Number of samples.
        samples: usize,
        nodes: usize,
    },
    /// Anywhere; shared by copies.
    Points(Arc<Vec<TimePoint>>),
}

impl SamplePositions {
    /// Positions of `times` (s); `None` where one is not within the first `nodes` nodes.
    pub fn of(times: &[f64], grid: &Grid, nodes: usize) -> Option<Self> {
        let position = |t: &f64| {
            let position = TimePoint::of(grid, *t)?;
            match position.as_node() {
                Some(node) => (node < nodes).then(|| TimePoint::node(node, nodes)),
                None => (position.step + 1 < nodes).then_some(position),
            }
        };
        let on_nodes = times.iter().enumerate();
        let on_nodes =
            on_nodes.take_while(|(i, t)| position(t).and_then(TimePoint::as_node) == Some(*i));
        let samples = on_nodes.count();
        if samples == times.len() {
            return Some(Self::Nodes { samples, nodes });
        }
        let mut points = Vec::with_capacity(times.len());
        points.extend((0..samples).map(|node| TimePoint::node(node, nodes)));
        for t in &times[samples..] {
            points.push(position(t)?);
        }
        Some(Self::Points(Arc::new(points)))
    }

    /// Position of sample `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> TimePoint {
        match self {
            Self::Nodes { nodes, .. } => TimePoint::node(i, *nodes),
            Self::Points(points) => points[i],
        }
    }

    /// Positions of the first `count` samples, or of all.
    pub fn first(&self, count: usize) -> Self {
        match self {
            Self::Nodes { samples, nodes } => Self::Nodes {
                samples: count.min(*samples),
                nodes: *nodes,
            },
            Self::Points(points) => {
                Self::Points(Arc::new(points[..count.min(points.len())].to_vec()))
            }
        }
    }

    /// True if sample `i` lies on node `i`.
    #[inline(always)]
    pub fn are_nodes(&self) -> bool {
        matches!(self, Self::Nodes { .. })
    }

    fn len(&self) -> usize {
        match self {
            Self::Nodes { samples, .. } => *samples,
            Self::Points(points) => points.len(),
        }
    }

    /// Positions of all samples.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = TimePoint> + Clone + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// Number of samples before step `steps`.
    pub fn count_within(&self, steps: usize) -> usize {
        match self {
            Self::Nodes { samples, nodes } => match steps + 1 < *nodes {
                true => steps.min(*samples),
                false => *samples,
            },
            Self::Points(points) => points.partition_point(|p| p.step < steps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions at nodes are those of a list of points.
    #[test]
    fn positions_on_nodes_are_points() {
        let grid = Grid::new(1.0, 2.0, 11).expect("a grid");
        for nodes in [5, 11] {
            for samples in [1, 4, nodes] {
                let times: Vec<f64> = (0..samples).map(|i| grid.time(i)).collect();
                let positions = SamplePositions::of(&times, &grid, nodes).expect("places");
                assert!(positions.are_nodes());
                let points: Vec<TimePoint> = positions.iter().collect();
                let expected = (0..samples).map(|i| TimePoint::node(i, nodes));
                assert!(points.iter().copied().eq(expected));
                let listed = SamplePositions::Points(Arc::new(points));
                for steps in 0..12 {
                    assert_eq!(positions.count_within(steps), listed.count_within(steps));
                    let [a, b] = [&positions, &listed].map(|of| of.first(steps));
                    assert!(a.iter().eq(b.iter()));
                }
            }
            let outside: Vec<f64> = (0..=nodes).map(|i| grid.time(i)).collect();
            assert_eq!(SamplePositions::of(&outside, &grid, nodes), None);
        }
        let between = [grid.time(0), grid.time(1), 1.5, grid.time(7)];
        let positions = SamplePositions::of(&between, &grid, 11).expect("places");
        assert!(!positions.are_nodes());
        assert_eq!(positions.get(1), TimePoint::node(1, 11));
        assert_eq!(positions.get(2).step, 2);
        assert_eq!(positions.get(3), TimePoint::node(7, 11));
    }
}
