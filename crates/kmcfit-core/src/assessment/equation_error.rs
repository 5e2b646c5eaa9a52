//! Confidence intervals and classification of a fit of the equation error, from the kernel covariance of its scores.

use super::function::EstimateErrors;
use crate::functions::CoefficientKind;
use crate::identifiability::{
    Bands, FunctionClassification, classify_functions, condition_on_negligible_noise,
};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::Experiment;
use crate::solvers::{Fit, NoEquationRows, Status, equation_balance, equation_rows};

/// Reason why a fit of the equation error has no confidence intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoIntervals {
    /// More than [`FEW_PARAMETERS`] parameters.
    ManyParameters,
    /// More samples than a covariance is computed for.
    ManySamples,
    /// The common scale of mass, damping and stiffness is undetermined at every time.
    ScaleOverTime,
    /// The fit found no admissible minimum.
    NoMinimum,
    /// No input is measured, and a force larger than that of the damping acts ([`is_driven_unmeasured`]).
    UnmeasuredForce,
}

/// Residual of the equation of motion, relative to its largest force, below which it is noise or rounding.
const NOISE: f64 = 3e-3;

/// True where no record has a measured input, and the residual of the equation of motion exceeds the damping force: an unmeasured force keeps the
/// vibration up. In the mean its power is that of the damping, so that the least squares of the equation error put the damping at zero whatever
/// it is; the natural frequency is not changed.
fn is_driven_unmeasured(problem: &Problem, theta: &[f64]) -> bool {
    let mut measured = problem.experiments.iter().filter(|e| e.has_samples());
    if !measured.all(Experiment::is_free) {
        return false;
    }
    let Some(balance) = equation_balance(problem, theta) else {
        return false;
    };
    let of_damping = balance
        .parts
        .iter()
        .find(|p| p.part == CoefficientKind::DAMPING.name());
    let largest = balance.parts.iter().fold(0.0f64, |most, p| most.max(p.rms));
    of_damping.is_some_and(|damping| damping.residual_share > 1.0)
        && balance.residual_rms > NOISE * largest
}

/// Intervals of a fit of the equation error. All identified functions are conditional on negligible noise of the measured response.
#[derive(Debug, Clone)]
pub struct EquationErrorIntervals {
    /// Bands of functions and ratios.
    pub bands: Bands,
    /// Classification of functions and ratios by their bands.
    pub classifications: Vec<FunctionClassification>,
}

impl EquationErrorIntervals {
    /// Intervals at the minimum of the equation error.
    ///
    /// # Errors
    /// The reason why there are none.
    pub fn of(problem: &Problem, fit: &Fit) -> Result<Self, NoIntervals> {
        if matches!(fit.outcome.status, Status::Failed | Status::Infeasible) {
            return Err(NoIntervals::NoMinimum);
        }
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        if is_driven_unmeasured(problem, theta) {
            return Err(NoIntervals::UnmeasuredForce);
        }
        if problem.parameters() > FEW_PARAMETERS {
            return Err(NoIntervals::ManyParameters);
        }
        let rows = equation_rows(problem, theta).map_err(|reason| match reason {
            NoEquationRows::UnsupportedRecord => NoIntervals::NoMinimum,
            NoEquationRows::ManySamples => NoIntervals::ManySamples,
            NoEquationRows::ScaleOverTime => NoIntervals::ScaleOverTime,
        })?;
        let bands = Bands::of_equation_error(problem, theta, evaluation, &rows);
        let mut classifications = classify_functions(problem, evaluation, &bands);
        condition_on_negligible_noise(&mut classifications);
        Ok(Self {
            bands,
            classifications,
        })
    }

    /// Errors of the estimates, for the summaries of the functions.
    pub fn errors(&self) -> EstimateErrors<'_> {
        EstimateErrors {
            bands: Some(&self.bands),
            classifications: &self.classifications,
            effective_parameters: None,
            tests_constants: false,
        }
    }
}
