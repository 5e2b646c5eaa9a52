//! Data-consistent extremes: smallest and largest value of a quantity over all parameters compatible with the data.
//!
//! For a quantity `q` (the value of a function, or `k/m`, at one time)
//!
//! ```text
//! max or min q(theta)   subject to   misfit(theta) <= limit,  the constraints of the model,
//!                                    |L_j theta_j - target_j|^2 <= budget_j  (if stated)
//! ```
//!
//! `misfit` is that of the samples plus the priors of the scalar parameters; penalties enter through the budgets only.
//! Extremes at many times form an envelope.
//!
//! Method: sequential convex programming. The predictions are linearised, which makes the misfit limit a second-order
//! cone `|W (r + J d)| <= sqrt(limit)`; the trust region is a box of variable size. Gauss–Newton projections restore trial
//! points beyond the limit, and each accepted point is simulated anew. With many parameters the states are unknowns as
//! well, linked by the linearised steps.
//!
//! Each result is a feasible system, so the true envelope is at least as wide. The search is local; more starting points
//! can only widen the envelope.
//!
//! Sources: A. R. Conn, N. I. M. Gould, P. L. Toint, *Trust-Region Methods*, SIAM 2000, chapter 15, with second-order
//! corrections. Data2Dynamics has a comparable analysis.

mod envelope;
mod search;

pub use envelope::{envelopes, is_within_rounding};

use crate::functions::Penalty;
use crate::identifiability::{Curve, Target};
use crate::problem::Problem;
use crate::system::TimePoint;
use crate::threads::map_with_progress;
use search::Search;

/// Limits of the admissible systems, in addition to the constraints of the problem.
#[derive(Debug, Clone)]
pub struct MisfitLimit {
    /// Largest misfit, in the unit of the cost: the least chi-square plus a quantile for samples with sigma, or a stated `J`.
    pub misfit: f64,
    /// Penalties with the largest value of `|L theta - target|^2`.
    pub budgets: Vec<(Penalty, f64)>,
    /// Largest value of a quantity, as a multiple of its natural size. It ends the search where a quantity is unbounded,
    /// like the mass of a free response.
    pub reach: f64,
    /// Largest number of convex programs for one extreme.
    pub programs: usize,
}

impl MisfitLimit {
    /// A misfit limit without budgets; quantities up to ten times their natural sizes.
    pub fn of(misfit: f64) -> Self {
        Self {
            misfit,
            budgets: Vec::new(),
            reach: 10.0,
            programs: 60,
        }
    }
}

/// End of the search for an extreme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExtremeStatus {
    /// The convex programs predict no further gain.
    Converged,
    /// The quantity has reached the search limit.
    #[serde(rename = "range_limit")]
    SearchLimit,
    /// No trial could be restored to the misfit limit.
    #[serde(rename = "stalled")]
    NoFeasibleStep,
    /// The limit of convex programs is reached.
    #[serde(rename = "iteration_limit")]
    ProgramLimit,
}

/// An extreme of a quantity and the system that attains it.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// Name of the quantity, as in `mass at 3 s`.
    pub function: String,
    /// Time of the quantity, s.
    pub time: Option<f64>,
    /// True for the largest value, false for the smallest.
    pub largest: bool,
    /// Value of the quantity.
    pub value: f64,
    /// Parameters of the system, scalars included.
    pub parameters: Vec<f64>,
    /// Misfit from a new simulation, at most the limit.
    pub misfit: f64,
    /// End of the search.
    pub ended: ExtremeStatus,
    /// Convex programs solved.
    pub programs: usize,
}

impl Extreme {
    /// Name of the extreme, as in `largest mass at 3 s`.
    pub fn name(&self) -> String {
        let way = if self.largest { "largest" } else { "smallest" };
        format!("{way} {}", self.function)
    }
}

/// Smallest and largest value of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtremePair {
    /// Smallest value.
    pub low: Extreme,
    /// Largest value.
    pub high: Extreme,
}

/// Quantities for the envelope of a curve: its values at those of `times` (s) within the grid. The mass of a ratio is positive.
pub fn values_at(problem: &Problem, curve: Curve, times: &[f64]) -> Vec<Target> {
    let grid = &problem.system.grid;
    let each = times.iter().filter(|t| TimePoint::of(grid, **t).is_some());
    each.map(|t| Target::Value(curve, *t)).collect()
}

/// Smallest and largest value of each target, each from all feasible `starts`, on up to `threads` threads; `None` if no
/// start is feasible.
pub fn extreme_pairs(
    problem: &Problem,
    starts: &[Vec<f64>],
    targets: &[Target],
    level: &MisfitLimit,
    threads: usize,
) -> Option<Vec<ExtremePair>> {
    let search = Search { problem, level };
    let usable: Vec<&Vec<f64>> = starts
        .iter()
        .filter(|s| search.point(s).is_some())
        .collect();
    if usable.is_empty() {
        return None;
    }
    let job = |index: usize| {
        let target = &targets[index / 2];
        let side = if index.is_multiple_of(2) { -1.0 } else { 1.0 };
        let found = usable
            .iter()
            .filter_map(|start| search.extreme(start, target, side));
        found
            .max_by(|a, b| (side * a.value).total_cmp(&(side * b.value)))
            .expect("the start was within the level")
    };
    let mut extremes = map_with_progress(2 * targets.len(), threads, job).into_iter();
    let mut bands = Vec::with_capacity(targets.len());
    while let (Some(low), Some(high)) = (extremes.next(), extremes.next()) {
        bands.push(ExtremePair { low, high });
    }
    Some(bands)
}

/// One extreme from one start; `None` if the start violates the misfit limit or the constraints.
pub fn extreme(
    problem: &Problem,
    start: &[f64],
    target: &Target,
    largest: bool,
    level: &MisfitLimit,
) -> Option<Extreme> {
    let side = if largest { 1.0 } else { -1.0 };
    Search { problem, level }.extreme(start, target, side)
}
