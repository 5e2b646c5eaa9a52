//! Confidence intervals and classification of a fit of the equation error, from the kernel covariance of its scores.

use super::function::EstimateErrors;
use crate::identifiability::{
    Bands, FunctionClassification, classify_functions, condition_on_negligible_noise,
};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::solvers::{Fit, NoEquationRows, Status, equation_rows};

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
        if problem.parameters() > FEW_PARAMETERS {
            return Err(NoIntervals::ManyParameters);
        }
        if matches!(fit.outcome.status, Status::Failed | Status::Infeasible) {
            return Err(NoIntervals::NoMinimum);
        }
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        let rows = equation_rows(problem, theta).map_err(|reason| match reason {
            NoEquationRows::UnsupportedRecord => NoIntervals::NoMinimum,
            NoEquationRows::ManySamples => NoIntervals::ManySamples,
            NoEquationRows::ScaleOverTime => NoIntervals::ScaleOverTime,
        })?;
        let bands = Bands::of_equation(problem, theta, evaluation, &rows);
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
            covariance: self.bands.covariance.as_ref(),
            degrees_of_freedom: &self.bands.degrees_of_freedom,
            classifications: &self.classifications,
            effective_parameters: None,
            tests_constants: false,
        }
    }
}
