//! The extreme systems among all that explain the samples as well as stated.
//!
//! For a number `q` of the system (a function's value, or `k/m`, at a time)
//!
//! ```text
//! max or min q(theta)   subject to   misfit(theta) <= level,  the model's constraints,
//!                                    |L_j theta_j - target_j|^2 <= budget_j  (if stated)
//! ```
//!
//! over many times this is the widest tube. `misfit` is that of the samples plus the priors of the
//! scalars; penalties have no part in it but through the budgets. It is solved by sequential convex
//! programming: the predictions are linearised, so that the level is one second-order cone
//! `|W (r + J d)| <= sqrt(level)`, with a box of changing size as trust region; a trial that is
//! outside the true level is brought back by Gauss–Newton projections, and every accepted point is a
//! fresh forward solve. With many parameters the states are unknowns beside them, tied by the
//! linearised steps.
//!
//! The result is a system, so the tube is at least as wide as stated; that it is not wider still is
//! known only as far as the local search goes, and more starts can only widen it.
//!
//! The question is that of the pull-apart search of Data2Dynamics. Source of the method: A. R. Conn,
//! N. I. M. Gould, P. L. Toint, *Trust-Region Methods*, SIAM 2000, chapter 15, second-order
//! corrections included.

mod envelope;
mod search;

pub use envelope::{Envelope, envelopes};

use super::functional::{Linear, Target};
use super::parallel::map;
use crate::functions::Penalty;
use crate::problem::Problem;
use search::Search;

/// What bounds the systems beside the problem's own constraints.
#[derive(Debug, Clone)]
pub struct MisfitLimit {
    /// Largest misfit, in the unit of the cost: for samples with sigma the best chi-square plus a
    /// quantile, or a stated J.
    pub misfit: f64,
    /// Penalties whose `|L theta - target|^2` must not exceed the number beside it.
    pub budgets: Vec<(Penalty, f64)>,
    /// No number is pushed beyond so many times its natural size: free response has no upper end for a
    /// mass.
    pub reach: f64,
    /// Most convex programs for one extreme.
    pub programs: usize,
}

impl MisfitLimit {
    /// A misfit, and nothing else; numbers up to ten times their natural sizes.
    pub fn of(misfit: f64) -> Self {
        Self {
            misfit,
            budgets: Vec::new(),
            reach: 10.0,
            programs: 60,
        }
    }
}

/// How the search for an extreme ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtremeStatus {
    /// No step of the convex programs gains any more.
    Converged,
    /// The stated reach is met: the number has no end before it.
    SearchLimit,
    /// No trial could be brought back to the level.
    NoFeasibleStep,
    /// The programs ran out.
    ProgramLimit,
}

/// An extreme system.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// The number pushed, as in `mass at 3 s`.
    pub function: String,
    /// The time that it speaks of, s.
    pub time: Option<f64>,
    /// Whether it is the largest rather than the smallest.
    pub largest: bool,
    /// Its value.
    pub value: f64,
    /// The system, and the scalars.
    pub parameters: Vec<f64>,
    /// Misfit by a fresh forward solve, at most the level.
    pub misfit: f64,
    /// How the search ended.
    pub ended: ExtremeStatus,
    /// Convex programs solved.
    pub programs: usize,
}

impl Extreme {
    /// Name of the system, as in `largest mass at 3 s`.
    pub fn name(&self) -> String {
        let way = if self.largest { "largest" } else { "smallest" };
        format!("{way} {}", self.function)
    }
}

/// Both ends of one number.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtremePair {
    /// The system with the smallest value.
    pub low: Extreme,
    /// The system with the largest.
    pub high: Extreme,
}

/// The targets of a tube of function `function` at `times` (s), those on the grid.
pub fn values_at(problem: &Problem, function: usize, times: &[f64]) -> Vec<Target> {
    let each = times
        .iter()
        .filter_map(|t| Linear::value(problem, function, *t));
    each.map(Target::Linear).collect()
}

/// The targets of a tube of the ratio of two functions, the second positive.
pub fn ratios_at(problem: &Problem, over: usize, under: usize, times: &[f64]) -> Vec<Target> {
    let each = times.iter().filter_map(|t| {
        let over = Linear::value(problem, over, *t)?;
        Some(Target::Ratio(over, Linear::value(problem, under, *t)?))
    });
    each.collect()
}

/// Both extremes of every target, each from all `starts` that are within the level, on up to
/// `threads` threads; `None` if no start is.
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
    let mut extremes = map(2 * targets.len(), threads, job).into_iter();
    let mut bands = Vec::with_capacity(targets.len());
    while let (Some(low), Some(high)) = (extremes.next(), extremes.next()) {
        bands.push(ExtremePair { low, high });
    }
    Some(bands)
}

/// One extreme from one start; `None` unless the start is within the level and the constraints.
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
