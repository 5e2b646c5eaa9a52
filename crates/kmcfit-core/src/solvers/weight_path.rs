//! Choice of penalty weights: fits along a path of weights.

use super::executor::search;
use super::fit::{Attempt, Fit, measured};
use super::linearization::linearisation_tangents;
use super::observer::Observer;
use super::path::{PathPoint, WeightPath};
use super::settings::FitSettings;
use super::solve_counts::SolveCounts;
use super::start_strategy::search_from_starts;
use super::termination::{Outcome, Status};
use super::timings::Timings;
use super::traces::{SEED, Traces};
use super::weight_rules::{discrepancy, gcv, l_curve, remark};
use crate::problem::Problem;
use crate::step::SimulationError;
use std::time::Duration;

/// Largest weight of the path, relative to the zero-response misfit over a roughness of one.
const LARGEST: f64 = 1e4;
/// Decades of the path, and points per decade.
const DECADES: f64 = 8.0;
const PER_DECADE: f64 = 1.0;

impl Problem {
    /// The problem with the weights of the penalties `which` multiplied by `factor`.
    #[must_use]
    pub fn with_penalty_factor(&self, which: &[usize], factor: f64) -> Self {
        let mut problem = self.clone();
        for &i in which {
            problem.parts_mut().penalties[i].weight *= factor;
        }
        problem
    }
}

/// Fits along the path, and again at the weight of the discrepancy principle.
pub(super) fn choose_by_discrepancy(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    which: &[usize],
    observer: &mut Observer,
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    let mut walk = WeightPathSearch {
        problem,
        settings: settings.clone(),
        which,
        observer,
        from: start.to_vec(),
        last: None,
        attempts: Vec::new(),
        counts: SolveCounts::default(),
        timings: Timings::default(),
        elapsed: Duration::ZERO,
    };
    let weights = weights(problem);
    let points = walk.both_ways(&weights)?;
    let picks = [
        discrepancy(problem, &points),
        l_curve(&points),
        gcv(&points),
    ];
    let [index, ..] = picks;
    let remark = remark(problem, index, &points);
    // Without a choice, the weakest smoothing is closest to the rule.
    let chosen = index.unwrap_or(points.len() - 1);
    let weighted = problem.with_penalty_factor(which, points[chosen].weight);
    let mut found = walk.again(&weighted, &points[chosen].parameters)?;
    found = found.with_work_of(walk.counts, walk.timings, walk.elapsed);
    if let Ok(evaluation) = weighted.evaluate(start) {
        found.initial_cost = evaluation.cost;
    }
    let found = measured(&weighted, found, settings);
    let path = WeightPath {
        points,
        picks,
        chosen,
        seed: SEED,
        remark,
    };
    Ok((path, weighted, found))
}

/// Fits along the path. The first fit uses the start strategy of [`fit`]; every other starts at its neighbour's result: a fit
/// that explains the record is continued as its weight changes, also to weights at which it no longer explains it.
struct WeightPathSearch<'a, 'w> {
    problem: &'a Problem,
    settings: FitSettings,
    which: &'a [usize],
    observer: &'a mut Observer<'w>,
    from: Vec<f64>,
    last: Option<Outcome>,
    attempts: Vec<Attempt>,
    counts: SolveCounts,
    timings: Timings,
    elapsed: Duration,
}

impl WeightPathSearch<'_, '_> {
    /// Fits from the middle of the path to the largest weight, then from the middle to the smallest. The fit at the middle
    /// explains the record, unlike that at the largest weight, and converges fast, unlike that at the smallest.
    fn both_ways(&mut self, weights: &[f64]) -> Result<Vec<PathPoint>, SimulationError> {
        let middle = weights.len() / 2;
        let mut points = vec![self.visit(weights[middle])?];
        for &weight in weights[..middle].iter().rev() {
            if self.ended() {
                return Ok(points);
            }
            points.insert(0, self.visit(weight)?);
        }
        self.from.clone_from(&points[middle].parameters);
        for &weight in &weights[middle + 1..] {
            if self.ended() {
                return Ok(points);
            }
            points.push(self.visit(weight)?);
        }
        Ok(points)
    }

    fn visit(&mut self, weight: f64) -> Result<PathPoint, SimulationError> {
        let problem = self.problem.with_penalty_factor(self.which, weight);
        let from = std::mem::take(&mut self.from);
        let found = match self.last {
            None => search_from_starts(&problem, &from, &self.settings, self.observer)?,
            Some(_) => search(&problem, &from, &self.settings, None, self.observer)?,
        };
        if self.last.is_none() {
            self.attempts.clone_from(&found.attempts);
        }
        self.last = Some(found.outcome.clone());
        self.counts += found.counts;
        self.timings += found.timings;
        self.elapsed += found.elapsed;
        self.from.clone_from(&found.best.parameters);
        let misfit = found.best.evaluation.misfit;
        let n = problem.sample_count() as f64;
        self.counts.tangent += linearisation_tangents(&problem);
        let timings = &mut self.timings;
        let traces = Traces::at(&problem, &found, timings);
        let degrees_of_freedom = traces.of_samples(timings).unwrap_or(f64::NAN);
        Ok(PathPoint {
            weight,
            iterations: iterations(&found),
            misfit,
            roughness: roughness(&problem, self.which, &self.from),
            degrees_of_freedom,
            gcv: n * misfit / (n - degrees_of_freedom).powi(2),
            bic: None,
            parameters: self.from.clone(),
        })
    }

    /// Repeats the fit at a point of the path, with the attempts of the first fit.
    fn again(&mut self, problem: &Problem, from: &[f64]) -> Result<Fit, SimulationError> {
        let mut found = search(problem, from, &self.settings, None, self.observer)?;
        if self.ended()
            && let Some(outcome) = self.last.take()
        {
            // Only a part of the path was computed.
            found.outcome = outcome;
        }
        Ok(Fit {
            attempts: self.attempts.clone(),
            ..found
        })
    }

    fn ended(&self) -> bool {
        let status = self.last.as_ref().map(|outcome| outcome.status);
        matches!(status, Some(Status::Interrupted | Status::TimeLimit))
    }
}

/// Iterations of a fit over all attempts.
fn iterations(found: &Fit) -> u64 {
    let attempts: u64 = found
        .attempts
        .iter()
        .map(|attempt| attempt.history.len() as u64)
        .sum();
    attempts.max(found.history.len() as u64)
}

fn weights(problem: &Problem) -> Vec<f64> {
    let reference = problem.zero_response_misfit();
    let count = (DECADES * PER_DECADE) as i32 + 1;
    let factor = |i: i32| 10f64.powf(-f64::from(i) / PER_DECADE);
    (0..count)
        .map(|i| LARGEST * reference * factor(i))
        .collect()
}

fn roughness(problem: &Problem, which: &[usize], theta: &[f64]) -> f64 {
    let ranges = problem.functions.ranges();
    let penalties = which.iter().map(|&i| &problem.penalties[i]);
    penalties
        .map(|p| p.roughness(&theta[ranges[p.function].clone()]))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;
    use crate::solvers::{IterationRecord, fit, fit_from};
    use crate::system::Grid;

    /// Two fits along the path: the first from the start, the second from the result of the first. Each has the tangents of its
    /// linearisation for the degrees of freedom in addition.
    #[test]
    fn the_work_of_a_path_is_that_of_its_fits_and_traces() {
        crate::host::provide_clock();
        let times = Grid::new(0.0, 10.0, 101).unwrap().times();
        let samples: Vec<f64> = times.iter().map(|t| t.cos()).collect();
        let record = Record::new("free decay")
            .from_state(1.0, 0.0)
            .displacement(&times, &samples)
            .sigma(0.1);
        let parts = [
            CoefficientSpec::fixed(1.0),
            CoefficientSpec::constant(0.1),
            CoefficientSpec::piecewise_linear(5, 1.2).tikhonov(2, 1.0),
        ];
        let problem = Builder::new(parts).record(record).build().unwrap();
        let (settings, start) = (FitSettings::default(), problem.start());
        let weighted = [10.0, 1.0].map(|factor| problem.with_penalty_factor(&[0], factor));
        let first = fit(&weighted[0], &start, &settings, &mut |_| {}).unwrap();
        let second = fit_from(&weighted[1], &first.best.parameters, &settings).unwrap();
        let mut expected = first.counts + second.counts;
        expected.tangent += 2 * problem.parameters() as u64;
        let mut observe = |_: &IterationRecord| {};
        let mut search = WeightPathSearch {
            problem: &problem,
            settings,
            which: &[0],
            observer: &mut Observer::new(&mut observe),
            from: start,
            last: None,
            attempts: Vec::new(),
            counts: SolveCounts::default(),
            timings: Timings::default(),
            elapsed: Duration::ZERO,
        };
        for (factor, fit) in [(10.0, &first), (1.0, &second)] {
            let point = search.visit(factor).unwrap();
            assert_eq!(point.parameters, fit.best.parameters);
            assert_eq!(point.iterations, fit.history.len() as u64);
        }
        assert_eq!(search.counts, expected);
        assert!(!search.elapsed.is_zero());
    }
}
