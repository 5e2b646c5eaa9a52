//! Assessment of a fit: statistics of the residuals, step-size check, plausibility, standard errors and bands.

mod assumptions;
mod channel;
mod classical;
mod constants;
mod doubt;
mod equation_error;
mod estimates;
mod extension;
mod friction_width;
mod function;
mod implausible;
mod input_correlation;
mod input_disturbance;
mod input_jumps;
mod input_pulses;
mod interpolation_loss;
mod large_covariance;
mod larger_models;
mod median_frequency;
mod minimum;
mod parts;
mod plausibility;
mod record_error;
mod record_errors;
mod record_parameters;
mod recovery;
mod refinement;
mod refit;
mod residual_mean;
mod rival_screen;
mod rivals;
mod score_statistics;
mod second_mode;
mod sentences;
mod span;
mod statistics;
mod step_check;
mod variation;
mod verdict;

pub use assumptions::verdict_assumptions;
pub use channel::{ResidualPattern, pattern};
pub use classical::{ClassicalEstimate, ClassicalMethod};
pub(crate) use constants::constant_probability;
pub use doubt::{Doubt, Unidentified};
pub use equation_error::{EquationErrorIntervals, NoIntervals};
pub use estimates::{Estimate, EstimateStatus, estimates};
pub use function::{EstimateErrors, FunctionSummary, function_summaries};
pub use implausible::Implausible;
pub use large_covariance::quantities_of_many;
pub use larger_models::{BasisComparison, Extension, ExtensionTest, ModelTests};
pub use parts::Parts;
pub use plausibility::{BEYOND_SIGMA, EXACT, POOR, Plausibility};
pub use record_error::RecordError;
pub use recovery::TruthErrors;
pub use refinement::{BasisTest, CoarseBasis};
pub use rivals::AmplitudeRival;
pub use statistics::FitStatistics;
pub(crate) use statistics::statistics;
pub use step_check::StepCheck;
pub(crate) use step_check::StepCheckOutcome;
pub use verdict::{VerdictLevel, verdict_reasons};

pub(crate) use extension::{extended, with_functions};
pub(crate) use interpolation_loss::with_cubic_inputs;
pub(crate) use minimum::Minimum;
pub use record_parameters::RecordParameter;
pub(crate) use record_parameters::{RecordColumns, record_parameters};
pub(crate) use refinement::{applies, finer_basis};
pub(crate) use refit::{Refit, uncorrelated};
pub(crate) use span::{Span, weighted_residuals};

use classical::classical_estimate;
use friction_width::width_warning;
use input_jumps::{connected_jump, or_jump};
use input_pulses::input_pulses;
use interpolation_loss::{interpolation_losses, is_loss};
use record_errors::large_error;
use rivals::amplitude_rival;
use score_statistics::{ScoreTests, missing};
use second_mode::{second_modes, second_modes_in_place};
use variation::variation_warnings;

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
    /// Tests against larger models.
    pub model_tests: ModelTests,
    /// Parts that a request to end left out.
    pub not_done: Vec<&'static str>,
}

impl FitAssessment {
    /// Assesses `fit`; covariance, bands and classifications for up to 64 parameters, and with `tests_bases` the test of the bases
    /// against finer ones.
    pub fn of(problem: &Problem, fit: &Fit, tests_bases: bool) -> Self {
        let best = &fit.best;
        let few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let reports_errors = few && problem.sample_count() > problem.parameters();
        // Causes and classical estimates are those of one coordinate.
        let is_one = problem.system.structure.is_one();
        let has_causes = reports_errors && is_one && fit.outcome.status != Status::Failed;
        let mut parts = Parts::default();
        let plausibility = |parts: &mut Parts| {
            let halved = parts.part("step-size check", || problem.on_half_step(&best.evaluation));
            let halved = halved.unwrap_or(Ok(None));
            let check = |refined| StepCheck::of(problem, &best.evaluation, refined);
            let step_check: StepCheckOutcome = match &halved {
                Ok(refined) => Ok(refined.as_ref().map(check)),
                Err(error) => Err(*error),
            };
            let statistics = statistics(problem, &best.evaluation);
            let plausibility =
                Plausibility::of(problem, &best.evaluation, &step_check, reports_errors);
            (halved, step_check, statistics, plausibility)
        };
        let score_tests = || {
            let at = || ScoreTests::at(problem, &best.parameters, &best.evaluation);
            let applies = has_causes && tests_bases && !is_stopped();
            applies.then(at).flatten()
        };
        let ((halved, step_check, statistics, mut plausibility), score_tests) =
            at_once(problem, || plausibility(&mut parts), score_tests);
        if fit.outcome.status == Status::Failed {
            plausibility.fail();
        }
        let mut assessment = Self {
            step_check,
            statistics,
            plausibility,
            effective_parameters: None,
            bands: None,
            of_many: None,
            classifications: Vec::new(),
            classical: None,
            model_tests: ModelTests {
                t_limit: score_statistics::SIGNIFICANT,
                p_limit: refinement::LEVEL,
                ..ModelTests::default()
            },
            not_done: Vec::new(),
        };
        if has_causes {
            let (plausibility, tests) = (&assessment.plausibility, score_tests.as_ref());
            let found = parts.part("tests of what the model lacks", || {
                causes(problem, fit, plausibility, tests_bases, tests)
            });
            let (causes, tests) = found.unwrap_or_default();
            assessment.plausibility.warnings.extend(causes);
            assessment.model_tests.extensions = tests;
        }
        // Its Jacobian is as large as those that follow.
        drop(score_tests);
        if reports_errors && assessment.plausibility.errors_hold {
            let halved = halved.ok().flatten();
            assessment.add_errors(problem, fit, tests_bases, halved, &mut parts);
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

    /// Adds covariance, bands and classifications, and with `tests_bases` the test of the bases against finer ones.
    fn add_errors(
        &mut self,
        problem: &Problem,
        fit: &Fit,
        tests_bases: bool,
        halved: Option<Refined>,
        parts: &mut Parts,
    ) {
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        let is_one = problem.system.structure.is_one();
        let is_coloured = self.plausibility.is_coloured;
        let found = parts.part("confidence intervals", || {
            at_once(
                problem,
                || Bands::beside(problem, theta, evaluation, halved),
                || match tests_bases && !is_coloured {
                    true => BasisTest::of(problem, theta, evaluation),
                    false => BasisTest::default(),
                },
            )
        });
        let Some((bands, test)) = found else {
            return;
        };
        self.classifications = classify_functions(problem, evaluation, &bands);
        let is_white = !is_coloured && !self.plausibility.is_disturbed;
        if is_one {
            let losses = parts.part("loss by interpolation", || {
                interpolation_losses(problem, theta, evaluation, is_white)
            });
            let losses = losses.unwrap_or_default();
            let warnings = &mut self.plausibility.warnings;
            warnings.retain(|warning| !is_loss(problem, &losses, warning));
            warnings.extend(losses);
        }
        let may_vary = may_vary(&self.plausibility);
        if may_vary {
            condition_on_bases(problem, &mut self.classifications, &test.doubtful);
        }
        if !test.comparisons.is_empty() {
            self.model_tests.p_limit = test.level;
            self.model_tests.bases = test.comparisons;
        }
        if self.plausibility.is_disturbed {
            condition_on_inputs(&mut self.classifications);
        }
        if !problem.penalties.is_empty() {
            self.effective_parameters = problem.effective_parameters(theta, evaluation);
        }
        let effective = self.effective_parameters.as_deref();
        let covariance = bands.covariance.as_ref().filter(|_| tests_bases);
        let rival = || amplitude_rival(problem, theta, evaluation, covariance, effective);
        let rival = is_one.then(|| parts.part("time or amplitude", rival));
        if let Some(rival) = rival.flatten().flatten() {
            condition_on_time(problem, &mut self.classifications, &rival.indices);
            (self.plausibility.warnings).push(Doubt::TimeOrAmplitude(rival));
        }
        let coarse = test.coarse.into_iter().filter(|_| may_vary);
        let warnings = coarse.map(Doubt::CoarseBasis);
        self.plausibility.warnings.extend(warnings);
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

/// True where a finer basis that fits better may mean that a coefficient varies: no other test explains the residuals. Correlated residuals are
/// not tested: what leaves them also makes constants seem to vary.
fn may_vary(plausibility: &Plausibility) -> bool {
    let explains = |warning: &Doubt| {
        matches!(
            warning,
            Doubt::DisturbedInput { .. }
                | Doubt::ContradictedInputSigma { .. }
                | Doubt::InterpolationLoss { .. }
                | Doubt::CoherentResiduals { .. }
                | Doubt::MissingTerm(_)
                | Doubt::SecondMode { .. }
                | Doubt::ResidualMean { .. }
                | Doubt::FrictionWidth { .. }
                | Doubt::RecordError(_)
        )
    };
    !plausibility.warnings.iter().any(explains)
}

/// Causes of residuals that the model does not explain: the width of friction and, with `tests` of larger models, a missing term, an error of a
/// record, or a second mode; and the score tests of terms and errors of the records, where they apply.
fn causes(
    problem: &Problem,
    fit: &Fit,
    plausibility: &Plausibility,
    tests: bool,
    score_tests: Option<&ScoreTests<'_>>,
) -> (Vec<Doubt>, Vec<ExtensionTest>) {
    let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
    let is_noise = plausibility.errors_hold && !plausibility.is_coloured;
    let is_modelled = is_noise && !plausibility.is_disturbed;
    let is_system = plausibility.unidentified.is_none();
    // A width of friction on which estimates depend leaves residuals like those of a missing term.
    let width = is_system.then(|| width_warning(problem, theta, evaluation));
    let large = || large_error(problem, theta, evaluation).map(Doubt::RecordError);
    let pulses = || {
        let found = input_pulses(problem, theta, evaluation).filter(|_| is_system)?;
        Some(Doubt::RecordError(or_jump(problem, found)))
    };
    let jump = || {
        let found = connected_jump(problem, theta, evaluation).filter(|_| is_system);
        found.map(Doubt::RecordError)
    };
    match (width.flatten(), tests) {
        (Some(width), _) => (vec![width], Vec::new()),
        (None, false) => Default::default(),
        (None, true) => {
            let (small, tests) = match is_system {
                true => missing(problem, theta, evaluation, score_tests, is_modelled),
                false => Default::default(),
            };
            let found = match jump().or(small).or_else(large).or_else(pulses) {
                Some(cause) => vec![cause],
                None => match problem.functions.iter().all(is_constant) {
                    true => second_modes(problem, evaluation, &plausibility.residuals),
                    false => second_modes_in_place(problem, theta, evaluation),
                },
            };
            (found, tests)
        }
    }
}
