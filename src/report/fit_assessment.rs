//! Assessment of a fit and of the validation records: statistics, step-size check, bands, predictions.

use super::channel_view::ChannelView;
use crate::config::{HoldOut, Model};
use kmcfit_core::assessment::{
    Doubt, EquationErrorIntervals, EstimateErrors, FitAssessment, NoIntervals, POOR, Parts,
    StepCheck,
};
use kmcfit_core::diagnostics::ResidualDiagnostics;
use kmcfit_core::identifiability::{Bands, Quantities};
use kmcfit_core::objective::{Evaluation, all_diagnostics};
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{
    EquationBalance, Fit, MissingTerm, Solver, Status, equation_balance, missing_terms,
    predict_validation,
};
use kmcfit_core::step::SimulationError;

/// Assessment of a fit, computed once for all its documents.
#[derive(Debug, Clone)]
pub struct RunAssessment {
    /// `None` for the equation error, which simulates no response.
    pub(super) assessment: Option<FitAssessment>,
    /// Intervals of a fit of the equation error, or the reason why there are none; `None` for other fits, and without parameters.
    pub(super) equation: Option<Result<EquationErrorIntervals, NoIntervals>>,
    /// True where an unmeasured force acts, so that a free response or the equation error does not determine the damping.
    pub(super) lacks_force: bool,
    /// Terms missing from the equation of motion, by its error; none for other fits.
    pub(super) missing_terms: Vec<MissingTerm>,
    /// Residual of the equation of motion beside its forces, by its error; `None` for other fits, and without a minimum.
    pub(super) balance: Option<EquationBalance>,
    /// Validation records.
    pub(super) validation: Vec<ValidationRecord>,
    /// Diagnostics of the residuals of each channel of each experiment.
    pub(super) diagnostics: Vec<Vec<ResidualDiagnostics>>,
    /// Parts that a request to end left out.
    pub(crate) not_done: Vec<&'static str>,
}

impl RunAssessment {
    /// Assesses a fit.
    pub fn of(model: &Model, fit: &Fit) -> Self {
        let is_simulated = model.settings.solver != Solver::EquationError;
        let validation = model.validation.iter();
        let assessment =
            is_simulated.then(|| FitAssessment::of(&model.problem, fit, model.tests_bases));
        let diagnostics = match &assessment {
            Some(assessment) => assessment.plausibility.residuals.clone(),
            None => all_diagnostics(&model.problem, &fit.best.evaluation),
        };
        let mut parts = Parts {
            not_done: (assessment.as_ref()).map_or_else(Vec::new, |a| a.not_done.clone()),
        };
        let intervals = || EquationErrorIntervals::of(&model.problem, fit);
        let equation = (!is_simulated && model.problem.parameters() > 0)
            .then(|| parts.part("confidence intervals", intervals))
            .flatten();
        let is_poor = |d: &ResidualDiagnostics| d.fit_percent < POOR;
        let lacks_force = match &equation {
            Some(equation) => matches!(equation, Err(NoIntervals::UnmeasuredForce)),
            None => model.is_kept_up() && diagnostics.iter().flatten().all(is_poor),
        };
        let terms = || missing_terms(&model.problem, &fit.best.parameters);
        let terms = (!is_simulated).then(|| parts.part("tests of what the model lacks", terms));
        let has_balance = !is_simulated && fit.outcome.status != Status::Failed;
        let balance = || equation_balance(&model.problem, &fit.best.parameters);
        let balance = has_balance.then(|| parts.part("balance of the equation", balance));
        let validation = validation.filter_map(|out| {
            parts.part("a validation record", || {
                ValidationRecord::of(model, fit, out)
            })
        });
        Self {
            assessment,
            lacks_force,
            equation,
            missing_terms: terms.flatten().unwrap_or_default(),
            balance: balance.flatten().flatten(),
            validation: validation.collect(),
            diagnostics,
            not_done: parts.not_done,
        }
    }

    /// Means over the record and scalars with their standard errors, where these are meaningful.
    pub(super) fn quantities(&self) -> Option<&Quantities> {
        match &self.assessment {
            Some(assessment) => assessment.quantities(),
            None => self.bands().map(|bands| &bands.quantities),
        }
    }

    /// Bands of functions and ratios, if standard errors are meaningful.
    pub(super) fn bands(&self) -> Option<&Bands> {
        match (&self.assessment, &self.equation) {
            (Some(assessment), _) => assessment.bands.as_ref(),
            (None, equation) => Some(&equation.as_ref()?.as_ref().ok()?.bands),
        }
    }

    /// Errors of the estimates.
    pub(super) fn errors(&self) -> Option<EstimateErrors<'_>> {
        match (&self.assessment, &self.equation) {
            (Some(assessment), _) => Some(assessment.errors()),
            (None, equation) => Some(equation.as_ref()?.as_ref().ok()?.errors()),
        }
    }

    /// The step-size check, if there is a response on the finer grid.
    pub(super) fn step_check(&self) -> Option<&StepCheck> {
        self.assessment.as_ref()?.step_check.as_ref().ok()?.as_ref()
    }
}

/// A validation record and its prediction by the fitted system.
#[derive(Debug, Clone)]
pub(super) struct ValidationRecord {
    /// The record.
    pub out: HoldOut,
    /// The problem of this record alone, with the functions fixed, and its evaluation at the optimum of the record's
    /// own parameters.
    pub found: Result<(Problem, Evaluation), SimulationError>,
    /// Diagnostics of the residuals of its channels; none without a response.
    diagnostics: Vec<ResidualDiagnostics>,
}

impl ValidationRecord {
    fn of(model: &Model, fit: &Fit, out: &HoldOut) -> Self {
        let found = predict_validation(
            &model.problem,
            &fit.best.evaluation,
            &out.experiment,
            &out.scalars,
            &model.settings,
        );
        let of_channels = found
            .as_ref()
            .map(|(problem, evaluation)| all_diagnostics(problem, evaluation));
        Self {
            out: out.clone(),
            diagnostics: of_channels.into_iter().flatten().flatten().collect(),
            found,
        }
    }

    /// The doubt where the fitted system does not predict it.
    pub fn poor(&self) -> Option<Doubt> {
        let channels = self.channels();
        let fits = channels.iter().map(|c| c.diagnostics.fit_percent);
        let fit_percent = fits.reduce(f64::min).filter(|worst| *worst < POOR)?;
        let experiment = self.out.experiment.name.clone();
        Some(Doubt::NotPredicted {
            experiment,
            fit_percent,
        })
    }

    /// Its channels in units for display; empty without a response.
    pub fn channels(&self) -> Vec<ChannelView<'_>> {
        let Ok((problem, evaluation)) = &self.found else {
            return Vec::new();
        };
        let predictions = evaluation.predictions.iter().flatten();
        let channels = problem.channels().zip(predictions).zip(&self.diagnostics);
        (channels.enumerate())
            .map(|(i, ((channel, predicted), diagnostics))| ChannelView {
                channel,
                predicted,
                note: self.out.notes.get(i),
                diagnostics,
            })
            .collect()
    }
}
