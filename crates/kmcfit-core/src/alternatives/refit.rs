//! Refits of a changed problem, and the test whether they explain the residuals.

use crate::objective::{Evaluation, channel_fit_percent, diagnostics};
use crate::problem::Problem;
use crate::record::{Channel, Experiment, NoiseEstimate};
use crate::simd::sum::rms;
use crate::solvers::{Fit, FitSettings, Stopping, fit_from};

/// NRMSE fit, per cent, below which a fit does not explain the record.
pub const POOR: f64 = 90.0;
/// Smallest p-value of the test of whiteness of residuals that a change explains.
const WHITE: f64 = 1e-3;
/// Ratio of the residuals with and without an error below which it explains them although they are not white.
pub(crate) const EXPLAINED: f64 = 0.5;

/// Iteration limit of a refit. Those that explain the residuals of the tests' records take at most 23; others approach a poor minimum in
/// a thousand small steps.
const ITERATIONS: u64 = 100;

/// A fit of a changed problem.
pub(crate) struct Refit {
    pub problem: Problem,
    pub fit: Fit,
}

impl Refit {
    pub(crate) fn of(problem: Problem, start: &[f64]) -> Option<Self> {
        Self::within(ITERATIONS, problem, start)
    }

    /// The fit in at most so many iterations.
    pub(crate) fn within(iterations: u64, problem: Problem, start: &[f64]) -> Option<Self> {
        let settings = FitSettings {
            stopping: Stopping {
                iterations,
                ..Stopping::default()
            },
            ..FitSettings::default()
        };
        let fit = fit_from(&problem, start, &settings).ok()?;
        Some(Self { problem, fit })
    }

    pub(crate) fn evaluation(&self) -> &Evaluation {
        &self.fit.best.evaluation
    }

    /// True if the residuals of all channels are white.
    pub(crate) fn is_white(&self) -> bool {
        is_white(&self.problem, self.evaluation())
    }

    /// Largest root mean square of the residuals of a channel relative to its samples.
    pub(crate) fn worst_misfit(&self) -> f64 {
        worst_misfit(&self.problem, self.evaluation())
    }

    /// True if the residuals are white, or small beside those of `before` where the fit is good.
    pub(crate) fn explains(&self, problem: &Problem, before: &Evaluation) -> bool {
        let is_smaller = self.worst_misfit() < EXPLAINED * worst_misfit(problem, before);
        is_smaller && (self.is_white() || worst_fit(&self.problem, self.evaluation()) >= POOR)
    }
}

/// True if the residuals of all channels are white.
pub(crate) fn is_white(problem: &Problem, evaluation: &Evaluation) -> bool {
    let mut each = problem.predicted(evaluation);
    each.all(|(channel, predicted)| diagnostics(channel, predicted).whiteness.p_value >= WHITE)
}

/// Fit of the worst channel, per cent.
pub(crate) fn worst_fit(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let fits = (problem.predicted(evaluation))
        .map(|(channel, predicted)| channel_fit_percent(channel, predicted));
    fits.fold(100.0, f64::min)
}

/// Largest root mean square of the residuals of a channel relative to its samples.
pub(crate) fn worst_misfit(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let each = problem.predicted(evaluation).map(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        rms(&residuals) / rms(channel.observed())
    });
    each.fold(0.0, f64::max)
}

/// The problem with white noise for all channels, beside the stated errors of an input.
pub(crate) fn uncorrelated(problem: &Problem) -> Problem {
    let mut white = problem.clone();
    without_correlation(&mut white.parts_mut().experiments);
    white
}

/// Sets white noise for all channels, beside the stated errors of an input.
pub(crate) fn without_correlation(experiments: &mut [Experiment]) {
    let is_stated = |c: &Channel| (c.correlation()).is_some_and(|c| c.input_errors().is_some());
    let channels = experiments.iter_mut().flat_map(|e| &mut e.channels);
    for channel in channels.filter(|c| !is_stated(c)) {
        *channel = channel.clone().with_noise(NoiseEstimate::default());
    }
}
