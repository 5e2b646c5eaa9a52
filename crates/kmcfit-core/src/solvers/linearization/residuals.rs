//! Weighted residuals of the samples.

use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::Channel;
use crate::simd::tall_qr::RowBlock;
use std::ops::Range;

/// Weighted residuals of the samples of all channels.
pub(super) struct Residuals {
    /// Roots of the weights, `sqrt(w)`; for correlated noise those of the whitened residuals.
    pub weight_roots: Vec<f64>,
    /// Weighted residuals, `sqrt(w) r`.
    pub weighted: Vec<f64>,
}

impl Residuals {
    /// Residuals at an evaluated point.
    pub fn at(problem: &Problem, evaluation: &Evaluation) -> Self {
        let mut all = Self::with_capacity(problem.sample_count());
        for (channel, predicted) in problem.predicted(evaluation) {
            all.push(channel, predicted, 0..channel.len());
        }
        all
    }

    pub fn with_capacity(samples: usize) -> Self {
        Self {
            weight_roots: Vec::with_capacity(samples),
            weighted: Vec::with_capacity(samples),
        }
    }

    /// Replaces the residuals by those of a block of rows of the Jacobian, which belong to one channel.
    pub fn set_block(&mut self, problem: &Problem, evaluation: &Evaluation, block: &RowBlock) {
        self.weight_roots.clear();
        self.weighted.clear();
        let mut first = block.first;
        for (channel, predicted) in problem.predicted(evaluation) {
            match first.checked_sub(channel.len()) {
                Some(rest) => first = rest,
                None => return self.push(channel, predicted, first..first + block.count),
            }
        }
    }

    /// Appends some samples of a channel, all of them for correlated noise.
    pub fn push(&mut self, channel: &Channel, predicted: &[f64], samples: Range<usize>) {
        let Self {
            weight_roots,
            weighted,
        } = self;
        if channel.correlation().is_some() {
            assert_eq!(samples, 0..channel.len(), "whitening needs all samples");
            let majorant = channel.majorant(predicted);
            weight_roots.extend(majorant.weight_roots);
            weighted.extend(majorant.weighted);
            return;
        }
        let first = weight_roots.len();
        let residuals = || channel.residuals_of(predicted, samples.clone());
        match channel.uniform_weights() {
            Some([inner, ends]) => {
                weight_roots.resize(first + samples.len(), inner.sqrt());
                for end in [0, channel.len() - 1] {
                    if samples.contains(&end) {
                        weight_roots[first + end - samples.start] = ends.sqrt();
                    }
                }
            }
            None => {
                let each = samples.clone().zip(residuals());
                weight_roots.extend(each.map(|(i, r)| channel.weight(i, r).sqrt()));
            }
        }
        let pairs = residuals().zip(&weight_roots[first..]);
        weighted.extend(pairs.map(|(r, root)| root * r));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Weighting;
    use crate::system::Grid;

    /// The squares of the weighted residuals sum to the cost, in which samples at both ends have half weight; so do those of
    /// parts of the samples.
    #[test]
    fn squares_of_weighted_residuals_sum_to_the_cost() {
        let grid = Grid::new(0.0, 1.0, 11).expect("a grid");
        let spacing = grid.step();
        let samples = (0..11).map(|i| f64::from(i).sin()).collect();
        let weighting = Weighting::Integral { spacing };
        let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
        let predicted: Vec<f64> = (0..11).map(|i| 2.0 - f64::from(i)).collect();
        let mut whole = Residuals::with_capacity(11);
        whole.push(&channel, &predicted, 0..11);
        let squares: f64 = whole.weighted.iter().map(|r| r * r).sum();
        let cost = channel.cost(&predicted);
        assert!((squares - cost).abs() <= 1e-14 * cost, "{squares} {cost}");
        let mut parts = Residuals::with_capacity(11);
        for samples in [0..1, 1..6, 6..10, 10..11] {
            parts.push(&channel, &predicted, samples);
        }
        assert_eq!(parts.weighted, whole.weighted);
        assert_eq!(parts.weight_roots, whole.weight_roots);
    }
}
