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
mod adopted;
mod columns;
mod constants;
mod early;
mod estimates;
mod found;
mod jump;
mod jump_basis;
mod penalised_misfit;
mod predictions;
mod pulses;
mod record_columns;
mod refits;
mod second_mode;
mod words;

pub use crate::alternatives::RecordParameter;
pub use addition::Addition;

use crate::alternatives::{Disturbance, Refit, applies, uncorrelated, with_cubic_inputs};
use crate::identifiability::Quantity;
use crate::number_format::number_or_nan;
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use columns::linear_candidates;
use penalised_misfit::{Judged, Linearised};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Decrease of the penalised misfit from which a candidate is preferred to the model, and within which two candidates are equally good.
pub const GAIN: f64 = 6.0;
/// Order of the process of the residuals from which candidates are refitted in any case: few kinds of noise have it.
const COLOURED: usize = 3;
/// Fewest samples per parameter.
const SAMPLES_PER_PARAMETER: usize = 4;

/// A candidate and its gain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// What is added, and to what.
    pub name: String,
    /// The same in a sentence.
    pub words: String,
    /// What is added: one thing, two in a pair, none for constants alone.
    #[serde(skip)]
    pub additions: Vec<Addition>,
    /// True for additions to constants in place of the functions that vary.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub to_constants: bool,
    /// Decrease of the penalised misfit.
    #[serde(deserialize_with = "number_or_nan")]
    pub gain: f64,
    /// Number of parameters that are added.
    pub parameters: usize,
    /// Order of the process of the residuals.
    pub order: usize,
    /// True for a gain by a refit; otherwise it is that of a linearisation.
    pub is_refitted: bool,
    /// What the additions estimate.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimates: Vec<Quantity>,
    /// Functions and scalars of the refit by name with their parameters.
    #[serde(skip)]
    pub parameters_by_name: Vec<(String, Vec<f64>)>,
}

impl Candidate {
    /// True where it leaves residuals that are close to white.
    pub fn explains(&self) -> bool {
        self.order < COLOURED
    }

    /// True for a second mode.
    pub fn has_second_mode(&self) -> bool {
        let mut additions = self.additions.iter();
        additions.any(|addition| matches!(addition, Addition::SecondMode { .. }))
    }

    /// Number, time (s) and largest error (N) of wrong samples of the measured force.
    pub(crate) fn input_pulses(&self) -> Option<(usize, f64, f64)> {
        match self.additions.as_slice() {
            [Addition::InputPulses { count, time, error }] => Some((*count, *time, *error)),
            _ => None,
        }
    }

    /// The experiment whose input has a disturbance, which is noise: a fit may have it beside the right model.
    pub(crate) fn disturbed_experiment(&self) -> Option<usize> {
        match self.additions.as_slice() {
            [Addition::Disturbance { experiment }] => Some(*experiment),
            _ => None,
        }
    }
}

/// The candidates of a fit, the best first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
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
        // What lines between the samples of an input lose looks like other candidates, which are then judged beside splines.
        if let Some((splines, candidate)) = with_splines(&white, &theta, &evaluation) {
            let mut found = Self::at(&splines.problem, &splines.fit.best.parameters, None)?;
            found.list.push(candidate);
            found.list.sort_by(best_first);
            return Some(found);
        }
        let mut own = Self::at(&white, &theta, None)?;
        if let Some(constants) = constants::of(&white, &theta, &evaluation) {
            own.list.extend(constants);
            own.list.sort_by(best_first);
        }
        Some(own)
    }

    /// The candidates of a problem with white noise at its least squares; beside a model with the penalised misfit `other` those without a function
    /// that varies.
    fn at(problem: &Problem, theta: &[f64], other: Option<f64>) -> Option<Self> {
        let evaluation = problem.evaluate(theta).ok()?;
        let linearised = Linearised::at(problem, &evaluation);
        let mut own = linearised.own();
        let mut linear = linear_candidates(problem, theta, &evaluation, &linearised);
        linear.retain(|c| other.is_none() || !c.addition.varies());
        let lowest = linear
            .iter()
            .map(|c| c.judged.misfit)
            .fold(f64::INFINITY, f64::min);
        let is_gained = own.misfit - lowest >= GAIN;
        let refits = match is_gained || own.order >= COLOURED {
            true => refits::refits(problem, theta, &own, &linear),
            false => Vec::new(),
        };
        let disturbances = disturbances(problem, &evaluation, &own);
        own.misfit = other.unwrap_or(own.misfit);
        let mut list: Vec<Candidate> = (refits.into_iter())
            .map(|found| found.candidate(problem, own.misfit))
            .collect();
        list.extend(disturbances);
        for candidate in &linear {
            let is_same = |known: &Candidate| match known.additions.as_slice() {
                [only] => only.is_like(candidate.addition),
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

    /// Functions that may vary more than those of the model.
    pub fn varying(&self) -> Vec<usize> {
        let additions = self.ties().into_iter().flat_map(|c| c.additions);
        let functions = additions.filter_map(|addition| match addition {
            Addition::Variation { function, .. }
            | Addition::FinerBasis { function, .. }
            | Addition::Jump { function, .. } => Some(function),
            _ => None,
        });
        functions.collect()
    }

    /// Constants with one thing more that are about as good as the model, whose functions vary.
    pub(crate) fn constants_as_good(&self) -> Vec<Candidate> {
        let constants = self
            .list
            .iter()
            .filter(|c| c.to_constants && c.gain > -GAIN);
        constants.cloned().collect()
    }

    /// Those that are about as good as the one that is preferred, which comes first, but for it with something more; none without one.
    pub fn ties(&self) -> Vec<Candidate> {
        let Some(best) = self.preferred() else {
            return Vec::new();
        };
        let has = |candidate: &Candidate, addition: &Addition| {
            let mut own = candidate.additions.iter();
            own.any(|own| own.is_like(*addition))
        };
        let is_more = |candidate: &Candidate| {
            candidate.additions.len() > best.additions.len()
                && best
                    .additions
                    .iter()
                    .all(|addition| has(candidate, addition))
        };
        let near = self.list.iter().take_while(|c| c.gain > best.gain - GAIN);
        near.filter(|candidate| !is_more(candidate))
            .cloned()
            .collect()
    }
}

/// The refit with cubic splines in place of lines between the samples of the inputs, and this candidate; `None` where it is no better.
fn with_splines(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<(Refit, Candidate)> {
    let splines = Refit::of(with_cubic_inputs(problem)?, theta)?;
    let own = Linearised::at(problem, evaluation).own();
    let found = Linearised::at(&splines.problem, splines.evaluation()).own();
    let gain = own.misfit - found.misfit;
    let addition = Addition::CubicInputs;
    let candidate = Candidate {
        name: addition.name(problem),
        words: addition.words(problem, &[]),
        additions: vec![addition],
        to_constants: false,
        gain,
        parameters: 0,
        order: found.order,
        is_refitted: true,
        estimates: Vec::new(),
        parameters_by_name: Vec::new(),
    };
    (gain > 0.0).then_some((splines, candidate))
}

/// Disturbances of the inputs of a problem with white noise, in place of the processes of the residuals.
fn disturbances(problem: &Problem, evaluation: &Evaluation, own: &Judged) -> Vec<Candidate> {
    let price = (problem.sample_count() as f64).ln();
    let mut channels = 0;
    let each = problem
        .experiments
        .iter()
        .enumerate()
        .filter_map(|(e, experiment)| {
            let first = channels;
            channels += experiment.channels.len();
            let own = own.of_channels.get(first..channels)?;
            let found = Disturbance::of(problem, evaluation, e)?;
            let addition = Addition::Disturbance { experiment: e };
            Some(Candidate {
                name: addition.name(problem),
                words: addition.words(problem, &[]),
                additions: vec![addition],
                to_constants: false,
                gain: own.iter().map(|noise| noise.misfit).sum::<f64>()
                    - found.minus_two_log
                    - price,
                parameters: 1,
                order: 0,
                is_refitted: true,
                estimates: found.estimates(),
                parameters_by_name: Vec::new(),
            })
        });
    each.collect()
}

/// Those that were refitted come before the others; wrong samples of a force need no refit.
fn best_first(a: &Candidate, b: &Candidate) -> Ordering {
    let is_judged = |c: &Candidate| c.is_refitted || c.input_pulses().is_some();
    let is_judged = is_judged(b).cmp(&is_judged(a));
    is_judged.then(b.gain.total_cmp(&a.gain))
}
