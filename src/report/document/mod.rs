//! The result document of a run, `result.json`. Its keys are stable.

mod channel;
mod estimates;
mod fit_summaries;
mod selection_step;
mod verdict;

pub use channel::{ChannelSummary, IgnoredSummary, NoiseSummary, ValidationSummary};
pub use estimates::Estimates;
pub use fit_summaries::{AttemptSummary, PathPointSummary, PenaltySummary, WeightSummary};
pub use selection_step::SelectionStep;
pub use verdict::{Verdict, level_in_words};

use crate::config::DataFile;
use crate::report::cost::CostKind;
use crate::report::timings::TimingsSummary;
use kmcfit_core::assessment::{
    ClassicalEstimate, Doubt, FitStatistics, FunctionSummary, StepCheck,
};
use kmcfit_core::candidates::{Candidate, Candidates};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::identifiability::{ClassificationKind, CovarianceKind, Quantity};
use kmcfit_core::number_format::number_or_nan;
use kmcfit_core::solvers::{EquationBalance, Optimality, Status};
use kmcfit_core::structure::CoefficientKind;
pub use kmcfit_core::study::PredictionSummary as Prediction;
use kmcfit_core::system::Grid;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Version of the document's format.
pub const FORMAT: u32 = 1;

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultDocument {
    /// [`FORMAT`].
    pub format: u32,
    /// Title of the model.
    pub title: String,
    /// Version of kmcfit.
    pub version: String,
    /// Verdict on the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What the samples, constraints and penalties determine, and warnings: parameters and functions that are not identifiable, and limits of the
    /// confidence intervals.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
    /// Estimates of the natural frequency, the damping ratio, the functions and ratios; none for a fit that failed.
    #[serde(default, skip_serializing_if = "Estimates::is_empty")]
    pub estimates: Estimates,
    /// Natural frequency and damping ratio by a classical method, where a record and the model allow it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classical: Option<ClassicalEstimate>,
    /// Model, grid and method.
    pub model: ModelSummary,
    /// Status and reason of the end.
    pub outcome: OutcomeSummary,
    /// The cost and its parts.
    pub cost: CostSummary,
    /// The gradient at the start and at the end.
    pub gradient: GradientSummary,
    /// Residual of the first-order condition of a constrained minimum at the best point; absent for an unfinished fit,
    /// for J = 0, and if the linearised problem could not be solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optimality: Option<Optimality>,
    /// Work done; one count is one pass over all experiments.
    pub counts: CountsSummary,
    /// Wall-clock time of the fit, s. Two runs of one model differ in this and in `timings` only.
    pub seconds: f64,
    /// Wall-clock time of the whole run by activity.
    #[serde(default)]
    pub timings: TimingsSummary,
    /// Estimated functions, by name.
    pub functions: BTreeMap<String, FunctionSummary>,
    /// The constraints at the best point.
    #[serde(default)]
    pub constraints: ConstraintSummary,
    /// Identifiability of the parameters.
    #[serde(default)]
    pub identifiability: IdentifiabilitySummary,
    /// Choice of the penalty weight by a rule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<WeightSummary>,
    /// Penalties on the roughness of functions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub penalties: Vec<PenaltySummary>,
    /// Attempts from several starting points, in order.
    #[serde(default)]
    pub attempts: Vec<AttemptSummary>,
    /// Fit of each experiment.
    pub experiments: Vec<ExperimentSummary>,
    /// Validation records: predicted by the fit, not used in it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<ValidationSummary>,
    /// Estimated initial states and sensor parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nuisance_parameters: Vec<Quantity>,
    /// Statistics of all samples.
    #[serde(default)]
    pub statistics: FitStatistics,
    /// Step-size check: the optimum simulated with half the step; `null` if there is no response.
    #[serde(default)]
    pub step_check: Option<StepCheck>,
    /// Candidates: the model with one thing more, the best first; absent where they cannot be judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub candidates: Option<Candidates>,
    /// Additions to the model by `--select`, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub selection: Vec<SelectionStep>,
    /// Residual of the equation of motion beside its forces; absent for fits that simulate the response.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equation: Option<EquationBalance>,
    /// Predicted free responses from other initial states.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predictions: Vec<Prediction>,
    /// The data files as they were read.
    #[serde(default)]
    pub sources: Vec<DataFile>,
    /// What was found in the data and done with it: repeated times, gaps, faulty samples, quantisation and stated delays.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub data: Vec<Finding>,
    /// Automatic choices, such as the number of nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub automatic: Vec<Finding>,
    /// Warnings about data and specification.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Finding>,
    /// Recommendations, the most urgent first.
    #[serde(default, skip_serializing_if = "Vec::is_empty", alias = "suggestions")]
    pub advice: Vec<Finding>,
}

/// Model, grid and method of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelSummary {
    /// Path of the model file, as given.
    #[serde(default)]
    pub file: String,
    /// Path from the folder of the run to that of the model file; the run holds the model itself as `model.yaml`.
    #[serde(default)]
    pub folder: PathBuf,
    /// Overrides (`--set`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Number of nodes.
    pub nodes: usize,
    /// Steps between the rows of `functions.csv`: 1, more on long grids.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub steps_per_row: usize,
    /// Steps between the rows of `trajectory.csv`: 1, more on long grids.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub steps_per_trajectory_row: usize,
    /// First time, s.
    pub start: f64,
    /// Length of the record, s.
    pub duration: f64,
    /// Step `duration / (nodes - 1)`, s.
    pub step: f64,
    /// Stepper.
    pub stepper: String,
    /// Solver.
    pub method: String,
    /// Adjoint of the gradient: discrete or continuous.
    pub gradient: String,
    /// Number of free parameters.
    pub parameters: usize,
    /// True if the mass is unknown: it is 1, and all other functions are ratios to it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mass_unknown: bool,
    /// The force terms, by the names of their functions.
    #[serde(default = "linear_terms")]
    pub terms: Vec<String>,
    /// Widths of the laws that have one, by the names of their functions: m/s for Coulomb friction.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub widths: BTreeMap<String, f64>,
    /// Kind of the misfit in J: `integral`, `chi-square`, `mixed` or `equation-error`.
    pub cost_kind: CostKind,
    /// Formula of J with all factors, as a sentence.
    pub cost_definition: String,
}

fn one() -> usize {
    1
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde calls"
)]
fn is_one(steps: &usize) -> bool {
    *steps == 1
}

impl ModelSummary {
    /// The grid of the run; `None` if the values are invalid.
    pub fn grid(&self) -> Option<Grid> {
        Grid::new(self.start, self.duration, self.nodes)
    }
}

/// End of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeSummary {
    /// Status.
    pub status: Status,
    /// Reason, as a sentence.
    pub reason: String,
}

/// The cost `J` and its parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CostSummary {
    /// At the start.
    #[serde(deserialize_with = "number_or_nan")]
    pub initial: f64,
    /// At the best point.
    #[serde(deserialize_with = "number_or_nan")]
    pub r#final: f64,
    /// `final / initial`.
    #[serde(deserialize_with = "number_or_nan")]
    pub ratio: f64,
    /// Part of `final` from the samples.
    #[serde(deserialize_with = "number_or_nan")]
    pub misfit: f64,
    /// Part of `final` from the regularisation.
    #[serde(deserialize_with = "number_or_nan")]
    pub regularisation: f64,
}

/// The squared L2 norm `G^2` of the gradient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GradientSummary {
    /// At the start.
    #[serde(deserialize_with = "number_or_nan")]
    pub initial_norm_squared: f64,
    /// At the best point.
    #[serde(deserialize_with = "number_or_nan")]
    pub final_norm_squared: f64,
}

/// Work done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CountsSummary {
    /// Iterations of the reported fit, one row of `history.csv` each, without those of other fits along a weight path.
    pub iterations: u64,
    /// Forward solves.
    pub forward: u64,
    /// Adjoint solves.
    pub adjoint: u64,
    /// Tangent solves.
    pub tangent: u64,
    /// Quadratic programs.
    pub qp: u64,
}

/// Terms of result documents without the field `terms`.
fn linear_terms() -> Vec<String> {
    vec!["damping".into(), "stiffness".into()]
}

impl ResultDocument {
    /// The channels of the fitted experiments.
    pub(super) fn channels(&self) -> impl Iterator<Item = &ChannelSummary> {
        self.experiments.iter().flat_map(|e| &e.channels)
    }

    /// The channels of all records with the names of the records, validation records last.
    pub(super) fn records(&self) -> impl Iterator<Item = (String, &ChannelSummary)> {
        let fitted = self.experiments.iter();
        let fitted = fitted.map(|e| (e.name.clone(), &e.channels));
        let held = self.validation.iter();
        let held = held.map(|e| (e.title(), &e.channels));
        let named = fitted.chain(held);
        named.flat_map(|(name, channels)| channels.iter().map(move |c| (name.clone(), c)))
    }

    /// The functions in the order of the equation of motion.
    pub(super) fn terms(&self) -> impl Iterator<Item = (&str, &FunctionSummary)> {
        let names = std::iter::once("mass").chain(self.model.terms.iter().map(String::as_str));
        names.filter_map(|name| Some((name, self.functions.get(name)?)))
    }

    /// All functions: those of the equation of motion, then those of single experiments.
    pub(super) fn all_functions(&self) -> impl Iterator<Item = (&str, &FunctionSummary)> {
        let own = self.functions.iter().map(|(name, f)| (name.as_str(), f));
        let own =
            own.filter(|(name, _)| *name != "mass" && !self.model.terms.iter().any(|t| t == name));
        self.terms().chain(own)
    }

    /// True for an estimated function that is identified and differs from zero; one that does not varies by rounding errors.
    pub(super) fn is_determined(&self, name: &str) -> bool {
        let mut estimates = self.estimates.0.iter();
        let estimate = estimates.find(|(of, _)| of == name);
        let interval = estimate.and_then(|(_, estimate)| estimate.ci95);
        let is_zero = interval.is_some_and(|[low, high]| low <= 0.0 && high >= 0.0);
        let function = self.functions.get(name);
        let is_open = function
            .is_some_and(|f| f.fixed || f.verdict == Some(ClassificationKind::NotIdentified));
        !is_zero && !is_open
    }

    /// True if the fit minimises the misfit of a simulated response; false for the equation error.
    pub(super) fn is_simulated(&self) -> bool {
        self.model.cost_kind != CostKind::EquationError
    }

    /// Findings that are no warnings.
    pub(super) fn notes(&self) -> impl Iterator<Item = &Finding> {
        self.findings
            .iter()
            .filter(|f| f.severity == Severity::Note)
    }

    /// Warnings on identifiability and the confidence intervals.
    pub(super) fn fit_warnings(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|f| f.severity > Severity::Note)
    }

    /// Warnings that are no reasons of the verdict, where they stand with the same sentence.
    pub(super) fn other_warnings<'a>(
        &'a self,
        warnings: impl Iterator<Item = &'a Finding>,
    ) -> Vec<String> {
        let reasons = self.verdict.as_ref().map_or(&[][..], |v| &v.reasons);
        let is_other = |text: &String| reasons.iter().all(|reason| reason.sentence != *text);
        warnings
            .map(|w| w.sentence.clone())
            .filter(is_other)
            .collect()
    }

    /// True where the fit or the data show two modes.
    pub(super) fn has_two_modes(&self) -> bool {
        self.doubts().any(|doubt| match doubt {
            Doubt::SecondMode { .. } => true,
            Doubt::Preferred { candidates } => {
                (candidates.first()).is_some_and(Candidate::has_second_mode)
            }
            _ => false,
        })
    }

    /// The doubts about a fit of this process, the reasons of the verdict before all findings; a file has their sentences alone.
    pub(crate) fn doubts(&self) -> impl Iterator<Item = &Doubt> {
        let reasons = self.verdict.iter().flat_map(|verdict| &verdict.reasons);
        let all = reasons.chain(&self.findings);
        all.filter_map(|finding| finding.doubt.as_ref())
    }

    /// True if a previous fit estimated the standard deviation of a channel, which changes the cost of the last one.
    pub(super) fn estimates_sigma(&self) -> bool {
        self.channels().any(|c| c.sigma_estimated)
    }

    /// Smallest fit of a channel, per cent.
    pub(super) fn worst_fit(&self) -> Option<f64> {
        let fits = self.channels().map(|c| c.fit_percent);
        fits.filter(|x| x.is_finite()).reduce(f64::min)
    }

    /// True if the displacement is an angle in rad; the mass is then a moment of inertia.
    pub fn is_rotation(&self) -> bool {
        let mass = self.functions.get(CoefficientKind::MASS.name());
        mass.is_some_and(|mass| mass.unit == CoefficientKind::MASS.angular_unit())
    }
}

/// One experiment at the best point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentSummary {
    /// Name.
    pub name: String,
    /// Excitation: `force`, `base` or both; empty for a free response.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub driven_by: Vec<String>,
    /// Number of samples of all channels.
    pub samples: usize,
    /// Root-mean-square residual of the first channel, in its SI unit.
    #[serde(deserialize_with = "number_or_nan")]
    pub rms_residual: f64,
    /// Fit of each channel.
    #[serde(default)]
    pub channels: Vec<ChannelSummary>,
}

/// Identifiability: the structural rank, and findings and warnings on functions and ratios. Confidence intervals are
/// computed for models of at most 64 parameters; `kmcfit study` covers the others.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct IdentifiabilitySummary {
    /// Upper bound of the number of identifiable parameter combinations.
    pub rank_bound: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// True if the optimum identifies no system; the first warning of the findings has the reason.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
    /// Assumptions of the model beside the records: fixed functions, bases, constraints, penalties.
    pub assumptions: Vec<String>,
    /// Kind of the covariance of the intervals: `penalised`, `bayesian` or `kernel`; absent for the inverse of the information of
    /// the samples, and without intervals.
    #[serde(default, skip_serializing_if = "CovarianceKind::is_information")]
    pub covariance: CovarianceKind,
}

/// The constraints at the best point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ConstraintSummary {
    /// Largest violation relative to its row's scale; 0 if all hold or there are none.
    pub max_violation: f64,
    /// The groups with rows at their bounds.
    pub active: Vec<ActiveSummary>,
    /// Violated soft constraints.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub slack: Vec<SlackSummary>,
}

/// A group of constraints with rows at their bounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActiveSummary {
    /// Name of the constraint.
    pub name: String,
    /// Number of active rows.
    pub rows: usize,
    /// Spans of time on which rows are active, s.
    pub spans: Vec<[f64; 2]>,
    /// Sum of the absolute multipliers.
    pub multiplier: f64,
    /// The sentence.
    pub text: String,
}

/// A violated soft constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SlackSummary {
    /// Name of the constraint.
    pub name: String,
    /// Number of violated rows.
    pub rows: usize,
    /// Largest violation, in the unit of the row.
    pub largest: f64,
    /// Its penalty, a part of J.
    pub penalty: f64,
}

/// Result document of a run that failed before the fit: its outcome alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FailureDocument {
    /// [`FORMAT`].
    pub format: u32,
    /// Title of the model.
    pub title: String,
    /// Version of kmcfit.
    pub version: String,
    /// Status `failed` and the reason.
    pub outcome: OutcomeSummary,
}

impl FailureDocument {
    /// The document of a failed run.
    pub fn new(title: &str, reason: &str) -> Self {
        Self {
            format: FORMAT,
            title: title.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            outcome: OutcomeSummary {
                status: Status::Failed,
                reason: reason.into(),
            },
        }
    }
}
