//! Multistart: fits from many starting points, and their clusters.
//!
//! Starting points are a Latin hypercube (M. D. McKay, R. J. Beckman, W. J. Conover, *Technometrics* 21 (1979)
//! 239-245): each range is divided into as many parts as there are starting points, and each part is used once.
//! Minima are distinguished by the ratios of the functions to the mass, which a free response determines, and by their
//! responses. Costs do not distinguish them: two different systems may fit equally well, and one minimum may be reached
//! with different accuracy.

mod cluster;
mod finding;

pub use cluster::Cluster;
pub use finding::MultistartFinding;

use super::refit::{nearest, sizes};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::{FitSettings, Status, fit_from};
use crate::threads::map_with_progress;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Ranges of the starting points.
#[derive(Debug, Clone, PartialEq)]
pub enum Ranges {
    /// A range for each parameter, scalars included.
    Parameters(Vec<[f64; 2]>),
    /// A range for each function, whose starting point is constant, then one for each scalar. Ranges of fixed functions are
    /// unused.
    Constants(Vec<[f64; 2]>),
}

impl Ranges {
    /// Bounds of the parameters, from the constraints on single parameters; `None` unless every parameter has two bounds.
    pub fn of_bounds(problem: &Problem) -> Option<Self> {
        let mut ranges = vec![[f64::NEG_INFINITY, f64::INFINITY]; problem.parameters()];
        for group in &problem.constraints.groups {
            for i in 0..group.rows.len() {
                let Some((j, a)) = group.single(i) else {
                    continue;
                };
                let [lower, upper] = group.bounds(i).map(|b| b / a);
                let [low, high] = if a > 0.0 {
                    [lower, upper]
                } else {
                    [upper, lower]
                };
                ranges[j] = [ranges[j][0].max(low), ranges[j][1].min(high)];
            }
        }
        let bounded = ranges.iter().flatten().all(|b| b.is_finite());
        bounded.then_some(Self::Parameters(ranges))
    }
}

/// Settings of a multistart analysis.
#[derive(Debug, Clone)]
pub struct Multistart {
    /// Ranges of the starting points.
    pub ranges: Ranges,
    /// Number of starting points.
    pub starts: usize,
    /// Seed of the starting points.
    pub seed: u64,
    /// Largest number of threads; results do not depend on it.
    pub threads: usize,
    /// Settings of the fits.
    pub settings: FitSettings,
}

/// One fit.
#[derive(Debug, Clone)]
pub struct StartRun {
    /// Starting point, feasible.
    pub start: Vec<f64>,
    /// Minimum found; `None` if the simulation at the starting point fails or no feasible point exists.
    pub found: Option<LocalOptimum>,
    /// Status of the fit.
    pub status: Status,
    /// Reason for the status, as a sentence.
    pub reason: String,
}

/// Final point of one fit.
#[derive(Debug, Clone)]
pub struct LocalOptimum {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Cost, coefficients and responses.
    pub evaluation: Evaluation,
    /// Iterations.
    pub iterations: usize,
}

/// Results of all fits.
#[derive(Debug, Clone)]
pub struct Waterfall {
    /// Fits in the order of the starting points.
    pub runs: Vec<StartRun>,
    /// Indices of the fits with a result, by rising cost.
    pub order: Vec<usize>,
}

/// Starting points of `how`, before projection onto the constraints.
///
/// # Panics
/// If there is not one range for each parameter, or function and scalar.
pub fn starts(problem: &Problem, how: &Multistart) -> Vec<Vec<f64>> {
    let (Ranges::Parameters(ranges) | Ranges::Constants(ranges)) = &how.ranges;
    let mut columns = Vec::with_capacity(ranges.len());
    for (j, [low, high]) in ranges.iter().enumerate() {
        let mut random = ChaCha8Rng::seed_from_u64(how.seed);
        random.set_stream(j as u64);
        let mut cells: Vec<usize> = (0..how.starts).collect();
        for i in (1..cells.len()).rev() {
            cells.swap(i, random.random_range(0..=i));
        }
        let position = |cell: usize| {
            let share = (cell as f64 + random.random_range(0.0..1.0)) / how.starts as f64;
            low + share * (high - low)
        };
        columns.push(cells.into_iter().map(position).collect::<Vec<f64>>());
    }
    let drawn = (0..how.starts).map(|i| columns.iter().map(|c| c[i]).collect::<Vec<f64>>());
    match &how.ranges {
        Ranges::Parameters(ranges) => {
            assert_eq!(
                ranges.len(),
                problem.parameters(),
                "one range per parameter"
            );
            drawn.collect()
        }
        Ranges::Constants(ranges) => {
            let functions = problem.functions.ranges().len();
            let scalars = problem.functions.scalars().len();
            assert_eq!(ranges.len(), functions + scalars, "one range each");
            drawn.map(|levels| constants(problem, &levels)).collect()
        }
    }
}

fn constants(problem: &Problem, levels: &[f64]) -> Vec<f64> {
    let grid = &problem.system.grid;
    let mut theta = Vec::with_capacity(problem.parameters());
    for (function, level) in problem.functions.iter().zip(levels) {
        if let Some(basis) = &function.basis {
            theta.extend(basis.constant(grid, *level));
        }
    }
    theta.extend(&levels[problem.functions.ranges().len()..]);
    theta
}

/// Runs all fits; a failed fit is listed with its reason.
pub fn multistart(problem: &Problem, how: &Multistart) -> Waterfall {
    let starts = starts(problem, how);
    let runs = map_with_progress(starts.len(), how.threads, |i| run(problem, how, &starts[i]));
    let mut order: Vec<usize> = (0..runs.len())
        .filter(|i| runs[*i].found.is_some())
        .collect();
    let cost = |i: &usize| {
        let found = runs[*i].found.as_ref();
        found.map_or(f64::INFINITY, |f| f.evaluation.cost)
    };
    // A stable sort keeps equal costs in the order of the starting points.
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    Waterfall { runs, order }
}

fn run(problem: &Problem, how: &Multistart, start: &[f64]) -> StartRun {
    let failed = |start: &[f64], reason: String| StartRun {
        start: start.to_vec(),
        found: None,
        status: Status::Failed,
        reason,
    };
    let Some(start) = nearest(problem, start, &sizes(problem, start)) else {
        return failed(
            start,
            "the start cannot be brought into the constraints".into(),
        );
    };
    match fit_from(problem, &start, &how.settings) {
        Err(breakdown) => failed(&start, breakdown.to_string()),
        Ok(fit) => StartRun {
            start,
            found: Some(LocalOptimum {
                parameters: fit.best.parameters,
                evaluation: fit.best.evaluation,
                iterations: fit.history.len(),
            }),
            status: fit.outcome.status,
            reason: fit.outcome.reason.to_string(),
        },
    }
}

impl Waterfall {
    /// Sorted costs.
    pub fn costs(&self) -> Vec<f64> {
        let found = self
            .order
            .iter()
            .filter_map(|i| self.runs[*i].found.as_ref());
        found.map(|f| f.evaluation.cost).collect()
    }
}
