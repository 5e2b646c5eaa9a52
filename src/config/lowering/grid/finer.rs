//! Numbers of nodes of automatic grids that are finer than the first one.

use crate::config::lowering::experiments::RawRecord;
use kmcfit_core::finding::Finding;

/// Most nodes per sample of a refined grid with a stated `auto`, and of one without a statement; the first one has fewer
/// ([`super::auto`]).
const MOST_PER_SAMPLE: [usize; 2] = [1024, 64];

/// Numbers of nodes of finer grids.
#[derive(Debug, Clone, Copy)]
pub struct FinerNodes {
    /// Most nodes.
    pub most: usize,
    /// Sampling intervals in the record of samples that fall on nodes, those of force or base or those of all channels; `None`
    /// without them.
    intervals: Option<f64>,
    /// True where the first grid has a node for each sample.
    pub is_per_sample: bool,
}

impl FinerNodes {
    /// Numbers of at most `most` nodes for records of `duration` s; samples that are equally spaced on `sampling` nodes stay on nodes.
    pub fn of(
        records: &[Option<RawRecord>],
        duration: f64,
        most: usize,
        sampling: Option<usize>,
        is_stated: bool,
    ) -> Self {
        let records = || records.iter().flatten();
        let channels = records().flat_map(|r| &r.channels);
        let samples = channels.map(|c| c.times.len()).max().unwrap_or(2);
        let spacing = records().filter_map(RawRecord::drive_spacing);
        Self {
            most: most.min(samples.saturating_mul(MOST_PER_SAMPLE[usize::from(!is_stated)])),
            intervals: (spacing.reduce(f64::min).map(|spacing| duration / spacing))
                .or_else(|| sampling.map(|nodes| (nodes - 1) as f64)),
            is_per_sample: false,
        }
    }

    /// Smallest number of nodes from `least` on with the samples of the force on nodes.
    pub fn at_least(&self, least: usize) -> usize {
        // Rounding of the interval adds no step to each.
        self.on_samples(least, |each| (each * (1.0 - 1e-9)).ceil())
    }

    /// Number of nodes with the samples of the force on nodes whose ratio to `nodes` is nearest to one.
    pub fn nearest(&self, nodes: usize) -> usize {
        let nearest = |each: f64| {
            let fewer = each.floor();
            fewer + f64::from(each * each > fewer * (fewer + 1.0))
        };
        self.on_samples(nodes, nearest)
    }

    /// Number of nodes with `whole` steps in each interval of the samples of the force, at least one, for those of `nodes` nodes.
    fn on_samples(&self, nodes: usize, whole: impl Fn(f64) -> f64) -> usize {
        let steps = nodes.saturating_sub(1) as f64;
        self.intervals.map_or(nodes, |intervals| {
            (intervals * whole(steps / intervals).max(1.0)).round() as usize + 1
        })
    }
}

/// Note on a grid that was chosen for stable steps.
pub fn stable_nodes(nodes: usize, before: usize) -> Finding {
    let text = format!(
        "grid: {nodes} nodes instead of {before}, for stable steps at the start values of the functions"
    );
    Finding::new("nodes_for_stability", text).with("nodes", nodes)
}

#[cfg(test)]
mod tests {
    use super::FinerNodes;

    #[test]
    fn samples_of_a_force_stay_on_nodes() {
        let free = FinerNodes {
            most: 1000,
            intervals: None,
            is_per_sample: false,
        };
        assert_eq!(free.at_least(42), 42);
        let forced = FinerNodes {
            most: 1000,
            intervals: Some(10.0),
            is_per_sample: false,
        };
        assert_eq!(
            [11, 12, 21, 42].map(|n| forced.at_least(n)),
            [11, 21, 21, 51]
        );
        // Between one and two steps for each interval the limit is the square root of two.
        assert_eq!(
            [2, 11, 15, 16, 25, 26, 42].map(|n| forced.nearest(n)),
            [11, 11, 11, 21, 21, 31, 41]
        );
        assert_eq!(free.nearest(42), 42);
    }
}
