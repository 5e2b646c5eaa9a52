//! A function of constant levels between jumps, in place of one with a value for each node or interval.
//!
//! The parameters `theta_j` of neighbouring nodes or intervals with equal values are one level, `theta = G levels` with an indicator
//! matrix `G`: the linear equalities within each level are eliminated.

use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::problem::{Jumps, Problem};
use std::ops::Range;

/// Runs of parameters of a function with equal values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Levels {
    /// First parameter of each level; the first is 0.
    starts: Vec<usize>,
    parameters: usize,
}

impl Levels {
    /// Levels of values in time order: neighbours that differ by at most `tolerance` belong to one level.
    pub fn of(values: &[f64], tolerance: f64) -> Self {
        let jumps = values.windows(2).enumerate();
        let jumps = jumps.filter(|(_, pair)| (pair[1] - pair[0]).abs() > tolerance);
        let starts = std::iter::once(0).chain(jumps.map(|(i, _)| i + 1));
        Self {
            starts: starts.collect(),
            parameters: values.len(),
        }
    }

    /// Number of levels.
    pub fn count(&self) -> usize {
        self.starts.len()
    }

    /// Number of jumps.
    pub fn jumps(&self) -> usize {
        self.starts.len() - 1
    }

    /// The levels without jump `k`.
    pub fn without(&self, k: usize) -> Self {
        let mut fewer = self.clone();
        fewer.starts.remove(k + 1);
        fewer
    }

    /// The levels with jumps `k` and `k + 1` joined to one, at the time that preserves the integral of the function with these
    /// `values` of the levels.
    pub fn joined(&self, k: usize, values: &[f64]) -> Self {
        let [before, between, after] = [values[k], values[k + 1], values[k + 2]];
        let share = (after - between) / (after - before);
        let share = if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            0.5
        };
        let [first, last] = [self.starts[k + 1], self.starts[k + 2]];
        let mut fewer = self.without(k);
        fewer.starts[k + 1] = first + (share * (last - first) as f64).round() as usize;
        fewer
    }

    /// The levels with jump `k` moved by some parameters; `None` where it would meet another jump or an end.
    pub fn moved(&self, k: usize, by: isize) -> Option<Self> {
        let to = self.starts[k + 1].checked_add_signed(by)?;
        let next = self.starts.get(k + 2).copied().unwrap_or(self.parameters);
        let mut moved = self.clone();
        moved.starts[k + 1] = to;
        (self.starts[k] < to && to < next).then_some(moved)
    }

    /// Parameters of level `k`.
    fn range(&self, k: usize) -> Range<usize> {
        let end = self.starts.get(k + 1).copied().unwrap_or(self.parameters);
        self.starts[k]..end
    }

    /// Level of a parameter.
    fn level(&self, parameter: usize) -> usize {
        self.starts.partition_point(|start| *start <= parameter) - 1
    }

    /// Mean of each level.
    fn means(&self, values: &[f64]) -> Vec<f64> {
        let mean = |range: Range<usize>| {
            let count = range.len() as f64;
            values[range].iter().sum::<f64>() / count
        };
        (0..self.count()).map(|k| mean(self.range(k))).collect()
    }
}

/// The problem without the total-variation penalty of rule `bic`, with the function of that penalty constant between jumps.
pub(super) struct LevelModel<'a> {
    whole: &'a Problem,
    function: usize,
}

impl<'a> LevelModel<'a> {
    pub fn new(whole: &'a Problem, function: usize) -> Self {
        Self { whole, function }
    }

    fn range(&self) -> Range<usize> {
        self.whole.functions.ranges()[self.function].clone()
    }

    /// Parameters of the levels nearest to the parameters `theta` of the whole problem.
    pub fn restricted(&self, levels: &Levels, theta: &[f64]) -> Vec<f64> {
        let range = self.range();
        let own = levels.means(&theta[range.clone()]);
        [&theta[..range.start], &own, &theta[range.end..]].concat()
    }

    /// Parameters of the whole problem for the parameters `theta` of the levels.
    pub fn embedded(&self, levels: &Levels, theta: &[f64]) -> Vec<f64> {
        let range = self.range();
        let own = (0..range.len()).map(|j| theta[range.start + levels.level(j)]);
        let own: Vec<f64> = own.collect();
        let rest = range.start + levels.count();
        [&theta[..range.start], &own, &theta[rest..]].concat()
    }

    /// Times of the jumps, s: knots, or the middle between nodes.
    fn times(&self, levels: &Levels) -> Vec<f64> {
        let grid = &self.whole.system.grid;
        let basis = self.whole.functions.get(self.function).basis.as_ref();
        let time = |start: &usize| match basis {
            Some(Basis::PiecewiseConstant { knots }) => knots[*start],
            _ => 0.5 * (grid.time(start - 1) + grid.time(*start)),
        };
        levels.starts[1..].iter().map(time).collect()
    }

    fn level_function(&self, levels: &Levels, jumps: &[f64]) -> CoefficientFunction {
        let grid = &self.whole.system.grid;
        let whole = self.whole.functions.get(self.function);
        let start = levels.means(&whole.start);
        let level = match jumps {
            [] => CoefficientFunction::constant(whole.quantity, start[0], grid.nodes()),
            jumps => {
                let ends = [grid.start(), grid.start() + grid.duration()];
                let knots = [&ends[..1], jumps, &ends[1..]].concat();
                let basis = Basis::PiecewiseConstant { knots };
                CoefficientFunction::free(whole.quantity, basis, grid, start)
            }
        };
        CoefficientFunction {
            owner: whole.owner.clone(),
            offset: whole.offset.clone(),
            ..level
        }
    }

    /// The problem in the parameters of the levels.
    pub fn problem(&self, levels: &Levels) -> Problem {
        let (whole, range) = (self.whole, self.range());
        let times = self.times(levels);
        let mut list: Vec<CoefficientFunction> = whole.functions.iter().cloned().collect();
        list[self.function] = self.level_function(levels, &times);
        let functions = Parameterization::with_coefficient_sets(
            list,
            whole.functions.coefficient_sets().to_vec(),
            whole.functions.nodes(),
            whole.system.grid.step(),
        );
        let functions = functions
            .expect("sums of independent columns are independent")
            .with_scalars(whole.functions.scalars().to_vec());
        let column = |j: usize, a: f64| match j {
            _ if j < range.start => (j, a),
            _ if j < range.end => (range.start + levels.level(j - range.start), a),
            _ => (j + levels.count() - range.len(), a),
        };
        let mut problem = whole.clone();
        let parts = problem.parts_mut();
        parts.functions = functions;
        parts.constraints = whole.constraints.in_parameters(&column);
        parts.soft = (whole.soft.iter())
            .map(|group| group.in_parameters(&column))
            .collect();
        parts.variations.retain(|v| v.function != self.function);
        parts.jumps = vec![Jumps {
            function: self.function,
            times,
        }];
        problem
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    #[test]
    fn neighbours_within_the_tolerance_are_one_level() {
        let levels = Levels::of(&[1.0, 1.0, 1.5, 1.50001, 3.0, 1.5], 1e-3);
        assert_eq!(levels.starts, [0, 2, 4, 5]);
        assert_eq!(
            levels.means(&[1.0, 3.0, 5.0, 5.0, 7.0, 9.0]),
            [2.0, 5.0, 7.0, 9.0]
        );
        assert_eq!(
            (0..6).map(|j| levels.level(j)).collect::<Vec<_>>(),
            [0, 0, 1, 1, 2, 3]
        );
        assert_eq!(levels.without(1).starts, [0, 2, 5]);
        assert_eq!(levels.joined(0, &[1.0, 1.5, 2.0, 0.0]).starts, [0, 3, 5]);
        assert_eq!(levels.joined(0, &[1.0, 1.0, 1.0, 0.0]).starts, [0, 3, 5]);
        assert_eq!(levels.joined(0, &[1.0, 2.0, 1.5, 0.0]).starts, [0, 2, 5]);
        assert_eq!(levels.moved(0, 1).map(|l| l.starts), Some(vec![0, 3, 4, 5]));
        assert_eq!(levels.moved(0, 2), None);
        assert_eq!(levels.moved(2, 1), None);
        assert_eq!(levels.moved(0, -2), None);
    }

    /// The response of the levels is that of the whole problem with equal values.
    #[test]
    fn levels_are_the_function_with_equal_values() {
        let times: Vec<f64> = (0..=80).map(|i| 0.1 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| (1.3 * t).cos()).collect();
        for stiffness in [
            CoefficientSpec::nodal(1.7),
            CoefficientSpec::piecewise_constant(9, 1.7),
        ] {
            let record = Record::new("decay").displacement(&times, &samples);
            let parts = [
                CoefficientSpec::fixed(1.0),
                CoefficientSpec::constant(0.1),
                stiffness.min(0.5).total_variation(3.0),
            ];
            let whole = Builder::new(parts)
                .record(record)
                .build()
                .expect("a problem");
            let model = LevelModel::new(&whole, 2);
            let range = model.range();
            let values: Vec<f64> = (0..range.len())
                .map(|j| if 3 * j < range.len() { 1.5 } else { 2.0 })
                .collect();
            let levels = Levels::of(&values, 1e-9);
            let mut theta = whole.start();
            theta[range].copy_from_slice(&values);
            let reduced = model.problem(&levels);
            let small = model.restricted(&levels, &theta);
            assert_eq!(small.len(), reduced.parameters());
            assert_eq!(model.embedded(&levels, &small), theta);
            let [a, b] = [(&whole, &theta), (&reduced, &small)]
                .map(|(problem, theta)| problem.evaluate(theta).expect("a response").predictions);
            let (a, b) = (a.iter().flatten().flatten(), b.iter().flatten().flatten());
            assert!(a.zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
            let excess = |problem: &Problem, theta: &[f64]| {
                problem
                    .constraints
                    .largest_violation(theta)
                    .expect("a bound")
                    .relative
            };
            assert!((excess(&whole, &theta) - excess(&reduced, &small)).abs() < 1e-12);
            assert!(reduced.variations.is_empty() && reduced.jumps[0].times.len() == 1);
        }
    }
}
