//! A fit with its assessment, all that documents and files of a run are made from.

use super::display_units::DisplayUnits;
use super::document::{Prediction, ResultDocument};
use super::fit_assessment::RunAssessment;
use super::run::{FittedModel, json};
use crate::config::Model;
use crate::fitting::ModelFit;
use crate::results::RequestedFiles;
use kmcfit_core::internals::solvers::{Fit, WeightPath};
use kmcfit_core::internals::study::predict;
use kmcfit_core::internals::system::State;

/// A fit with its predictions and assessment.
#[derive(Debug, Clone)]
pub struct CompletedFit {
    /// The model as fitted.
    pub model: Model,
    /// The fit.
    pub fit: Fit,
    /// Fits with other weights, if a rule chose them.
    pub weights: Option<WeightPath>,
    /// Responses of the fitted system to the initial states of the model file.
    pub predictions: Vec<Prediction>,
    /// The assessment.
    pub assessment: RunAssessment,
}

impl CompletedFit {
    /// Assesses a fit.
    pub fn of(found: ModelFit) -> Self {
        Self {
            predictions: model_predictions(&found.model, &found.fit),
            assessment: RunAssessment::of(&found.model, &found.fit),
            model: found.model,
            fit: found.fit,
            weights: found.weights,
        }
    }

    /// The fit with the files that are requested.
    pub fn fitted(&self, requested: RequestedFiles) -> FittedModel<'_> {
        FittedModel {
            model: &self.model,
            fit: &self.fit,
            predictions: &self.predictions,
            weights: self.weights.as_ref(),
            run_assessment: &self.assessment,
            requested,
            display: DisplayUnits::default(),
        }
    }

    /// Parameters, coefficients, responses and history by the names of their files, with a row for every node.
    pub fn tables(&self, document: &ResultDocument) -> Vec<(String, String)> {
        let run = self.fitted(RequestedFiles {
            tables: true,
            ..RequestedFiles::default()
        });
        let all = [
            ("parameters.json", json(&run.parameters(document))),
            ("functions.csv", run.functions_table().to_csv()),
            ("trajectory.csv", run.trajectories().to_csv()),
            ("history.csv", run.history().to_csv()),
        ];
        all.map(|(name, text)| (name.to_owned(), text)).into()
    }
}

/// Predictions of the model file; a failed one has its reason.
pub fn model_predictions(model: &Model, found: &Fit) -> Vec<Prediction> {
    let coefficients = &found.best.evaluation.nodal;
    let system = &model.problem.system;
    let one = |state: &State| {
        let responses = predict(system, coefficients, model.truth.as_ref(), &[*state]);
        match responses {
            Ok(responses) => responses.into_iter().map(|m| m.summary).collect(),
            Err(breakdown) => vec![Prediction {
                displacement: state.displacement,
                velocity: state.velocity,
                cost: None,
                energy: None,
                largest: None,
                last: None,
                failure: Some(breakdown.to_string()),
            }],
        }
    };
    model.predictions.iter().flat_map(one).collect()
}
