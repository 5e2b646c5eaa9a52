//! Diagnostics of the residuals of a channel, or of the innovations of its correlated noise.

use crate::diagnostics::{ResidualDiagnostics, ResidualRecord, fit_percent, outlier_indices};
use crate::noise::Correlation;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Channel, Loss};

/// Diagnostics of a channel's residuals; [`outliers`] count as missing. Autocorrelation and whiteness are those of the
/// innovations where the noise is correlated.
pub fn diagnostics(channel: &Channel, predicted: &[f64]) -> ResidualDiagnostics {
    let mut residuals = channel.innovations(predicted);
    let mut observed = channel.observed().to_vec();
    let missed: Vec<f64> = channel.residuals(predicted).collect();
    for i in outliers(channel, &missed) {
        residuals[i] = f64::NAN;
        observed[i] = f64::NAN;
    }
    ResidualDiagnostics::new(&ResidualRecord {
        times: channel.times(),
        residuals: &residuals,
        observed: &observed,
        model: predicted,
        fitted: channel.correlation().map_or(0, Correlation::order),
    })
}

/// [`diagnostics`] of each channel of each experiment.
pub fn all_diagnostics(
    problem: &Problem,
    evaluation: &Evaluation,
) -> Vec<Vec<ResidualDiagnostics>> {
    let experiments = problem.experiments.iter().zip(&evaluation.predictions);
    let each = experiments.map(|(experiment, predictions)| {
        let channels = experiment.channels.iter().zip(predictions);
        channels.map(|(channel, predicted)| diagnostics(channel, predicted))
    });
    each.map(Iterator::collect).collect()
}

/// Fit of a channel ([`fit_percent`]), per cent; [`outliers`] count as missing.
pub fn channel_fit_percent(channel: &Channel, predicted: &[f64]) -> f64 {
    if channel.loss() == Loss::Squares {
        return fit_percent(channel.observed(), predicted);
    }
    let mut observed = channel.observed().to_vec();
    let missed: Vec<f64> = channel.residuals(predicted).collect();
    for i in outliers(channel, &missed) {
        observed[i] = f64::NAN;
    }
    fit_percent(&observed, predicted)
}

/// Indices of outliers ([`outlier_indices`]) under a robust loss, which are excluded from the statistics of the fit. Empty under least
/// squares.
pub fn outliers(channel: &Channel, residuals: &[f64]) -> Vec<usize> {
    match channel.loss() {
        Loss::Squares => Vec::new(),
        _ => outlier_indices(residuals),
    }
}
