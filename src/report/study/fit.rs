//! The record of the fit that is studied, and the problem as it was fitted.

use super::StudiedFit;
use crate::config::Model;
use crate::report::{FittedModel, RunAssessment};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Weighting};
use kmcfit_core::solvers::Fit;

impl StudiedFit {
    /// The record of a fit of a model.
    pub fn of(model: &Model, fit: &Fit) -> Self {
        let problem = &model.problem;
        let sigma = |c: &Channel| match c.weighting() {
            Weighting::Estimated { sigma } => Some(*sigma),
            _ => None,
        };
        Self {
            status: fit.outcome.status,
            reason: fit.outcome.reason.to_string(),
            verdict: Some(FittedModel::new(model, fit, &RunAssessment::of(model, fit)).verdict()),
            cost: fit.best.evaluation.cost,
            misfit: fit.best.evaluation.misfit,
            nodes: problem.system.grid.nodes(),
            friction_width: problem.system.friction_width(),
            parameters: fit.best.parameters.clone(),
            weights: problem.penalties.iter().map(|p| p.weight).collect(),
            sigmas: problem.channels().map(sigma).collect(),
        }
    }

    /// The problem with the estimated sigmas and the chosen penalty weights of the fit.
    pub fn problem(&self, problem: &Problem) -> Problem {
        let fitted = problem.clone().with(|parts| {
            for (penalty, weight) in parts.penalties.iter_mut().zip(&self.weights) {
                penalty.weight = *weight;
            }
            let channels = parts.experiments.iter_mut().flat_map(|e| &mut e.channels);
            for (channel, sigma) in channels.zip(&self.sigmas) {
                if let Some(sigma) = *sigma {
                    let weighting = Weighting::Estimated { sigma };
                    *channel = channel.clone().with_weighting(weighting);
                }
            }
        });
        fitted.expect("weights and sigmas change no length")
    }
}
