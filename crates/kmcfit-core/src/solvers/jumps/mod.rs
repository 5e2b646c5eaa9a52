//! Jumps of a function: a total-variation penalty with the weight by the Bayesian information criterion, then a fit without
//! the penalty in which the function is constant between the jumps found.
//!
//! Along a path of weights `w` the penalised fits minimise `misfit + w sum_i |theta_(i+1) - theta_i|`. The weight is that of the
//! smallest
//!
//! ```text
//! BIC(w) = -2 log L + p ln n
//! ```
//!
//! with the likelihood `L` of the `n` samples and the degrees of freedom `p`: the number of levels of the function, those of
//! neighbouring values that differ by more than [`MERGED`] of the largest value, and of other parameters. The number of levels is the
//! unbiased estimate of the degrees of freedom of a total-variation fit, because the shrinkage of the levels offsets the search for the
//! times of the jumps (Tibshirani & Taylor 2012, *Degrees of freedom in lasso problems*, Annals of Statistics 40, 1198-1232).
//!
//! The fit without the penalty has no shrinkage, so there the time of each jump counts as a parameter too (Yao 1988, *Estimating the
//! number of change-points via Schwarz' criterion*, Statistics & Probability Letters 6, 181-189): jumps are removed, joined and
//! moved, the change with the smallest criterion first, while
//!
//! ```text
//! BIC = -2 log L + (p + jumps) ln n
//! ```
//!
//! falls. Two jumps are joined at the time that preserves the integral of the function: the penalty spreads a jump over neighbouring nodes.

mod levels;

use super::executor::search;
use super::fit::{Attempt, Fit};
use super::noise_estimation::{fit_with_noise_watched, with_sigmas};
use super::observer::Observer;
use super::path::{PathPoint, WeightPath};
use super::rounds::is_ended;
use super::settings::{FitSettings, Initial};
use super::solve_counts::SolveCounts;
use super::start_strategy::search_from_starts;
use super::termination::Outcome;
use super::timings::Timings;
use crate::problem::Problem;
use crate::record::Weighting;
use crate::step::SimulationError;
use levels::{LevelModel, Levels};
use std::time::Duration;

/// Difference of neighbouring values below which they are one level, relative to the largest value of the function.
const MERGED: f64 = 1e-4;
/// Weight of the first fit, and the largest and smallest of the path, relative to the zero-response misfit over the size of the
/// function.
const MIDDLE: f64 = 0.1;
const LARGEST: f64 = 1e3;
const SMALLEST: f64 = 1e-5;
/// Points of the path per decade.
const PER_DECADE: i32 = 4;
/// The path ends at a fit with more levels than this, and this many times those of the best.
const SEVERAL_LEVELS: usize = 10;
const TIMES_BEST: usize = 3;
/// Largest number of rounds in which all jumps are moved.
const ROUNDS: usize = 5;
/// Numbers of nodes or intervals by which a jump is moved, large ones first: the likelihood is not unimodal in the time of a jump.
const MOVES: [isize; 10] = [-16, 16, -8, 8, -4, 4, -2, 2, -1, 1];

/// Fits along the path of weights of the total-variation penalty `which`, and without it on the jumps found. Returns the path, the
/// problem with its jumps, and its fit.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the start of the first fit fails.
pub(super) fn choose_jumps(
    problem: &Problem,
    start: &[f64],
    settings: &FitSettings,
    which: usize,
    observer: &mut Observer,
) -> Result<(WeightPath, Problem, Fit), SimulationError> {
    let function = problem.variations[which].function;
    let mut walk = JumpSearch {
        problem: problem.clone(),
        settings,
        which,
        function,
        observer,
        attempts: Vec::new(),
        ended: None,
        counts: SolveCounts::default(),
        timings: Timings::default(),
        elapsed: Duration::ZERO,
    };
    let points = walk.path(start)?;
    let chosen = best(&points);
    let levels = walk.levels(&points[chosen].parameters);
    let candidate = walk.refitted(levels, &points[chosen].parameters)?;
    let candidate = walk.improved(candidate);
    let (reduced, found) = walk.finished(candidate, start)?;
    let path = WeightPath {
        points,
        picks: [None; 3],
        chosen,
        seed: super::traces::SEED,
        remark: remark(&reduced),
    };
    Ok((path, reduced, found))
}

/// Index of the smallest criterion, the largest weight of equal ones.
fn best(points: &[PathPoint]) -> usize {
    let scores = points.iter().map(|p| p.bic.unwrap_or(f64::INFINITY));
    let least = scores.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    least.map_or(0, |(i, _)| i)
}

fn remark(reduced: &Problem) -> Option<String> {
    let is_correlated = reduced.channels().any(|c| c.correlation().is_some());
    is_correlated.then(|| {
        "the jumps were chosen as for uncorrelated noise, and the residuals are autocorrelated"
            .into()
    })
}

/// A fit on given levels, with its criterion.
struct Candidate {
    levels: Levels,
    /// Parameters of the problem on the levels.
    parameters: Vec<f64>,
    score: f64,
}

struct JumpSearch<'a, 'w> {
    /// Problem with the sigmas of the last fit.
    problem: Problem,
    settings: &'a FitSettings,
    /// Index of the penalty.
    which: usize,
    function: usize,
    observer: &'a mut Observer<'w>,
    attempts: Vec<Attempt>,
    /// Outcome of a fit that was ended from outside.
    ended: Option<Outcome>,
    counts: SolveCounts,
    timings: Timings,
    elapsed: Duration,
}

impl JumpSearch<'_, '_> {
    /// Fits from the middle weight to a single level, then from the middle to the smallest weight, by falling weight.
    fn path(&mut self, start: &[f64]) -> Result<Vec<PathPoint>, SimulationError> {
        let first = self.visit(MIDDLE, start)?;
        // The sigmas are estimated by now, so the path has the scale of the samples.
        let mut points = vec![self.visit(MIDDLE, &first.parameters)?];
        let factor = |k: i32| MIDDLE * 10f64.powf(f64::from(k) / f64::from(PER_DECADE));
        for weight in (1..).map(factor).take_while(|w| *w <= LARGEST) {
            if self.ended.is_some() || self.levels(&points[0].parameters).count() == 1 {
                break;
            }
            let from = points[0].parameters.clone();
            points.insert(0, self.visit(weight, &from)?);
        }
        for weight in (1..).map(|k| factor(-k)).take_while(|w| *w >= SMALLEST) {
            let last = points.last().map_or(&[][..], |p| &p.parameters).to_vec();
            let fewest = self.levels(&points[best(&points)].parameters).count();
            if self.ended.is_some()
                || self.levels(&last).count() > SEVERAL_LEVELS.max(TIMES_BEST * fewest)
            {
                break;
            }
            points.push(self.visit(weight, &last)?);
        }
        Ok(points)
    }

    /// Fit with a weight relative to the zero-response misfit over the size of the function.
    fn visit(&mut self, relative: f64, from: &[f64]) -> Result<PathPoint, SimulationError> {
        let start = self.problem.functions.values(&self.problem.start());
        let size = start[self.function]
            .iter()
            .fold(0.0f64, |m, p| m.max(p.abs()));
        let weight = relative * self.problem.zero_response_misfit() / size.max(f64::MIN_POSITIVE);
        let mut weighted = self.problem.clone();
        weighted.parts_mut().variations[self.which].weight = weight;
        let is_first = self.attempts.is_empty();
        let found = self.fitted(&mut weighted, from, is_first)?;
        let theta = found.best.parameters.clone();
        let misfit = found.best.evaluation.misfit;
        let others = weighted.parameters() - weighted.functions.ranges()[self.function].len();
        let parameters = (others + self.levels(&theta).count()) as f64;
        let samples = weighted.sample_count() as f64;
        let range = weighted.functions.ranges()[self.function].clone();
        let point = PathPoint {
            weight,
            iterations: found.history.len() as u64,
            misfit,
            roughness: weighted.variations[self.which].total(&theta[range]),
            degrees_of_freedom: parameters,
            gcv: samples * misfit / (samples - parameters).powi(2),
            bic: Some(minus_twice_log_likelihood(&weighted, misfit) + parameters * samples.ln()),
            parameters: theta,
        };
        self.problem = weighted;
        Ok(point)
    }

    /// Fit with the estimation of sigmas; the work is counted.
    fn fitted(
        &mut self,
        problem: &mut Problem,
        from: &[f64],
        is_first: bool,
    ) -> Result<Fit, SimulationError> {
        let found = match is_first {
            true => search_from_starts(problem, from, self.settings, self.observer)?,
            false => search(problem, from, self.settings, None, self.observer)?,
        };
        let found = with_sigmas(problem, found, self.settings, self.observer)?;
        if is_first {
            self.attempts.clone_from(&found.attempts);
        }
        if is_ended(&found) {
            self.ended = Some(found.outcome.clone());
        }
        self.counts += found.counts;
        self.timings += found.timings;
        self.elapsed += found.elapsed;
        Ok(found)
    }

    /// Levels of the function at the parameters `theta` of the whole problem.
    fn levels(&self, theta: &[f64]) -> Levels {
        let values = &theta[self.problem.functions.ranges()[self.function].clone()];
        let largest = values.iter().fold(0.0f64, |m, p| m.max(p.abs()));
        Levels::of(values, MERGED * largest)
    }

    /// Fit without the penalty on these levels, from the parameters `theta` of the whole problem.
    fn refitted(&mut self, levels: Levels, theta: &[f64]) -> Result<Candidate, SimulationError> {
        let whole = self.problem.clone();
        let model = LevelModel::new(&whole, self.function);
        let mut reduced = model.problem(&levels);
        let from = model.restricted(&levels, theta);
        let found = self.fitted(&mut reduced, &from, false)?;
        let counted = (reduced.parameters() + levels.jumps()) as f64;
        let likelihood = minus_twice_log_likelihood(&reduced, found.best.evaluation.misfit);
        Ok(Candidate {
            score: likelihood + counted * (reduced.sample_count() as f64).ln(),
            parameters: found.best.parameters,
            levels,
        })
    }

    /// [`JumpSearch::refitted`] from the parameters of other levels; `None` without a response from there.
    fn tried(&mut self, levels: Levels, from: &Candidate) -> Option<Candidate> {
        let whole = self.problem.clone();
        let theta = LevelModel::new(&whole, self.function).embedded(&from.levels, &from.parameters);
        self.refitted(levels, &theta).ok()
    }

    /// Removes or joins jumps, the change with the smallest criterion first, while the criterion falls, if need be after the others are
    /// moved; then moves those that remain.
    fn improved(&mut self, mut here: Candidate) -> Candidate {
        while here.levels.jumps() > 0 && self.ended.is_none() {
            let fewer = self.fewer_levels(&here);
            let fewer = fewer
                .into_iter()
                .filter_map(|levels| self.tried(levels, &here));
            let Some(next) = fewer.min_by(|a, b| a.score.total_cmp(&b.score)) else {
                break;
            };
            let next = match next.score < here.score {
                true => next,
                false => self.moved(next),
            };
            if next.score >= here.score {
                break;
            }
            here = next;
        }
        self.moved(here)
    }

    /// Moves jumps while the criterion falls.
    fn moved(&mut self, mut here: Candidate) -> Candidate {
        for _ in 0..ROUNDS {
            let before = here.levels.clone();
            for k in 0..here.levels.jumps() {
                for by in MOVES {
                    here = self.with_jump_moved(here, k, by);
                }
            }
            if here.levels == before || self.ended.is_some() {
                break;
            }
        }
        here
    }

    /// All levels with one jump less.
    fn fewer_levels(&self, here: &Candidate) -> Vec<Levels> {
        let first = self.problem.functions.ranges()[self.function].start;
        let values = &here.parameters[first..first + here.levels.count()];
        let jumps = here.levels.jumps();
        let without = (0..jumps).map(|k| here.levels.without(k));
        let joined = (1..jumps).map(|k| here.levels.joined(k - 1, values));
        without.chain(joined).collect()
    }

    fn with_jump_moved(&mut self, mut here: Candidate, k: usize, by: isize) -> Candidate {
        while let Some(moved) = here.levels.moved(k, by).filter(|_| self.ended.is_none()) {
            match self
                .tried(moved, &here)
                .filter(|next| next.score < here.score)
            {
                Some(next) => here = next,
                None => break,
            }
        }
        here
    }

    /// Problem and fit on the levels of a candidate, with the estimation of the noise, and the work of all fits.
    fn finished(
        &mut self,
        candidate: Candidate,
        start: &[f64],
    ) -> Result<(Problem, Fit), SimulationError> {
        let whole = self.problem.clone();
        let model = LevelModel::new(&whole, self.function);
        let reduced = model.problem(&candidate.levels);
        let settings = FitSettings {
            initial: Initial::Functions,
            ..self.settings.clone()
        };
        let (reduced, found) =
            fit_with_noise_watched(&reduced, &candidate.parameters, &settings, self.observer)?;
        let mut found = found.with_work_of(self.counts, self.timings, self.elapsed);
        found.attempts.clone_from(&self.attempts);
        if let Some(outcome) = self.ended.take() {
            found.outcome = outcome;
        }
        if let Ok(evaluation) = reduced.evaluate(&model.restricted(&candidate.levels, start)) {
            found.initial_cost = evaluation.cost;
        }
        Ok((reduced, found))
    }
}

/// Minus twice the logarithm of the likelihood, up to a constant, at a misfit: chi-square, and for each channel with an estimated
/// sigma `n log sigma^2`.
fn minus_twice_log_likelihood(problem: &Problem, misfit: f64) -> f64 {
    let spread = problem.channels().map(|c| match c.weighting() {
        Weighting::Estimated { sigma } => 2.0 * c.len() as f64 * sigma.ln(),
        _ => 0.0,
    });
    misfit + spread.sum::<f64>()
}
