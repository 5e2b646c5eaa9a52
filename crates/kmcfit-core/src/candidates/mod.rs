//! What a model lacks: candidates, each the model with one thing more, judged alike by the [penalised misfit](penalised_misfit).
//!
//! 1. The model is fitted by least squares; an autoregressive process of its residuals would hide what it lacks.
//! 2. [All candidates](columns) are judged by one linearisation there.
//! 3. Where the best gain is at least [`GAIN`], or the residuals are far from white, the most promising candidates and those that the record may
//!    not tell from them are [refitted](refits), and judged by their refits; in a free decay also pairs of them.
//! 4. Where functions of the model vary, constants in their place with one thing more are judged beside it.
//!
//! A gain of 6 is posterior odds of 20 to 1 for a candidate: over all of them at most 2 in 100 records from 100 samples on have one by chance.

mod addition;
mod columns;
mod constants;
mod estimates;
mod penalised_misfit;
mod refits;
mod second_mode;

pub use addition::Addition;

use crate::assessment::{Refit, applies, uncorrelated};
use crate::identifiability::Quantity;
use crate::problem::{FEW_PARAMETERS, Problem};
use columns::linear_candidates;
use penalised_misfit::Linearised;
use std::cmp::Ordering;

/// Decrease of the penalised misfit from which a candidate is preferred to the model, and within which two candidates are equally good.
pub const GAIN: f64 = 6.0;
/// Order of the process of the residuals from which candidates are refitted in any case: few kinds of noise have it.
const COLOURED: usize = 3;
/// Fewest samples per parameter.
const SAMPLES_PER_PARAMETER: usize = 4;

/// A candidate and its gain.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What is added: one thing, two in a pair, none for constants alone.
    pub additions: Vec<Addition>,
    /// True for additions to constants in place of the functions that vary.
    pub to_constants: bool,
    /// Decrease of the penalised misfit.
    pub gain: f64,
    /// Number of parameters that are added.
    pub parameters: usize,
    /// Order of the process of the residuals.
    pub order: usize,
    /// What the additions estimate.
    pub estimates: Vec<Quantity>,
    /// Parameters of the refit; `None` for a gain by the linearisation.
    pub refit: Option<Vec<f64>>,
}

/// The candidates of a fit, the best first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Candidates {
    /// The candidates.
    pub list: Vec<Candidate>,
    /// Order of the process of the residuals of the model.
    pub order: usize,
}

impl Candidates {
    /// The candidates of a fit with these parameters; `None` where they cannot be judged: without a likelihood, at an active constraint, for
    /// residuals at machine precision, with few samples or many parameters.
    pub fn of(problem: &Problem, theta: &[f64]) -> Option<Self> {
        let is_few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let is_long = problem.sample_count() >= SAMPLES_PER_PARAMETER * problem.parameters();
        (is_few && is_long && problem.system.structure.is_one()).then_some(())?;
        let white = uncorrelated(problem);
        let is_white = problem.channels().all(|c| c.correlation().is_none());
        let theta = match is_white {
            true => theta.to_vec(),
            false => Refit::of(white.clone(), theta)?.fit.best.parameters,
        };
        let evaluation = white.evaluate(&theta).ok()?;
        applies(&white, &theta, &evaluation).then_some(())?;
        let mut own = Self::at(&white, &theta, None)?;
        if let Some(constants) = constants::of(&white, &theta, &evaluation) {
            own.list.extend(constants);
            own.list.sort_by(best_first);
        }
        Some(own)
    }

    /// The candidates of a problem with white noise at its least squares, beside a model with the penalised misfit `other` or its own.
    fn at(problem: &Problem, theta: &[f64], other: Option<f64>) -> Option<Self> {
        let evaluation = problem.evaluate(theta).ok()?;
        let linearised = Linearised::at(problem, &evaluation);
        let mut own = linearised.own();
        let linear = linear_candidates(problem, theta, &evaluation, &linearised);
        let lowest = linear
            .iter()
            .map(|c| c.judged.misfit)
            .fold(f64::INFINITY, f64::min);
        let is_gained = own.misfit - lowest >= GAIN;
        let refits = match is_gained || own.order >= COLOURED {
            true => refits::refits(problem, theta, &own, &linear),
            false => Vec::new(),
        };
        own.misfit = other.unwrap_or(own.misfit);
        let mut list: Vec<Candidate> = (refits.into_iter())
            .map(|found| found.candidate(problem, own.misfit))
            .collect();
        for candidate in &linear {
            let is_same = |known: &Candidate| match known.additions.as_slice() {
                [only] => refits::same(*only, candidate.addition),
                _ => false,
            };
            if !list.iter().any(is_same) {
                list.push(candidate.candidate(problem, theta, own.misfit));
            }
        }
        list.sort_by(best_first);
        Some(Self {
            list,
            order: own.order,
        })
    }

    /// The candidate that is preferred to the model.
    pub fn preferred(&self) -> Option<&Candidate> {
        self.list.first().filter(|best| best.gain >= GAIN)
    }

    /// Those that are about as good as the one that is preferred, which comes first; without one those that are about as good as the model.
    pub fn ties(&self) -> &[Candidate] {
        let most = self.preferred().map_or(0.0, |best| best.gain);
        let count = self
            .list
            .iter()
            .take_while(|c| c.gain > most - GAIN)
            .count();
        &self.list[..count]
    }
}

/// Those that were refitted come before the others.
fn best_first(a: &Candidate, b: &Candidate) -> Ordering {
    let is_judged = b.refit.is_some().cmp(&a.refit.is_some());
    is_judged.then(b.gain.total_cmp(&a.gain))
}
