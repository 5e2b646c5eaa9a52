//! Compared quantities of one run.

use super::likelihood::Likelihood;
use super::run::ComparedRun;
use super::verdict::{Agreement, ResponseFit, verdict};
use crate::finding::Finding;
use crate::report::cost::CostKind;
use crate::report::document::Prediction;
use kmcfit_core::internals::assessment::{Estimate, Roughness, TruthErrors, VerdictLevel};
use kmcfit_core::internals::solvers::Status;
use serde::Serialize;

/// Compared quantities of one run; `--json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// Name of the run in the comparison.
    pub name: String,
    /// Title of the model.
    pub title: String,
    /// Status.
    pub status: Status,
    /// Reason of the status, as a sentence.
    pub reason: String,
    /// Summary in one line.
    pub verdict: String,
    /// Level of the verdict on the fit.
    #[serde(skip)]
    pub level: Option<VerdictLevel>,
    /// True if the response is fitted.
    #[serde(skip)]
    pub is_matched: bool,
    /// True if `k/m` and `c/m` agree with the true system; `null` if it is not known.
    pub is_true_system: Option<bool>,
    /// Solver.
    pub method: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of free parameters.
    pub parameters: usize,
    /// Part of J from the samples, in `misfit_unit`.
    pub misfit: f64,
    /// `m^2 s`; `1` for a chi-square; `N^2 s` for the equation error; of a rotation `rad^2 s` and `N^2 m^2 s`.
    pub misfit_unit: &'static str,
    /// Smallest fit of a channel, per cent; `null` if no channel has one.
    pub worst_fit: Option<f64>,
    /// Likelihood and criteria; `null` without a likelihood.
    pub likelihood: Option<Likelihood>,
    /// BIC minus that of the best run; `null` without a likelihood, and where the runs have different records.
    pub bic_difference: Option<f64>,
    /// Smallest fit of a channel of the validation records, per cent; `null` without any.
    pub validation_fit: Option<f64>,
    /// Natural frequency, Hz.
    pub natural_frequency: Option<Estimate>,
    /// Damping ratio.
    pub damping_ratio: Option<Estimate>,
    /// True if the displacement is an angle; kg, N and m then denote kg m², N m and rad.
    pub is_rotation: bool,
    /// True if `J/J0` is meaningful: not if sigma was estimated.
    pub has_ratio: bool,
    /// `J/J0`.
    pub cost_ratio: f64,
    /// Iterations of the solver, those along a path of weights included.
    pub iterations: u64,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Errors relative to the true system, if known.
    pub errors: Option<TruthErrors>,
    /// Smallest mass at a node, kg.
    pub smallest_mass: f64,
    /// Smallest damping at a node, N s/m.
    pub smallest_damping: f64,
    /// Largest violation of a constraint relative to its scale.
    pub max_violation: Option<f64>,
    /// Roughness of the functions.
    pub roughness: Roughness,
    /// Predicted free responses.
    pub predictions: Vec<Prediction>,
    /// Assumptions of the model beside the records.
    pub assumptions: Vec<String>,
    /// Warnings on identifiability.
    pub identifiability: Vec<Finding>,
    /// Warnings about data and specification.
    pub warnings: Vec<Finding>,
}

impl Measures {
    /// Quantities of a run.
    pub fn of(run: &ComparedRun) -> Self {
        let document = &run.finished.document;
        let coefficients = &run.finished.coefficients;
        let response = ResponseFit::of(run);
        let errors =
            (run.finished.truth.as_ref()).map(|truth| TruthErrors::of(coefficients, truth));
        Self {
            name: run.name.clone(),
            title: document.title.clone(),
            status: document.outcome.status,
            reason: document.outcome.reason.clone(),
            verdict: verdict(&response, errors.as_ref()),
            level: document.verdict.as_ref().map(|verdict| verdict.level),
            is_matched: response.is_matched(),
            is_true_system: (errors.as_ref())
                .map(|errors| Agreement::of(errors) == Agreement::Recovered),
            method: document.model.method.clone(),
            nodes: document.model.nodes,
            parameters: document.model.parameters,
            misfit: document.cost.misfit,
            misfit_unit: match (document.model.cost_kind, document.is_rotation()) {
                (CostKind::ChiSquare, _) => "1",
                (CostKind::EquationError, false) => "N^2 s",
                (CostKind::EquationError, true) => "N^2 m^2 s",
                (CostKind::Integral | CostKind::Mixed, false) => "m^2 s",
                (CostKind::Integral | CostKind::Mixed, true) => "rad^2 s",
            },
            worst_fit: document.worst_fit(),
            likelihood: Likelihood::of(document),
            bic_difference: None,
            validation_fit: (document.validation.iter().flat_map(|v| &v.channels))
                .map(|c| c.fit_percent)
                .filter(|fit| fit.is_finite())
                .reduce(f64::min),
            natural_frequency: document.estimates.get("natural_frequency").cloned(),
            damping_ratio: document.estimates.get("damping_ratio").cloned(),
            is_rotation: document.is_rotation(),
            has_ratio: document.has_ratio(),
            cost_ratio: document.cost.ratio,
            iterations: document.counts.iterations
                + document.weights.as_ref().map_or(0, |w| w.iterations()),
            seconds: document.seconds,
            errors,
            smallest_mass: smallest(&coefficients.mass),
            smallest_damping: smallest(&coefficients.coefficients[0]),
            max_violation: run.max_violation,
            roughness: Roughness::of(coefficients, run.finished.system.grid.step()),
            predictions: document.predictions.clone(),
            assumptions: document.identifiability.assumptions.clone(),
            identifiability: document.fit_warnings().cloned().collect(),
            warnings: document.warnings.clone(),
        }
    }
}

fn smallest(f: &[f64]) -> f64 {
    f.iter().copied().fold(f64::INFINITY, f64::min)
}
