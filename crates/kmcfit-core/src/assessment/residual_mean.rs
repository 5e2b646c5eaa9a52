//! Mean of the residuals of a channel, left by an offset of its sensor or by a static force that the model does not have.
//!
//! The mean `r` of `n` residuals `e_i` has the standard error of dependent samples,
//!
//! ```text
//! se = sqrt(S) / n,    t = r / se
//! ```
//!
//! with the [kernel covariance](KernelCovariance) `S` of the sum of `e_i - r`. The noise model of the fit gives no error here, because an
//! autoregressive process takes up the mean itself.

use super::Doubt;
use crate::diagnostics::{outlier_indices, standard_deviation};
use crate::functions::CoefficientKind;
use crate::noise::KernelCovariance;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Channel, ChannelKind};
use nalgebra::DMatrix;

/// Smallest `|t|` of a mean that is no noise.
const SIGNIFICANT: f64 = 4.0;
/// Smallest mean, in standard deviations of the residuals, that shifts an estimate noticeably.
const NOTICEABLE: f64 = 0.05;
/// Residuals below this share of the largest sample are rounding errors.
const ROUNDING: f64 = 1e-6;
/// Fewest residuals.
const FEWEST: usize = 50;

/// Warnings about channels with a sigma whose sensor offset is not estimated.
pub(super) fn mean_warnings(problem: &Problem, evaluation: &Evaluation) -> Vec<Doubt> {
    let mut warnings = Vec::new();
    for (experiment, predictions) in problem.experiments.iter().zip(&evaluation.predictions) {
        let set = problem
            .functions
            .coefficient_set(experiment.coefficient_set);
        let mut functions = set.iter().map(|f| problem.functions.get(*f));
        let has_force =
            functions.any(|f| f.quantity == CoefficientKind::STATIC_FORCE && f.parameters() > 0);
        for (channel, predicted) in experiment.channels.iter().zip(predictions) {
            let is_open = channel.sensor().offset.index().is_none();
            if !(is_open && channel.weighting().is_sigma() && channel.filter().is_empty()) {
                continue;
            }
            if let Some([mean, t, share]) = mean_of(channel, predicted) {
                warnings.push(Doubt::ResidualMean {
                    experiment: experiment.name.clone(),
                    channel: channel.kind().name().to_owned(),
                    mean,
                    t,
                    share,
                    or_static_force: channel.kind() == ChannelKind::Displacement && !has_force,
                });
            }
        }
    }
    warnings
}

/// Mean of samples less predictions, the same over its standard error, and over the standard deviation of the residuals; `None`
/// where it is not noticeable or may be noise. Outliers are left out.
fn mean_of(channel: &Channel, predicted: &[f64]) -> Option<[f64; 3]> {
    let mut errors: Vec<f64> = (channel.observed().iter().zip(predicted))
        .map(|(observed, predicted)| observed - predicted)
        .collect();
    let largest = |values: &[f64]| values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if largest(&errors) <= ROUNDING * largest(channel.observed()) {
        return None;
    }
    let outliers = outlier_indices(&errors);
    let mut position = 0..;
    errors.retain(|_| {
        position
            .next()
            .is_some_and(|i| outliers.binary_search(&i).is_err())
    });
    let count = errors.len();
    if count < FEWEST {
        return None;
    }
    let mean = errors.iter().sum::<f64>() / count as f64;
    let share = mean / standard_deviation(&errors);
    errors.iter_mut().for_each(|e| *e -= mean);
    let scores = DMatrix::from_vec(count, 1, errors);
    let record = 0..count;
    let covariance = KernelCovariance::of(&scores, std::slice::from_ref(&record), 1.0)?;
    let t = mean * count as f64 / covariance.sum[(0, 0)].max(0.0).sqrt();
    let is_clear = t.abs() >= SIGNIFICANT && share.abs() >= NOTICEABLE;
    (is_clear && share.is_finite() && t.is_finite()).then_some([mean, t, share])
}
