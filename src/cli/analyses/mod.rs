//! From a fitted problem to the pieces of a study.

mod again;
mod ahead;
mod others;
mod profiles;
mod seen;

pub use again::{multistart, refits, varies};
pub use ahead::{candidates, predictions};
pub use others::{equivalents, level, tubes};
pub use profiles::{linear, profile_of};
pub use seen::{bands, spectrum};

use crate::report::study::*;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::record::Weighting;
use kmcfit_core::internals::solvers::Fit;

/// The fit that is studied.
pub fn fit(problem: &Problem, fit: &Fit) -> FitPiece {
    let sigma = |c: &kmcfit_core::internals::record::Channel| match c.weighting() {
        Weighting::Estimated { sigma } => Some(*sigma),
        _ => None,
    };
    FitPiece {
        status: fit.outcome.status,
        reason: fit.outcome.reason.to_string(),
        cost: fit.best.evaluation.cost,
        misfit: fit.best.evaluation.misfit,
        parameters: fit.best.parameters.clone(),
        weights: problem.penalties.iter().map(|p| p.weight).collect(),
        sigmas: problem.channels().map(sigma).collect(),
    }
}

/// Whether a fit that was kept has the shape of this problem's: a journal may be damaged.
pub fn is_of(problem: &Problem, fit: &FitPiece) -> bool {
    let lengths = [fit.parameters.len(), fit.weights.len(), fit.sigmas.len()];
    let expected = [
        problem.parameters(),
        problem.penalties.len(),
        problem.channels().count(),
    ];
    let is_positive = |sigma: &f64| sigma.is_finite() && *sigma > 0.0;
    lengths == expected && fit.sigmas.iter().flatten().all(is_positive)
}

/// The problem with the sigmas that the fit estimated and the weights that it chose.
pub fn as_fitted(problem: &Problem, fit: &FitPiece) -> Problem {
    let fitted = problem.clone().with(|parts| {
        for (penalty, weight) in parts.penalties.iter_mut().zip(&fit.weights) {
            penalty.weight = *weight;
        }
        let channels = parts.experiments.iter_mut().flat_map(|e| &mut e.channels);
        for (channel, sigma) in channels.zip(&fit.sigmas) {
            if let Some(sigma) = *sigma {
                let weighting = Weighting::Estimated { sigma };
                *channel = channel.clone().with_weighting(weighting);
            }
        }
    });
    fitted.expect("weights and sigmas change no length")
}
