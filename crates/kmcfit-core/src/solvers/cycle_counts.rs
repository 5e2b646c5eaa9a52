//! Number of cycles of the oscillation in gaps of the records.
//!
//! Samples on both sides of a gap determine the phase across it up to whole cycles. A stiffness or mass that varies can add or
//! remove cycles within the gap, so that fits with different numbers
//!
//! ```text
//! n = integral over the gap of sqrt(k/m) / (2 pi) dt
//! ```
//!
//! are separate minima of the misfit of about the same depth. They are compared by the restricted likelihood of a function with a
//! penalty on its curvature, whose weight maximises that likelihood: an additional cycle needs a deviation of the function within the
//! gap, which the rest of the record makes improbable. The search begins at the function interpolated across the gap and
//! moves by whole cycles as long as the likelihood increases.

use super::fit::Fit;
use super::gaps::{CycleCount, Gap, cycles, frequencies, gaps, integral, varying_function};
use super::reml::{is_estimated, restricted_deviance};
use super::rounds::{is_ended, with_round};
use super::start_projection::StartProjection;
use super::termination::Outcome;
use crate::functions::{Penalty, WeightRule};
use crate::problem::{FEW_PARAMETERS, Problem};
use std::f64::consts::PI;

/// Largest number of cycles by which the search moves from the interpolated function, each way.
const MOST_MOVES: usize = 4;
/// Difference of two numbers of cycles below which fits are the same minimum.
const SAME: f64 = 0.5;
/// Bisections of the size of a deviation; their result is the starting point of a fit.
const BISECTIONS: usize = 40;
/// Order of the derivative penalised in the comparison.
const ORDER: usize = 2;

/// Fits a problem from these parameters and estimates its sigmas and weights; `None` without a response.
pub(super) type Refit<'a> = dyn FnMut(&mut Problem, &[f64]) -> Option<Fit> + 'a;

/// The fit `found` after the comparison of the numbers of cycles in each gap of the records; it is repeated where another number than
/// its own is most probable. A fit without gaps, and one of records without sigma, is returned unchanged.
pub(super) fn with_cycle_counts(problem: &mut Problem, mut found: Fit, refit: &mut Refit) -> Fit {
    let has_likelihood = problem.channels().all(|c| c.weighting().is_sigma());
    let is_few = problem.parameters() <= FEW_PARAMETERS;
    if !has_likelihood || !is_few || is_ended(&found) {
        return found;
    }
    let own = found.best.evaluation.nodal.clone();
    let mut start = found.best.parameters.clone();
    for span in gaps(problem, &own) {
        let Some(mut search) = Search::new(problem, span) else {
            continue;
        };
        search.run(&start, refit);
        for candidate in &search.candidates {
            let work = &candidate.fit;
            found = found.with_work_of(work.counts, work.timings, work.elapsed);
        }
        if let Some(outcome) = search.ended {
            found.outcome = outcome;
            return found;
        }
        if let Some(best) = search.best() {
            start.clone_from(&best.fit.best.parameters);
            found.gaps.push(search.gap());
        }
    }
    let is_other = |gap: &Gap| {
        let count = cycles(problem, &own, gap.span);
        let best = gap.counts.first();
        best.is_some_and(|best| (best.cycles - count).abs() > SAME)
    };
    if !found.gaps.iter().any(is_other) {
        return found;
    }
    match refit(problem, &start) {
        None => found,
        Some(next) => Fit {
            initial_cost: found.initial_cost,
            initial_norm_squared: found.initial_norm_squared,
            ..with_round(found, next, false)
        },
    }
}

/// A fit with the number of cycles in the gap.
struct Candidate {
    problem: Problem,
    fit: Fit,
    count: CycleCount,
}

/// Search for the number of cycles in one gap.
struct Search {
    /// The problem with a penalty on the curvature of the function that varies, with a weight of the largest likelihood.
    problem: Problem,
    span: [f64; 2],
    /// Index of the function that varies.
    function: usize,
    candidates: Vec<Candidate>,
    /// Outcome of a fit that was ended from outside.
    ended: Option<Outcome>,
}

impl Search {
    /// `None` where no function varies, or its basis has no curvature.
    fn new(problem: &Problem, span: [f64; 2]) -> Option<Self> {
        let function = varying_function(problem)?;
        Some(Self {
            problem: smoothed(problem, function)?,
            span,
            function,
            candidates: Vec::new(),
            ended: None,
        })
    }

    /// Fits from `start`, from the function interpolated across the gap, then with one more and one less cycle than the best so far.
    fn run(&mut self, start: &[f64], refit: &mut Refit) {
        self.try_start(start, refit);
        let interpolated = self.best().and_then(|best| self.interpolated(best));
        if let Some(start) = interpolated {
            self.try_start(&start, refit);
        }
        for direction in [1.0, -1.0] {
            for _ in 0..MOST_MOVES {
                let Some(best) = self.best() else {
                    return;
                };
                let before = best.count;
                let Some(start) = self.with_cycles(best, before.cycles + direction) else {
                    break;
                };
                self.try_start(&start, refit);
                let after = self.best().map_or(before, |best| best.count);
                let has_moved = direction * (after.cycles - before.cycles) > SAME;
                if self.ended.is_some() || !has_moved {
                    break;
                }
            }
        }
    }

    fn try_start(&mut self, start: &[f64], refit: &mut Refit) {
        if self.ended.is_some() {
            return;
        }
        let mut problem = self.problem.clone();
        let Some(fit) = refit(&mut problem, start) else {
            return;
        };
        if is_ended(&fit) {
            self.ended = Some(fit.outcome.clone());
        }
        let best = &fit.best;
        let count = CycleCount {
            cycles: cycles(&problem, &best.evaluation.nodal, self.span),
            deviance: restricted_deviance(&problem, &best.parameters, &best.evaluation)
                .unwrap_or(f64::INFINITY),
        };
        self.candidates.push(Candidate {
            problem,
            fit,
            count,
        });
    }

    fn best(&self) -> Option<&Candidate> {
        let known = self
            .candidates
            .iter()
            .filter(|c| c.count.deviance.is_finite());
        known.min_by(|a, b| a.count.deviance.total_cmp(&b.count.deviance))
    }

    /// The gap, with the most probable fit of each number of cycles.
    fn gap(&self) -> Gap {
        let least = self.best().map_or(f64::NAN, |best| best.count.deviance);
        let mut all: Vec<CycleCount> = self.candidates.iter().map(|c| c.count).collect();
        all.sort_by(|a, b| a.deviance.total_cmp(&b.deviance));
        let mut counts: Vec<CycleCount> = Vec::new();
        for count in all {
            if counts
                .iter()
                .all(|c| (c.cycles - count.cycles).abs() > SAME)
            {
                counts.push(CycleCount {
                    deviance: count.deviance - least,
                    ..count
                });
            }
        }
        Gap {
            span: self.span,
            counts,
        }
    }

    /// Parameters of a fit with the function linear across the gap.
    fn interpolated(&self, of: &Candidate) -> Option<Vec<f64>> {
        let [from, to] = self.span;
        let Candidate { problem, fit, .. } = of;
        let grid = &problem.system.grid;
        let values = &problem.functions.values(&fit.best.parameters)[self.function];
        let ends = self.span.map(|time| values[grid.nearest(time)]);
        self.projected(of, |i| {
            let share = (grid.time(i) - from) / (to - from);
            match (0.0..=1.0).contains(&share) {
                true => ends[0] + share * (ends[1] - ends[0]),
                false => values[i],
            }
        })
    }

    /// Parameters of a fit with a deviation of the function within the gap that makes the number of cycles `target`.
    fn with_cycles(&self, of: &Candidate, target: f64) -> Option<Vec<f64>> {
        let [from, to] = self.span;
        let Candidate { problem, fit, .. } = of;
        let grid = &problem.system.grid;
        let shape = |i: usize| {
            let share = ((grid.time(i) - from) / (to - from)).clamp(0.0, 1.0);
            (PI * share).sin().powi(2)
        };
        let frequencies = frequencies(problem, &fit.best.evaluation.nodal);
        // Stiffness, or mass inverted, times 1 + size * shape.
        let cycles_at = |size: f64| {
            let each = frequencies.iter().enumerate();
            let values: Vec<f64> = each
                .map(|(i, f)| f * (1.0 + size * shape(i)).max(0.0).sqrt())
                .collect();
            integral(problem, &values, self.span)
        };
        let (mut low, mut high) = (-0.99, 1.0);
        while cycles_at(high) < target {
            high *= 2.0;
            (high < 1e3).then_some(())?;
        }
        (cycles_at(low) < target).then_some(())?;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match cycles_at(middle) < target {
                true => low = middle,
                false => high = middle,
            }
        }
        let values = &problem.functions.values(&fit.best.parameters)[self.function];
        let is_mass = problem.functions.coefficient_set(0)[0] == self.function;
        self.projected(of, |i| {
            let factor = 1.0 + high * shape(i);
            match is_mass {
                true => values[i] / factor,
                false => values[i] * factor,
            }
        })
    }

    /// Parameters of a fit with these nodal values of the function, projected onto its basis and the constraints.
    fn projected(&self, of: &Candidate, value: impl Fn(usize) -> f64) -> Option<Vec<f64>> {
        let Candidate { problem, fit, .. } = of;
        let function = problem.functions.get(self.function);
        let grid = &problem.system.grid;
        let free = (0..grid.nodes()).map(|i| value(i) - function.fixed_at(i));
        let free: Vec<f64> = free.collect();
        let own = function.basis.as_ref()?.project(grid, &free)?;
        let mut parameters = fit.best.parameters.clone();
        let range = problem.functions.ranges()[self.function].clone();
        parameters[range].copy_from_slice(&own);
        match problem.feasible_start(&parameters) {
            StartProjection::Kept(parameters) | StartProjection::Moved { parameters, .. } => {
                Some(parameters)
            }
            _ => None,
        }
    }
}

/// The problem with a penalty on the curvature of a function, of a weight by restricted likelihood; `None` where its basis has no
/// curvature.
fn smoothed(problem: &Problem, function: usize) -> Option<Problem> {
    let mut smooth = problem.clone();
    let has_weight = |p: &Penalty| p.function == function && is_estimated(p);
    if !problem.penalties.iter().any(has_weight) {
        let basis = problem.functions.get(function).basis.as_ref()?;
        let rows = basis.roughness(&problem.system.grid, ORDER);
        (!rows.is_empty()).then_some(())?;
        let parts = smooth.parts_mut();
        parts.penalties.retain(|p| p.function != function);
        parts.variations.retain(|v| v.function != function);
        parts.penalties.push(Penalty {
            rule: Some(WeightRule::RestrictedLikelihood),
            ..Penalty::new(function, ORDER, 1.0, rows)
        });
    }
    Some(smooth)
}
