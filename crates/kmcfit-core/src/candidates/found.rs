//! What a refit finds.

use super::Candidate;
use super::addition::Addition;
use super::estimates::estimates;
use super::penalised_misfit::{Judged, Linearised};
use crate::alternatives::Refit;
use crate::problem::Problem;

/// Iteration limit of a refit: those that explain the residuals take at most half as many, others approach a poor minimum in small steps.
const ITERATIONS: u64 = 40;

/// Result of a refit.
pub(super) struct Found {
    pub(super) additions: Vec<Addition>,
    pub(super) judged: Judged,
    /// Parameters at the end of the search.
    pub(super) theta: Vec<f64>,
    /// Number of parameters beyond those of the model.
    pub(super) parameters: usize,
    /// Functions and scalars by name with their parameters.
    pub(super) named: Vec<(String, Vec<f64>)>,
}

impl Found {
    /// As a candidate beside a model with a penalised misfit.
    pub(super) fn candidate(self, problem: &Problem, misfit: f64) -> Candidate {
        let changes = self.judged.estimate.as_slice();
        let starts = self.theta.iter().copied().chain(std::iter::repeat(0.0));
        let mut at: Vec<f64> = starts.zip(changes).map(|(a, d)| a + d).collect();
        at.extend(self.theta.iter().skip(at.len()));
        let estimates = match self.additions.as_slice() {
            [only] => estimates(*only, problem, &at, &self.judged),
            _ => Vec::new(),
        };
        let names = self.additions.iter().map(|a| a.name(problem));
        let candidate = Candidate {
            name: names.collect::<Vec<String>>().join(" and "),
            words: String::new(),
            estimates,
            to_constants: false,
            gain: misfit - self.judged.misfit,
            parameters: self.parameters,
            order: self.judged.order,
            is_refitted: true,
            parameters_by_name: self.named,
            additions: self.additions,
        };
        Candidate {
            words: candidate.in_words(problem),
            ..candidate
        }
    }
}

/// Refit of a changed problem.
pub(super) fn plain(
    problem: &Problem,
    theta: &[f64],
    addition: Addition,
    further: &[f64],
) -> Option<Found> {
    let (changed, start) = addition.added(problem, theta, further)?;
    let parameters = changed.parameters() - problem.parameters();
    let refit = Refit::within(ITERATIONS, changed, &start)?;
    let judged = Linearised::at(&refit.problem, refit.evaluation()).own();
    Some(Found {
        additions: vec![addition],
        named: refit.problem.functions.named(&refit.fit.best.parameters),
        judged,
        theta: refit.fit.best.parameters,
        parameters,
    })
}
