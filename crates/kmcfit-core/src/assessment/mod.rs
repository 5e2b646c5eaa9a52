//! Assessment of a fit: statistics of the residuals, step-size check, plausibility, standard errors and bands.

mod assumptions;
mod channel;
mod classical;
mod constants;
mod doubt;
mod equation_error;
mod estimates;
mod friction_width;
mod function;
mod implausible;
mod input_correlation;
mod input_disturbance;
mod input_jumps;
mod interpolation_loss;
mod large_covariance;
mod median_frequency;
mod parts;
mod plausibility;
mod record_error;
mod record_errors;
mod recovery;
mod sentences;
mod statistics;
mod step_check;
mod variation;
mod verdict;

pub use crate::alternatives::POOR;
pub use assumptions::verdict_assumptions;
pub use channel::{ResidualPattern, pattern};
pub use classical::ClassicalEstimate;
pub(crate) use constants::constant_probability;
pub use doubt::{Doubt, Unidentified};
pub use equation_error::{EquationErrorIntervals, NoIntervals};
pub use estimates::{Estimate, EstimateStatus, estimates};
pub use function::{EstimateErrors, FunctionSummary, function_summaries};
pub use implausible::Implausible;
pub use large_covariance::quantities_of_many;
pub use parts::Parts;
pub use plausibility::{BEYOND_SIGMA, EXACT, Plausibility};
pub use record_error::RecordError;
pub use recovery::TruthErrors;
pub use statistics::FitStatistics;
pub(crate) use statistics::statistics;
pub use step_check::StepCheck;
pub(crate) use step_check::StepCheckOutcome;
pub use verdict::{VerdictLevel, verdict_reasons};

use classical::classical_estimate;
use friction_width::width_warning;
use input_jumps::{connected_jump, or_jump};
use interpolation_loss::{interpolation_losses, is_loss};
use record_errors::large_error;
use variation::variation_warnings;

use crate::alternatives::Disturbance;
use crate::candidates::Candidates;
use crate::functions::CoefficientFunction;
use crate::identifiability::{
    Bands, FunctionClassification, Quantities, classify_functions, condition_on_bases,
    condition_on_inputs, condition_on_time,
};
use crate::objective::Refined;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::solvers::{Fit, Status};
use crate::threads::{analyses_at_once, both, is_stopped};

/// Results of both analyses, which are computed at the same time for all but the longest records.
fn at_once<A, B: Send>(
    problem: &Problem,
    one: impl FnOnce() -> A,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    match analyses_at_once(problem.sample_count()) {
        1 => (one(), other()),
        _ => both(one, other),
    }
}

/// Assessment of a fit of a simulated response.
#[derive(Debug, Clone)]
pub struct FitAssessment {
    /// Step-size check.
    pub step_check: StepCheckOutcome,
    /// Statistics of all channels.
    pub statistics: FitStatistics,
    /// Plausibility and warnings.
    pub plausibility: Plausibility,
    /// Effective number of parameters of the function of each penalty ([`Problem::effective_parameters`]), where there are penalties.
    pub effective_parameters: Option<Vec<f64>>,
    /// Covariance, bands of functions and ratios, where standard errors are meaningful.
    pub bands: Option<Bands>,
    /// Estimates with more than 64 parameters, where standard errors are meaningful.
    pub of_many: Option<Quantities>,
    /// Classification of functions and ratios by their bands.
    pub classifications: Vec<FunctionClassification>,
    /// Natural frequency and damping ratio by a classical method, where a record allows it.
    pub classical: Option<ClassicalEstimate>,
    /// Candidates beside the model, where they can be judged.
    pub candidates: Option<Candidates>,
    /// Parts that a request to end left out.
    pub not_done: Vec<&'static str>,
}

impl FitAssessment {
    /// Assesses `fit`; covariance, bands and classifications for up to 64 parameters, and with `judges_candidates` the candidates beside it.
    pub fn of(problem: &Problem, fit: &Fit, judges_candidates: bool) -> Self {
        let best = &fit.best;
        let few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let reports_errors = few && problem.sample_count() > problem.parameters();
        // Causes and classical estimates are those of one coordinate.
        let is_one = problem.system.structure.is_one();
        let has_causes = reports_errors && is_one && fit.outcome.status != Status::Failed;
        let mut parts = Parts::default();
        let halved = |parts: &mut Parts| {
            let halved = parts.part("step-size check", || problem.on_half_step(&best.evaluation));
            halved.unwrap_or(Ok(None))
        };
        let candidates = || {
            let applies = has_causes && judges_candidates && !is_stopped();
            applies
                .then(|| Candidates::of(problem, &best.parameters))
                .flatten()
        };
        let (halved, candidates) = at_once(problem, || halved(&mut parts), candidates);
        let check = |refined| StepCheck::of(problem, &best.evaluation, refined);
        let step_check: StepCheckOutcome = match &halved {
            Ok(refined) => Ok(refined.as_ref().map(check)),
            Err(error) => Err(*error),
        };
        let preferred = candidates.as_ref().and_then(Candidates::preferred);
        let lacks = preferred.is_some();
        let mut plausibility = Plausibility::of(
            problem,
            &best.evaluation,
            &step_check,
            reports_errors,
            lacks,
        );
        if fit.outcome.status == Status::Failed {
            plausibility.fail();
        }
        let mut assessment = Self {
            step_check,
            statistics: statistics(problem, &best.evaluation),
            plausibility,
            effective_parameters: None,
            bands: None,
            of_many: None,
            classifications: Vec::new(),
            classical: None,
            candidates,
            not_done: Vec::new(),
        };
        if has_causes {
            let (plausibility, candidates) =
                (&assessment.plausibility, assessment.candidates.as_ref());
            let found = parts.part("tests of what the model lacks", || {
                cause(problem, fit, plausibility, judges_candidates, candidates)
            });
            assessment.plausibility.warnings.extend(found.flatten());
        }
        if reports_errors && assessment.plausibility.errors_hold {
            let halved = halved.ok().flatten();
            assessment.add_errors(problem, fit, halved, &mut parts);
        } else if !few
            && assessment.plausibility.errors_hold
            && !assessment.plausibility.is_coloured
        {
            let of_many = || quantities_of_many(problem, &best.parameters, &best.evaluation);
            assessment.of_many = parts.part("confidence intervals", of_many).flatten();
        }
        if is_one && fit.outcome.status != Status::Failed {
            let bands = assessment.bands.as_ref();
            let effective = assessment.effective_parameters.as_deref();
            let found = parts.part("classical estimate", || {
                let varying = variation_warnings(problem, &best.evaluation, bands, effective);
                (
                    varying,
                    classical_estimate(problem, &best.evaluation, bands),
                )
            });
            let (varying, classical) = found.unwrap_or_default();
            assessment.plausibility.warnings.extend(varying);
            assessment.classical = classical;
        }
        let disagrees = assessment.classical.iter().filter(|c| !c.agrees).cloned();
        let disagrees = disagrees.map(Doubt::ClassicalDisagrees);
        assessment.plausibility.warnings.extend(disagrees);
        assessment.not_done = parts.not_done;
        assessment
    }

    /// Adds covariance, bands and classifications.
    fn add_errors(
        &mut self,
        problem: &Problem,
        fit: &Fit,
        halved: Option<Refined>,
        parts: &mut Parts,
    ) {
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        let found = parts.part("confidence intervals", || {
            Bands::with_half_step(problem, theta, evaluation, halved)
        });
        let Some(bands) = found else {
            return;
        };
        self.classifications = classify_functions(problem, evaluation, &bands);
        let is_white = !self.plausibility.is_coloured && !self.plausibility.is_disturbed;
        if problem.system.structure.is_one() {
            let losses = parts.part("loss by interpolation", || {
                interpolation_losses(problem, theta, evaluation, is_white)
            });
            let losses = losses.unwrap_or_default();
            let warnings = &mut self.plausibility.warnings;
            warnings.retain(|warning| !is_loss(problem, &losses, warning));
            warnings.extend(losses);
        }
        if let Some(candidates) = &self.candidates {
            let varying = candidates.varying();
            condition_on_bases(problem, &mut self.classifications, &varying);
            let as_good = candidates.constants_as_good();
            if !as_good.is_empty() {
                let several = problem.functions.iter().enumerate();
                let several = several.filter(|(_, function)| !is_constant(function));
                let several: Vec<usize> = several.map(|(f, _)| f).collect();
                condition_on_time(problem, &mut self.classifications, &several);
                if candidates.preferred().is_none() {
                    let doubt = Doubt::AsGood {
                        candidates: as_good,
                    };
                    self.plausibility.warnings.push(doubt);
                }
            }
        }
        if self.plausibility.is_disturbed {
            condition_on_inputs(&mut self.classifications);
        }
        if !problem.penalties.is_empty() {
            self.effective_parameters = problem.effective_parameters(theta, evaluation);
        }
        self.bands = Some(bands);
    }

    /// Means over the record and scalars with their standard errors, where these are meaningful.
    pub fn quantities(&self) -> Option<&Quantities> {
        let of_bands = self.bands.as_ref().map(|bands| &bands.quantities);
        of_bands.or(self.of_many.as_ref())
    }

    /// Errors of the estimates, for the summaries of the functions.
    pub fn errors(&self) -> EstimateErrors<'_> {
        EstimateErrors {
            bands: self.bands.as_ref(),
            classifications: &self.classifications,
            effective_parameters: self.effective_parameters.as_deref(),
            tests_constants: !self.plausibility.is_coloured,
        }
    }
}

fn is_constant(function: &CoefficientFunction) -> bool {
    function.parameters() < 2
}

/// Cause of residuals that the model does not explain: the width of friction or, with `judges_candidates`, what an input or the model lacks.
fn cause(
    problem: &Problem,
    fit: &Fit,
    plausibility: &Plausibility,
    judges_candidates: bool,
    candidates: Option<&Candidates>,
) -> Option<Doubt> {
    let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
    let is_system = plausibility.unidentified.is_none();
    // A width of friction on which estimates depend leaves residuals like those of a missing term.
    let width = is_system.then(|| width_warning(problem, theta, evaluation));
    if let Some(width) = width.flatten() {
        return Some(width);
    }
    judges_candidates.then_some(())?;
    let best = candidates.and_then(Candidates::preferred);
    let jump = || {
        let found = connected_jump(problem, theta, evaluation).filter(|_| is_system);
        found.map(Doubt::RecordError)
    };
    let large = || large_error(problem, theta, evaluation).map(Doubt::RecordError);
    let lacking = || {
        let best = best?;
        if let Some(e) = best.disturbed_experiment() {
            let is_new = is_system && !plausibility.is_disturbed;
            let found = is_new.then(|| Disturbance::of(problem, evaluation, e))??;
            return Some(input_disturbance::doubt(&found));
        }
        match (best.input_pulses(), problem.experiments.first()) {
            (Some((count, time, error)), Some(experiment)) => {
                let found = RecordError::InputPulses {
                    experiment: experiment.name.clone(),
                    count,
                    time,
                    error,
                };
                is_system.then(|| Doubt::RecordError(or_jump(problem, found)))
            }
            _ => Some(Doubt::Preferred {
                candidates: candidates?.ties(),
            }),
        }
    };
    jump().or_else(large).or_else(lacking)
}
