//! Force terms that the residuals of a simulated response show and the model does not have, and errors of the records: score tests, one for
//! each candidate.
//!
//! The equation of motion is extended by a constant coefficient `p` of each term that the model lacks, at `p = 0`, where the response is
//! that of the fit. With the derivatives `J` of the weighted and whitened residuals `r` in the parameters of the model and `d` in `p`, and the
//! parts `z` of `d` and `e` of `r` that are orthogonal to `J`,
//!
//! ```text
//! p = -z^T e / z^T z,    t = p sqrt(z^T z) / s,    s^2 = (e^T e - p^2 z^T z) / (n - q - 1)
//! ```
//!
//! is the estimate after one step of Gauss and Newton from the fit (Rao 1948). A term with a large `t` is missing if a refit with it leaves white
//! residuals, or the smallest of all refits and at most half of those before; so are a delay, a difference of clocks and a gain, with their [own derivatives](super::record_parameters). Where the noise model does not describe the residuals the standard error is that of the [kernel covariance](KernelCovariance) of the scores `z_i e_i`.

use super::Doubt;
use super::extension::extended;
use super::interpolation_loss::evaluation_with_cubics;
use super::larger_models::{Extension, ExtensionTest};
use super::record_errors::small_error;
use super::record_parameters::{self, RecordColumns, RecordParameter};
use super::refinement::applies;
use super::refit::{
    EXPLAINED, Refit, is_white, uncorrelated, without_correlation, worst_fit, worst_misfit,
};
use super::span::{Span, weighted_residuals};
use crate::functions::{CoefficientFunction, CoefficientKind};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::simd::sum::rms;
use crate::solvers::{MissingTerm, TESTED_TERMS, weighted_jacobian};
use crate::step::Trajectory;
use crate::structure::Law;
use crate::threads::{analyses_at_once, map};
use nalgebra::{DMatrix, DVector};

/// Width of the sign of the velocity in the candidate for Coulomb friction, relative to the root mean square of the velocity.
const WIDTH: f64 = 0.01;
/// Smallest `|t|` of a missing term: of 4000 standard normal numbers one has a larger value by chance.
pub(super) const SIGNIFICANT: f64 = 4.5;
/// Fit of a channel, per cent, below which a fit is not near the system, and a linearisation in further terms says nothing.
const UNRELATED: f64 = 50.0;
/// Number of the most significant candidates that are refitted.
const REFITTED: usize = 3;
/// Fewest samples per parameter.
const SAMPLES_PER_PARAMETER: usize = 4;

/// A candidate for what the model lacks.
enum Candidate {
    Term(CoefficientKind, Law),
    Record(RecordParameter),
}

impl Candidate {
    fn extension(&self, problem: &Problem) -> Extension {
        let experiment = |e: usize| problem.experiments[e].name.clone();
        match *self {
            Self::Term(term, _) => Extension::Term { term },
            Self::Record(RecordParameter::Delay(e)) => Extension::Delay {
                experiment: experiment(e),
            },
            Self::Record(RecordParameter::Rate(e)) => Extension::ClockRate {
                experiment: experiment(e),
            },
            Self::Record(
                RecordParameter::Gain(e, c)
                | RecordParameter::Offset(e, c)
                | RecordParameter::Drift(e, c),
            ) => Extension::Gain {
                experiment: experiment(e),
                channel: problem.experiments[e].channels[c].kind().name().to_owned(),
            },
        }
    }
}

/// Linearisation at an optimum in the parameters of the model and those of all candidates.
pub(super) struct ScoreTests<'a> {
    problem: &'a Problem,
    evaluation: &'a Evaluation,
    kinds: Vec<(CoefficientKind, Law)>,
    records: Vec<RecordParameter>,
    model: Span,
    /// Derivatives in the coefficients of the terms.
    terms: DMatrix<f64>,
    of_records: RecordColumns,
    /// Part of the residuals orthogonal to the derivatives of the model.
    rest: DVector<f64>,
}

impl<'a> ScoreTests<'a> {
    /// `None` where the tests do not apply: without a likelihood, at an active constraint, for residuals at machine precision or as large as
    /// the response, and with few samples or many parameters.
    pub(super) fn at(
        problem: &'a Problem,
        theta: &[f64],
        evaluation: &'a Evaluation,
    ) -> Option<Self> {
        let is_few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let is_long = problem.sample_count() >= SAMPLES_PER_PARAMETER * problem.parameters();
        (is_few && is_long && applies(problem, theta, evaluation)).then_some(())?;
        (worst_fit(problem, evaluation) > UNRELATED).then_some(())?;
        let kinds = candidates(problem, evaluation);
        let (extended, _) = extended(problem, theta, constants(problem, &kinds))?;
        // The coefficients of the terms that the evaluation lacks are zero.
        let jacobian = weighted_jacobian(&extended, evaluation);
        let first = problem.functions.scalar_range().start;
        let terms = jacobian.columns(first, kinds.len()).into_owned();
        let model = Span::of(jacobian.remove_columns(first, kinds.len()));
        let rest = model.orthogonal(weighted_residuals(problem, evaluation));
        let records = record_parameters::record_parameters(problem);
        let of_records = RecordColumns::of(problem, evaluation, &records);
        Some(Self {
            problem,
            evaluation,
            kinds,
            records,
            model,
            terms,
            of_records,
            rest,
        })
    }

    /// The tests, each with its estimate and `t`, in the order of the candidates. `is_modelled` is true for residuals that the noise model
    /// describes. Lines between the samples of an input take a share of it that looks like a term: a candidate that is less significant with
    /// cubic splines in their place is tested with these.
    fn results(&self, theta: &[f64], is_modelled: bool) -> Vec<(Candidate, f64, f64)> {
        let mut tests = self.tested(&self.rest, is_modelled);
        let size = |test: &Option<(f64, f64)>| test.map_or(0.0, |(_, t)| t.abs());
        if tests.iter().any(|test| size(test) >= SIGNIFICANT)
            && let Some(cubic) = evaluation_with_cubics(self.problem, theta)
        {
            let rest = weighted_residuals(self.problem, &cubic);
            let rest = self.model.orthogonal(rest);
            let pairs = tests.iter_mut().zip(self.tested(&rest, is_modelled));
            let smaller = pairs.filter(|(test, cubic)| size(cubic) < size(test));
            smaller.for_each(|(test, cubic)| *test = cubic);
        }
        let terms = self.kinds.iter();
        let terms = terms.map(|(kind, term)| Candidate::Term(*kind, *term));
        let records = self.records.iter().copied().map(Candidate::Record);
        let tests = terms.chain(records).zip(tests);
        let tests = tests.filter_map(|(candidate, test)| {
            let (value, t) = test?;
            Some((candidate, value, t))
        });
        tests.collect()
    }

    /// Estimate and `t` of each candidate, given the part of the residuals orthogonal to the derivatives of the model.
    fn tested(&self, rest: &DVector<f64>, is_modelled: bool) -> Vec<Option<(f64, f64)>> {
        let column = |i: usize| match i.checked_sub(self.kinds.len()) {
            None => Some(self.terms.column(i).into_owned()),
            Some(i) => {
                let (problem, evaluation) = (self.problem, self.evaluation);
                let column = (self.of_records).column(problem, evaluation, self.records[i])?;
                Some(DVector::from_vec(column))
            }
        };
        let test = |i: usize| self.model.test(self.problem, column(i)?, rest, is_modelled);
        let count = self.kinds.len() + self.records.len();
        map(count, analyses_at_once(self.problem.sample_count()), test)
    }
}

/// The most significant missing term or error of a record at the optimum `theta`, `None` where the residuals show none, and the results of
/// all score tests.
pub(super) fn missing(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    tests: Option<&ScoreTests<'_>>,
    is_modelled: bool,
) -> (Option<Doubt>, Vec<ExtensionTest>) {
    let tests = tests.map_or_else(Vec::new, |tests| tests.results(theta, is_modelled));
    let results = tests.iter().map(|(candidate, value, t)| ExtensionTest {
        extension: candidate.extension(problem),
        value: *value,
        t: *t,
    });
    let results = results.collect();
    (most_significant(problem, theta, evaluation, tests), results)
}

/// The candidate whose refit explains the residuals.
fn most_significant(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    mut tests: Vec<(Candidate, f64, f64)>,
) -> Option<Doubt> {
    tests.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    // Far from the optimum of the right candidate another one may be more significant: friction resembles a negative quadratic damping.
    let mut best: Option<(f64, MissingTerm)> = None;
    (tests.first()?.2.abs() >= SIGNIFICANT).then_some(())?;
    // White residuals of a refit say nothing where those of the fit are white.
    let is_explained = is_white(&uncorrelated(problem), evaluation);
    tests.retain(|(.., t)| !is_explained || t.abs() >= SIGNIFICANT);
    for (candidate, value, t) in tests.into_iter().take(REFITTED) {
        match candidate {
            Candidate::Term(kind, term) => {
                let size = (value * force(evaluation, term)).abs();
                let missing = MissingTerm {
                    term: kind,
                    value,
                    t,
                    share: size / largest_force(problem, evaluation),
                    width: term.width(),
                };
                let Some(refit) = refit(problem, theta, &missing) else {
                    continue;
                };
                if refit.is_white() {
                    return Some(Doubt::MissingTerm(missing));
                }
                let misfit = refit.worst_misfit();
                if best.is_none_or(|(least, _)| misfit < least) {
                    best = Some((misfit, missing));
                }
            }
            Candidate::Record(parameter) => {
                let error = small_error(problem, theta, parameter, value);
                if let Some(error) = error {
                    return Some(Doubt::RecordError(error));
                }
            }
        }
    }
    let before = worst_misfit(problem, evaluation);
    let (_, missing) = best.filter(|(misfit, _)| *misfit < EXPLAINED * before)?;
    Some(Doubt::MissingTerm(missing))
}

/// Refit with a term, from the optimum or else from the start, whichever ends lower. The term is missing if it leaves white residuals: an error
/// of the input, a coefficient that varies and another missing term give a large `t` as well, but residuals that remain.
fn refit(problem: &Problem, theta: &[f64], missing: &MissingTerm) -> Option<Refit> {
    let evaluation = problem.evaluate(theta).ok()?;
    let kinds = candidates(problem, &evaluation);
    let kind = kinds.into_iter().find(|(kind, _)| *kind == missing.term)?;
    let from = |theta: &[f64]| {
        let (mut extended, mut start) = extended(problem, theta, constants(problem, &[kind]))?;
        without_correlation(&mut extended.parts_mut().experiments);
        start[problem.functions.scalar_range().start] = missing.value;
        Refit::of(extended, &start)
    };
    let near = from(theta);
    match near {
        Some(near) if near.is_white() => Some(near),
        near => {
            let both = near.into_iter().chain(from(&problem.start()));
            both.min_by(|a, b| a.worst_misfit().total_cmp(&b.worst_misfit()))
        }
    }
}

/// Kinds and terms that the model does not have.
fn candidates(problem: &Problem, evaluation: &Evaluation) -> Vec<(CoefficientKind, Law)> {
    let speeds: Vec<f64> = (evaluation.trajectories.iter())
        .flat_map(|response| response.velocity(0).iter().copied())
        .collect();
    let width = WIDTH * rms(&speeds);
    let set = problem.functions.coefficient_set(0);
    let has = |kind: CoefficientKind| {
        set.iter()
            .any(|f| problem.functions.get(*f).quantity == kind)
    };
    let kinds = TESTED_TERMS.into_iter().filter(|kind| !has(*kind));
    // A static force is a mean of the residuals, which has a test of its own.
    let kinds = kinds.filter(|kind| *kind != CoefficientKind::STATIC_FORCE);
    let kinds = kinds.filter_map(|kind| Some((kind, kind.law(width)?)));
    kinds.filter(|_| width > 0.0 && width.is_finite()).collect()
}

/// Constants for the terms of `kinds`.
fn constants(
    problem: &Problem,
    kinds: &[(CoefficientKind, Law)],
) -> Vec<(CoefficientFunction, Law)> {
    let nodes = problem.functions.nodes();
    let each = kinds.iter();
    each.map(|(kind, term)| (CoefficientFunction::constant(*kind, 0.0, nodes), *term))
        .collect()
}

/// Root mean square of `phi` of a term over all records.
fn force(evaluation: &Evaluation, term: Law) -> f64 {
    let of = |response: &Trajectory| -> Vec<f64> {
        let states = response.displacement(0).iter().zip(response.velocity(0));
        states.map(|(y, v)| term.phi(*y, *v)).collect()
    };
    let all: Vec<f64> = evaluation.trajectories.iter().flat_map(of).collect();
    rms(&all)
}

/// Root mean square of the largest force term of the model.
fn largest_force(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let mut largest = f64::MIN_POSITIVE;
    for (position, term) in problem.system.laws().iter().enumerate() {
        let mut all = Vec::new();
        for (experiment, response) in problem.experiments.iter().zip(&evaluation.trajectories) {
            let Some(values) = (evaluation.nodal_of(experiment.coefficient_set))
                .coefficients
                .get(position)
            else {
                continue;
            };
            let states = response.displacement(0).iter().zip(response.velocity(0));
            all.extend((states.zip(values)).map(|((y, v), p)| p * term.phi(*y, *v)));
        }
        largest = largest.max(rms(&all));
    }
    largest
}
