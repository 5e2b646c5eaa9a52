//! Assessment of a fit: statistics of the residuals, step-size check, plausibility, standard errors and bands.

mod assumptions;
mod channel;
mod classical;
mod constants;
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
mod median_frequency;
mod minimum;
mod model_tests;
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
mod score_tests;
mod second_mode;
mod span;
mod statistics;
mod step_check;
mod variation;
mod verdict;
mod warning;

pub use crate::objective::{all_diagnostics, outliers};
pub use assumptions::{VerdictAssumption, verdict_assumptions};
pub use channel::{ResidualPattern, pattern};
pub use classical::{ClassicalEstimate, ClassicalMethod};
pub use constants::{constant_probability, standard_error};
pub use equation_error::{EquationErrorIntervals, NoIntervals};
pub use estimates::{Estimate, EstimateStatus, estimates};
pub use function::{EstimateErrors, FunctionSummary, function_summaries};
pub use implausible::Implausible;
pub use large_covariance::LargeCovariance;
pub use model_tests::{BasisComparison, Extension, ExtensionTest, ModelTests};
pub use plausibility::{BEYOND_SIGMA, EXACT, POOR, Plausibility, Unidentified};
pub use record_error::RecordError;
pub use recovery::{RECOVERY_TOLERANCE, TruthErrors};
pub use refinement::{BasisTest, CoarseBasis};
pub use rivals::AmplitudeRival;
pub use statistics::{FitStatistics, statistics};
pub use step_check::{StepCheck, StepCheckOutcome};
pub use verdict::{SampleFault, VerdictLevel, VerdictReason, verdict_level, verdict_reasons};
pub use warning::FitWarning;

use classical::classical_estimate;
use friction_width::width_warning;
use input_jumps::{connected_jump, or_jump};
use input_pulses::input_pulses;
use interpolation_loss::interpolation_losses;
use record_errors::large_error;
use rivals::amplitude_rival;
use score_tests::{ScoreTests, missing};
use second_mode::{second_modes, second_modes_in_place};
use variation::variation_warnings;

use crate::functions::CoefficientFunction;
use crate::identifiability::{
    Bands, FunctionClassification, Means, classify_functions, condition_on_bases,
    condition_on_inputs, condition_on_time,
};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::solvers::{Fit, Status};
use crate::threads::{analyses_at_once, both};
use nalgebra::DMatrix;

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
    /// Covariance of the parameters, where standard errors are meaningful.
    pub covariance: Option<DMatrix<f64>>,
    /// Degrees of freedom of the estimate of each parameter ([`Problem::degrees_of_freedom`]).
    pub degrees_of_freedom: Vec<f64>,
    /// Effective number of parameters of the function of each penalty ([`Problem::effective_parameters`]), where there are penalties.
    pub effective_parameters: Option<Vec<f64>>,
    /// Bands of functions and ratios, where standard errors are meaningful.
    pub bands: Option<Bands>,
    /// Covariance of the estimates with more than 64 parameters, where standard errors are meaningful.
    pub large_covariance: Option<LargeCovariance>,
    /// Classification of functions and ratios by their bands.
    pub classifications: Vec<FunctionClassification>,
    /// Natural frequency and damping ratio by a classical method, where a record allows it.
    pub classical: Option<ClassicalEstimate>,
    /// Tests against larger models.
    pub model_tests: ModelTests,
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
        let plausibility = || {
            let halved = problem.on_half_step(&best.evaluation);
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
            (has_causes && tests_bases).then(at).flatten()
        };
        let ((halved, step_check, statistics, mut plausibility), score_tests) =
            at_once(problem, plausibility, score_tests);
        if fit.outcome.status == Status::Failed {
            plausibility.fail();
        }
        let mut assessment = Self {
            step_check,
            statistics,
            plausibility,
            covariance: None,
            effective_parameters: None,
            degrees_of_freedom: vec![f64::INFINITY; problem.parameters()],
            bands: None,
            large_covariance: None,
            classifications: Vec::new(),
            classical: None,
            model_tests: ModelTests {
                t_limit: score_tests::SIGNIFICANT,
                p_limit: refinement::LEVEL,
                ..ModelTests::default()
            },
        };
        if has_causes {
            let (plausibility, tests) = (&assessment.plausibility, score_tests.as_ref());
            let (causes, tests) = causes(problem, fit, plausibility, tests_bases, tests);
            assessment.plausibility.warnings.extend(causes);
            assessment.model_tests.extensions = tests;
        }
        // Its Jacobian is as large as those that follow.
        drop(score_tests);
        if reports_errors && assessment.plausibility.errors_hold {
            let (theta, evaluation) = (&best.parameters, &best.evaluation);
            let is_coloured = assessment.plausibility.is_coloured;
            let (bands, test) = at_once(
                problem,
                || Bands::beside(problem, theta, evaluation, halved.ok().flatten()),
                || match tests_bases && !is_coloured {
                    true => BasisTest::of(problem, theta, evaluation),
                    false => BasisTest::default(),
                },
            );
            assessment.classifications = classify_functions(problem, &best.evaluation, &bands);
            let is_white = !is_coloured && !assessment.plausibility.is_disturbed;
            let losses = match is_one {
                true => interpolation_losses(problem, theta, evaluation, is_white),
                false => Vec::new(),
            };
            assessment.plausibility.warnings.extend(losses);
            let may_vary = may_vary(&assessment.plausibility);
            if may_vary {
                condition_on_bases(problem, &mut assessment.classifications, &test.doubtful);
            }
            if !test.comparisons.is_empty() {
                assessment.model_tests.p_limit = test.level;
                assessment.model_tests.bases = test.comparisons;
            }
            if assessment.plausibility.is_disturbed {
                condition_on_inputs(&mut assessment.classifications);
            }
            if !problem.penalties.is_empty() {
                assessment.effective_parameters = problem.effective_parameters(theta, evaluation);
            }
            let effective = assessment.effective_parameters.as_deref();
            let covariance = bands.covariance.as_ref().filter(|_| tests_bases);
            let rival = || amplitude_rival(problem, theta, evaluation, covariance, effective);
            let rival = is_one.then(rival).flatten();
            if let Some(rival) = rival {
                condition_on_time(problem, &mut assessment.classifications, &rival.indices);
                (assessment.plausibility.warnings).push(FitWarning::TimeOrAmplitude(rival));
            }
            let coarse = test.coarse.into_iter().filter(|_| may_vary);
            let warnings = coarse.map(FitWarning::CoarseBasis);
            assessment.plausibility.warnings.extend(warnings);
            assessment
                .degrees_of_freedom
                .clone_from(&bands.degrees_of_freedom);
            assessment.covariance = bands.covariance.clone();
            assessment.bands = Some(bands);
        } else if !few
            && assessment.plausibility.errors_hold
            && !assessment.plausibility.is_coloured
        {
            assessment.large_covariance =
                LargeCovariance::of(problem, &best.parameters, &best.evaluation);
        }
        if is_one && fit.outcome.status != Status::Failed {
            let (bands, effective) = (
                assessment.bands.as_ref(),
                assessment.effective_parameters.as_deref(),
            );
            let varying = variation_warnings(problem, &best.evaluation, bands, effective);
            assessment.plausibility.warnings.extend(varying);
            assessment.classical =
                classical_estimate(problem, &best.evaluation, assessment.bands.as_ref());
        }
        let disagrees = assessment.classical.iter().filter(|c| !c.agrees).cloned();
        let disagrees = disagrees.map(FitWarning::ClassicalDisagrees);
        assessment.plausibility.warnings.extend(disagrees);
        assessment
    }

    /// Means over the record with their standard errors, where these are meaningful.
    pub fn means(&self) -> Option<Means<'_>> {
        let of_bands = self.bands.as_ref().map(Bands::means);
        let large = self.large_covariance.as_ref();
        of_bands.or_else(|| large.map(LargeCovariance::means))
    }

    /// Errors of the estimates, for the summaries of the functions.
    pub fn errors(&self) -> EstimateErrors<'_> {
        EstimateErrors {
            covariance: self.covariance.as_ref(),
            degrees_of_freedom: &self.degrees_of_freedom,
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
    let explains = |warning: &FitWarning| {
        matches!(
            warning,
            FitWarning::DisturbedInput { .. }
                | FitWarning::ContradictedInputSigma { .. }
                | FitWarning::InterpolationLoss { .. }
                | FitWarning::CoherentResiduals { .. }
                | FitWarning::MissingTerm(_)
                | FitWarning::SecondMode { .. }
                | FitWarning::ResidualMean { .. }
                | FitWarning::FrictionWidth { .. }
                | FitWarning::RecordError(_)
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
) -> (Vec<FitWarning>, Vec<ExtensionTest>) {
    let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
    let is_noise = plausibility.errors_hold && !plausibility.is_coloured;
    let is_modelled = is_noise && !plausibility.is_disturbed;
    let is_system = plausibility.unidentified.is_none();
    // A width of friction on which estimates depend leaves residuals like those of a missing term.
    let width = is_system.then(|| width_warning(problem, theta, evaluation));
    let large = || large_error(problem, theta, evaluation).map(FitWarning::RecordError);
    let pulses = || {
        let found = input_pulses(problem, theta, evaluation).filter(|_| is_system)?;
        Some(FitWarning::RecordError(or_jump(problem, found)))
    };
    let jump = || {
        let found = connected_jump(problem, theta, evaluation).filter(|_| is_system);
        found.map(FitWarning::RecordError)
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
