//! Predictors of samples after gaps of equally spaced ones, under an autoregressive law.

use super::autoregression::Autoregression;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Number of spacings across which noise counts as independent.
const LONGEST_GAP: usize = 1000;

/// Gaps of equally spaced samples by the samples about them: many are alike, single samples left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Gaps {
    /// Places of the samples, in spacings before the last one, and the number of those after the gap.
    shapes: Vec<(Vec<usize>, usize)>,
    /// Shape of the gap before each run but the first.
    of_runs: Vec<usize>,
}

/// Best linear predictor of one sample from those before it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Predictor {
    /// Index of the sample.
    pub sample: usize,
    /// Coefficients of the samples before it, the last first.
    pub coefficients: Arc<[f64]>,
    /// Variance of its error, relative to that of the noise.
    pub variance: f64,
}

impl Gaps {
    /// Each of the first `p` samples after a gap is predicted from those since the gap and the last `2 p + 1` before it, as far back as the
    /// last `p` in a row.
    pub fn of(order: usize, runs: &[Range<usize>], times: &[f64]) -> Self {
        let spacing = runs.iter().find(|run| run.len() > 1);
        let Some(spacing) = spacing.map(|run| times[run.start + 1] - times[run.start]) else {
            return Self::default();
        };
        let mut gaps = Self::default();
        let mut known = BTreeMap::new();
        for (before, run) in runs.iter().enumerate().skip(1) {
            let last = run.end.min(run.start + order) - 1;
            // What lies before `p` samples in a row adds nothing.
            let mut whole = runs[..before].iter().rev().filter(|run| run.len() >= order);
            let enough = whole.next().map_or(0, |run| run.end - order);
            let first = enough.max(run.start.saturating_sub(2 * order + 1));
            let position = |i: usize| ((times[last] - times[i]) / spacing).round() as usize;
            let near = (first..=last).map(position);
            let near = near.skip_while(|position| *position >= LONGEST_GAP);
            let shape = (near.collect(), last + 1 - run.start);
            let shapes = &mut gaps.shapes;
            let found = known.entry(shape).or_insert_with_key(|shape| {
                shapes.push(shape.clone());
                shapes.len() - 1
            });
            gaps.of_runs.push(*found);
        }
        gaps
    }

    /// Predictors of the first samples of each run but the first: one factorisation a shape.
    pub fn predictors(&self, process: &Autoregression, runs: &[Range<usize>]) -> Vec<Predictor> {
        let positions = self.shapes.iter().flat_map(|(positions, _)| positions);
        let lags = process.autocorrelation(positions.max().map_or(0, |most| most + 1));
        let shapes = self.shapes.iter();
        let found = shapes.map(|(positions, count)| last_predictors(positions, *count, &lags));
        let found: Vec<Vec<(Arc<[f64]>, f64)>> = found.collect();
        let of_run = |(run, shape): (&Range<usize>, &usize)| {
            let samples = (run.start..).zip(found[*shape].clone());
            samples.map(|(sample, (coefficients, variance))| Predictor {
                sample,
                coefficients,
                variance,
            })
        };
        let later = runs.iter().skip(1).zip(&self.of_runs);
        later.flat_map(of_run).collect()
    }
}

/// Best linear predictors of each of the last `count` samples at `positions`, in spacings before the last one, from all before it:
/// coefficients, the nearest sample first, and the variance of the error. Row `m` of the Cholesky factor `L` of the correlations
/// holds both: `L_m^T c = l_m` with its part `l_m` left of the diagonal, variance `L_mm^2`.
fn last_predictors(positions: &[usize], count: usize, lags: &[f64]) -> Vec<(Arc<[f64]>, f64)> {
    let n = positions.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| lags[positions[i].abs_diff(positions[j])]);
    let Some(factor) = matrix.cholesky() else {
        return Vec::new();
    };
    let lower = factor.l_dirty();
    let predictor = |m: usize| {
        let mut coefficients = lower.view((m, 0), (1, m)).transpose();
        let earlier = lower.view((0, 0), (m, m));
        let solved = earlier.tr_solve_lower_triangular_mut(&mut coefficients);
        debug_assert!(solved, "a Cholesky factor has a positive diagonal");
        let coefficients = coefficients.iter().rev().copied().collect();
        (coefficients, lower[(m, m)].powi(2))
    };
    (n - count..n).map(predictor).collect()
}
