//! What is compared: the numbers of one run.

use super::run::ComparedRun;
use super::verdict::{Match, verdict};
use crate::report::cost::CostKind;
use crate::report::document::Prediction;
use kmcfit_core::internals::assessment::{RECOVERED, Roughness, TruthErrors};
use kmcfit_core::internals::solvers::Status;
use serde::Serialize;

/// The numbers of one run, and what they mean in one line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// What the comparison calls the run.
    pub name: String,
    /// Title of the model.
    pub title: String,
    /// How the run ended, in one word.
    pub status: Status,
    /// How the run ended, in one sentence.
    pub reason: String,
    /// What the numbers mean, in one line.
    pub verdict: String,
    /// Whether the measured motion is matched.
    #[serde(skip)]
    pub is_matched: bool,
    /// Whether the truth is known, and reached in `k/m` and `c/m`.
    pub true_device: Option<bool>,
    /// Solver.
    pub method: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of free parameters.
    pub parameters: usize,
    /// Part of J from the readings, in `misfit_unit`.
    pub misfit: f64,
    /// `m^2 s`; `1` for a chi-square; `N^2 s` for the equation error; of a rotation `rad^2 s` and `N^2 m^2 s`.
    pub misfit_unit: &'static str,
    /// Fit of the channel that is matched worst, per cent; `None` where there is none.
    pub worst_fit: Option<f64>,
    /// Whether the motion is a rotation: then what is said in kg, N and m is in kg m², N m and rad.
    pub is_rotation: bool,
    /// Whether `J/J0` means anything: not where sigma was estimated.
    pub has_ratio: bool,
    /// `J/J0`.
    pub cost_ratio: f64,
    /// Iterations of the solver, those along a path of weights included.
    pub iterations: u64,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Distances from the truth, where it is known.
    pub errors: Option<TruthErrors>,
    /// Smallest mass at a node, kg.
    pub smallest_mass: f64,
    /// Smallest damping at a node, N s/m.
    pub smallest_damping: f64,
    /// Largest violation of a constraint relative to its scale.
    pub max_violation: Option<f64>,
    /// How rough the functions are.
    pub roughness: Roughness,
    /// The motion from other initial states.
    pub predictions: Vec<Prediction>,
    /// What the model says besides the readings, in words.
    pub knowledge: Vec<String>,
    /// What the data leave open, in words.
    pub open: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Measures {
    /// The numbers of a run.
    pub fn of(run: &ComparedRun) -> Self {
        let document = &run.finished.document;
        let device = &run.finished.device;
        let matching = Match::of(run);
        let errors = (run.finished.truth.as_ref()).map(|truth| TruthErrors::of(device, truth));
        Self {
            name: run.name.clone(),
            title: document.title.clone(),
            status: document.outcome.status,
            reason: document.outcome.reason.clone(),
            verdict: verdict(&matching, errors.as_ref()),
            is_matched: matching.is_matched(),
            true_device: errors.as_ref().map(|e| e.within(RECOVERED)),
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
            is_rotation: document.is_rotation(),
            has_ratio: document.has_ratio(),
            cost_ratio: document.cost.ratio,
            iterations: document.counts.iterations
                + document.weights.as_ref().map_or(0, |w| w.iterations()),
            seconds: document.seconds,
            errors,
            smallest_mass: smallest(&device.mass),
            smallest_damping: smallest(&device.coefficients[0]),
            max_violation: run.max_violation,
            roughness: Roughness::of(device, run.finished.system.grid.step()),
            predictions: document.predictions.clone(),
            knowledge: document.identifiability.knowledge.clone(),
            open: document.identifiability.open.clone(),
            warnings: document.warnings.clone(),
        }
    }
}

fn smallest(f: &[f64]) -> f64 {
    f.iter().copied().fold(f64::INFINITY, f64::min)
}
