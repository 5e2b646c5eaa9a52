//! Fit quality in the result document: channels, nuisance parameters, validation records.

use super::channel_view::{ChannelView, whiteness};
use super::document::{ChannelSummary, IgnoredSummary, NoiseSummary, ValidationSummary};
use super::fit_assessment::ValidationRecord;
use kmcfit_core::assessment::pattern;
use kmcfit_core::identifiability::Quantities;
use kmcfit_core::noise::{Correlation, CorrelationLaw};
use kmcfit_core::objective::outliers;
use kmcfit_core::record::{Loss, Weighting};

/// One channel with its predictions, and the samples between the rows of its table.
pub fn channel(view: &ChannelView, samples_per_row: usize) -> ChannelSummary {
    let (channel, note, predicted) = (view.channel, view.note, view.predicted);
    let factor = view.factor();
    let diagnostics = view.diagnostics;
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    ChannelSummary {
        kind: channel.kind().name().into(),
        unit: view.unit().into(),
        samples: channel.len(),
        samples_per_row,
        ignored: note.map_or(Vec::new(), |n| {
            let ignored = n.ignored.iter().map(|(samples, reason)| IgnoredSummary {
                samples: *samples,
                reason: reason.clone(),
            });
            ignored.collect()
        }),
        outliers: outliers(channel, &residuals).len(),
        rms_residual: diagnostics.rms / factor,
        fit_percent: diagnostics.fit_percent,
        sigma: view.sigma(),
        sigma_estimated: matches!(channel.weighting(), Weighting::Estimated { .. }),
        noise: channel.correlation().map(noise),
        robust: channel.loss() != Loss::Squares,
        pattern: pattern(channel, predicted),
        cost: channel.cost(predicted),
        whiteness: whiteness(channel, &diagnostics.whiteness),
        whiteness_p_value: (diagnostics.whiteness.p_value.is_finite())
            .then_some(diagnostics.whiteness.p_value),
        autocorrelation_band: diagnostics.band,
        autocorrelation: diagnostics.autocorrelation.clone(),
    }
}

/// Correlation of the noise of a channel.
fn noise(correlation: &Correlation) -> NoiseSummary {
    match correlation.law() {
        CorrelationLaw::Autoregressive(process) => NoiseSummary {
            coefficients: process.coefficients().to_vec(),
            innovation_share: process.innovation_variance().sqrt(),
            correlation_time: None,
            input_errors: false,
        },
        CorrelationLaw::Exponential { time } => NoiseSummary {
            coefficients: Vec::new(),
            innovation_share: 1.0,
            correlation_time: Some(*time),
            input_errors: false,
        },
        CorrelationLaw::InputErrors(_) => NoiseSummary {
            coefficients: Vec::new(),
            innovation_share: 1.0,
            correlation_time: None,
            input_errors: true,
        },
    }
}

/// Summary of a validation record.
pub(super) fn validation(held: &ValidationRecord) -> ValidationSummary {
    let channels = held.channels();
    let summaries = channels.iter().map(|view| channel(view, 1));
    let mut summary = ValidationSummary {
        name: held.out.experiment.name.clone(),
        channels: summaries.collect(),
        nuisance_parameters: Vec::new(),
        failure: None,
    };
    match &held.found {
        Ok((problem, evaluation)) => {
            let covariance = problem.covariance(evaluation);
            let degrees = problem.degrees_of_freedom(evaluation);
            let scalars = Quantities::scalars_of(problem, &evaluation.scalars);
            let range = problem.functions.scalar_range();
            let each = scalars
                .into_iter()
                .zip(range)
                .map(|(scalar, j)| match &covariance {
                    Some(covariance) => scalar.with_covariance(covariance, degrees[j]),
                    None => scalar,
                });
            summary.nuisance_parameters = each.collect();
        }
        Err(breakdown) => summary.failure = Some(breakdown.to_string()),
    }
    summary
}
