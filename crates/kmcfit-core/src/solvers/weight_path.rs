//! Choice of penalty weights: fits along a path of weights, and three selection rules.

use super::checkpoint::Observer;
use super::executor::search;
use super::fit::{Attempt, Fit, measured};
use super::linearization::linearisation_tangents;
use super::settings::FitSettings;
use super::solve_counts::SolveCounts;
use super::start_strategy::search_from_starts;
use super::termination::{Outcome, Status};
use super::timings::Timings;
use super::traces::{SEED, Traces};
use crate::functions::WeightRule;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use std::time::Duration;

/// Fit at one weight.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// Factor on the penalties.
    pub weight: f64,
    /// Iterations of the fit, over all attempts.
    pub iterations: u64,
    /// Misfit of the samples; chi-square where they have a sigma.
    pub misfit: f64,
    /// Roughness `sum |L theta - target|^2` of the penalties on the path, without the weight.
    pub roughness: f64,
    /// Effective number of parameters determined by the data.
    pub degrees_of_freedom: f64,
    /// `n misfit / (n - dof)^2`.
    pub gcv: f64,
    /// Fitted parameters.
    pub parameters: Vec<f64>,
}

/// Fits from the largest weight to the smallest, and the choice of each rule.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightPath {
    /// Fits, by falling weight.
    pub points: Vec<PathPoint>,
    /// Index chosen by each rule of [`WeightRule::OF_PATHS`]; `None` where a rule chooses none.
    pub picks: [Option<usize>; 3],
    /// Index of the point whose weight is used.
    pub chosen: usize,
    /// Seed of the random vectors of the degrees of freedom.
    pub seed: u64,
    /// Note on the choice.
    pub remark: Option<String>,
}

impl WeightPath {
    /// Chosen weight.
    pub fn chosen_weight(&self) -> f64 {
        self.points[self.chosen].weight
    }
}

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

/// [`choose_weight`] at the noise of the problem.
pub(super) fn choose_weight_at_noise(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    (rule, which): (WeightRule, &[usize]),
    watch: &mut Observer,
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    let mut walk = WeightPathSearch {
        problem,
        settings: settings.clone(),
        which,
        watch,
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
    let index = WeightRule::OF_PATHS
        .iter()
        .position(|r| *r == rule)
        .and_then(|i| picks[i]);
    let remark = remark(problem, rule, index, &points);
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
    watch: &'a mut Observer<'w>,
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
            None => search_from_starts(&problem, &from, &self.settings, self.watch)?,
            Some(_) => search(&problem, &from, &self.settings, None, self.watch)?,
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
        let compute = || {
            let traces = Traces::at(&problem, &found, timings);
            vec![traces.of_samples(timings).unwrap_or(f64::NAN)]
        };
        let degrees_of_freedom = self.watch.numbers(1, &|| false, compute)[0];
        Ok(PathPoint {
            weight,
            iterations: iterations(&found),
            misfit,
            roughness: roughness(&problem, self.which, &self.from),
            degrees_of_freedom,
            gcv: n * misfit / (n - degrees_of_freedom).powi(2),
            parameters: self.from.clone(),
        })
    }

    /// Repeats the fit at a point of the path, with the attempts of the first fit.
    fn again(&mut self, problem: &Problem, from: &[f64]) -> Result<Fit, SimulationError> {
        let mut found = search(problem, from, &self.settings, None, self.watch)?;
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
        .map(|attempt| attempt.iterations)
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

fn discrepancy(problem: &Problem, points: &[PathPoint]) -> Option<usize> {
    let limit = problem.largest_chi_square()?;
    points.iter().position(|p| p.misfit <= limit)
}

/// Point of largest curvature of (log misfit, log roughness) along the path.
fn l_curve(points: &[PathPoint]) -> Option<usize> {
    let place = |p: &PathPoint| (p.misfit.ln(), p.roughness.ln());
    let curvature = |w: &[PathPoint]| {
        let [(x0, y0), (x1, y1), (x2, y2)] = [place(&w[0]), place(&w[1]), place(&w[2])];
        // Menger curvature, signed by the turn; the corner turns right as the weight falls.
        let cross = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0);
        let side = |ax: f64, ay: f64, bx: f64, by: f64| (ax - bx).hypot(ay - by);
        let sides = side(x0, y0, x1, y1) * side(x1, y1, x2, y2) * side(x0, y0, x2, y2);
        -2.0 * cross / sides
    };
    let turns = points.windows(3).map(curvature).enumerate();
    let finite = turns.filter(|(_, c)| c.is_finite() && *c > 0.0);
    finite
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(i, _)| i + 1)
}

fn gcv(points: &[PathPoint]) -> Option<usize> {
    let scores = points.iter().enumerate().filter(|(_, p)| p.gcv.is_finite());
    scores
        .min_by(|a, b| a.1.gcv.total_cmp(&b.1.gcv))
        .map(|(i, _)| i)
}

fn remark(
    problem: &Problem,
    rule: WeightRule,
    index: Option<usize>,
    points: &[PathPoint],
) -> Option<String> {
    match (rule, index) {
        (WeightRule::Discrepancy, Some(0)) => Some(
                "the largest weight tried fits within the noise and was used: the data are compatible with the smoothest \
                 functions"
                .into(),
        ),
        (WeightRule::Discrepancy, None) => {
            let least = points
                .iter()
                .map(|p| p.misfit)
                .fold(f64::INFINITY, f64::min);
            Some(format!(
                "no weight on the path lowers chi-square to {:.1}; the least is {least:.1}. The sigma may be too \
                 small, or the model cannot explain the samples",
                problem.largest_chi_square().unwrap_or(f64::NAN)
            ))
        }
        (rule, None) => Some(format!(
            "the rule `{}` chooses no weight on this path; the smallest is used",
            rule.name()
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, CoefficientSpec, Record};
    use crate::solvers::{IterationRecord, fit, fit_from};
    use crate::system::Grid;

    /// Points of a path with these natural logarithms of misfit and roughness.
    fn path(places: impl IntoIterator<Item = [f64; 2]>) -> Vec<PathPoint> {
        let point = |[misfit, roughness]: [f64; 2]| PathPoint {
            weight: 1.0,
            iterations: 1,
            misfit: misfit.exp(),
            roughness: roughness.exp(),
            degrees_of_freedom: 1.0,
            gcv: 1.0,
            parameters: Vec::new(),
        };
        places.into_iter().map(point).collect()
    }

    /// As the weight falls, first the misfit falls and then the roughness rises.
    #[test]
    fn the_corner_is_where_roughness_begins_to_rise() {
        for corner in 1..8 {
            let place = |i: usize| {
                let [left, right] = [corner.max(i) - i, corner.max(i) - corner];
                [3.0 + 2.0 * left as f64, 2.0 * right as f64 - 5.0]
            };
            assert_eq!(l_curve(&path((0..9).map(place))), Some(corner));
            // In the opposite order the path turns to the other side and has no corner.
            assert_eq!(l_curve(&path((0..9).rev().map(place))), None);
        }
    }

    /// From falling misfit to rising roughness in two turns, at the third point and at the fifth.
    #[test]
    fn the_sharper_of_two_turns_is_the_corner() {
        for (between, corner) in [(160f64, 4), (110.0, 2)] {
            let headings = [180.0, 180.0, between, between, 90.0, 90.0];
            let mut at = [1.0, -2.0];
            let steps = headings.map(|degrees| {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                at = [at[0] + cosine, at[1] + sine];
                at
            });
            let places = std::iter::once([1.0, -2.0]).chain(steps);
            assert_eq!(l_curve(&path(places)), Some(corner));
        }
    }

    /// Two arcs: one of radius 3 by chords of 40 degrees, then one of radius 1 by chords of 10 degrees. The angles between chords
    /// are larger on the first, the curvature is larger on the second.
    #[test]
    fn the_corner_has_the_largest_curvature_for_any_density_of_points() {
        let chord = |radius: f64, degrees: f64| 2.0 * radius * (0.5 * degrees).to_radians().sin();
        let wide = [160.0, 120.0].map(|heading| (heading, chord(3.0, 40.0)));
        let narrow = [95.0, 85.0, 75.0, 65.0].map(|heading| (heading, chord(1.0, 10.0)));
        let mut at = [0.0, 0.0];
        let steps = wide.into_iter().chain(narrow).map(|(heading, length)| {
            let (sine, cosine) = f64::to_radians(heading).sin_cos();
            at = [at[0] + length * cosine, at[1] + length * sine];
            at
        });
        let places: Vec<_> = std::iter::once([0.0, 0.0]).chain(steps).collect();
        let corner = l_curve(&path(places)).expect("a corner");
        assert!((3..=5).contains(&corner), "{corner}");
    }

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
            watch: &mut Observer::new(&mut observe),
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
