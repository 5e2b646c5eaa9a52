//! Statistics of all channels together.

use crate::diagnostics::{InformationCriteria, with_estimated_sigma, with_known_sigma};
use crate::noise::Correlation;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Loss, Weighting};
use serde::{Deserialize, Serialize};

/// Goodness of fit and information criteria of a fit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FitStatistics {
    /// Number of samples.
    pub samples: usize,
    /// Number of parameters of functions and scalars.
    pub parameters: usize,
    /// Reduced chi-square `J / (n - p)` of samples with known sigma; `None` where undefined.
    pub reduced_chi_square: Option<f64>,
    /// Akaike information criterion.
    pub aic: Option<f64>,
    /// Akaike information criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
}

/// Statistics at the point of `evaluation`; chi-square and criteria require least squares without penalties.
pub fn statistics(problem: &Problem, evaluation: &Evaluation) -> FitStatistics {
    let samples = problem.sample_count();
    let parameters = problem.parameters();
    let mut summary = FitStatistics {
        samples,
        parameters,
        ..FitStatistics::default()
    };
    // Penalties reduce the degrees of freedom by a number that is not computed here.
    let plain = problem.penalties.is_empty() && problem.variations.is_empty();
    let squares = problem.channels().all(|c| c.loss() == Loss::Squares);
    if !(plain && squares) || samples <= parameters {
        return summary;
    }
    let p = parameters as f64;
    // Correlated noise adds log |R| to minus twice the logarithm of the likelihood, and its coefficients to the parameters.
    let correlations = || problem.channels().filter_map(|c| c.correlation());
    let determinant: f64 = correlations().map(Correlation::log_determinant).sum();
    let all = p + correlations().map(|c| c.order() as f64).sum::<f64>();
    let sigma = |known: bool| {
        problem
            .channels()
            .all(|c| matches!(c.weighting(), Weighting::Sigma(_) | Weighting::Sigmas(_)) == known)
    };
    let criteria: Option<InformationCriteria> = if sigma(true) {
        summary.reduced_chi_square = Some(evaluation.misfit / (samples as f64 - p));
        with_known_sigma(evaluation.misfit + determinant, samples, all)
    } else if sigma(false) && problem.channels().count() == 1 {
        let squares = problem
            .channels()
            .zip(evaluation.predictions.iter().flatten());
        let sum: f64 = squares
            .flat_map(|(c, predicted)| c.innovations(predicted))
            .map(|r| r * r)
            .sum();
        // n log(S |R|^(1/n)/n) = n log(S/n) + log |R|
        let root = (determinant / samples as f64).exp();
        with_estimated_sigma(sum * root, samples, all)
    } else {
        None
    };
    summary.aic = criteria.map(|c| c.aic);
    summary.aicc = criteria.and_then(|c| c.aicc);
    summary.bic = criteria.map(|c| c.bic);
    summary
}
