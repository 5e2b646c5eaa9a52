//! A fit with its assessment, all that documents and files of a run are made from.

use super::document::{Prediction, ResultDocument};
use super::fit_assessment::RunAssessment;
use super::run::{FittedModel, RequestedFiles, json};
use crate::config::Model;
use crate::fitting::ModelFit;
use kmcfit_core::functions::CoefficientFunction;
use kmcfit_core::solvers::{Fit, WeightPath};
use kmcfit_core::study::predict;
use kmcfit_core::system::State;

/// A coefficient over the record.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientCurve {
    /// Name, as in the model.
    pub name: String,
    /// Times, s.
    pub t: Vec<f64>,
    /// Values, SI.
    pub value: Vec<f64>,
    /// Lower limits of the pointwise 95 % band, SI; empty without a band.
    pub low: Vec<f64>,
    /// Upper limits.
    pub high: Vec<f64>,
}

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
            predictions: &self.predictions,
            weights: self.weights.as_ref(),
            requested,
            ..FittedModel::new(&self.model, &self.fit, &self.assessment)
        }
    }

    /// The coefficients that vary, at `points` equal distances, with their pointwise 95 % bands where there are any.
    pub fn curves(&self, points: usize) -> Vec<CoefficientCurve> {
        let problem = &self.model.problem;
        let run = self.fitted(RequestedFiles::default());
        let times = problem.system.grid.times();
        let last = times.len().saturating_sub(1);
        let steps = points.saturating_sub(1).clamp(1, last.max(1));
        let rows = |values: &[f64]| -> Vec<f64> {
            let positions = (0..=steps).map(|i| i * last / steps);
            positions
                .filter_map(|position| values.get(position).copied())
                .collect()
        };
        let t = rows(&times);
        let varies = |values: &[f64]| values.iter().any(|x| *x != values[0]);
        let functions = run.named_functions().into_iter().enumerate();
        let functions = functions.filter(|(_, (_, values))| varies(values));
        let curve = |(i, (function, values)): (usize, (&CoefficientFunction, Vec<f64>))| {
            let limits = run
                .bands()
                .and_then(|bands| Some(bands.functions.get(i)?.curves(&bands.times, &t)));
            let [low, high] = limits.unwrap_or_default();
            CoefficientCurve {
                name: function.name(),
                value: rows(&values),
                low,
                high,
                t: t.clone(),
            }
        };
        functions.map(curve).collect()
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
        let responses = predict(
            system,
            coefficients,
            model.truth.as_ref(),
            std::slice::from_ref(state),
        );
        match responses {
            Ok(responses) => responses.into_iter().map(|m| m.summary).collect(),
            Err(breakdown) => vec![Prediction {
                displacement: state.displacement(0),
                velocity: state.velocity(0),
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
