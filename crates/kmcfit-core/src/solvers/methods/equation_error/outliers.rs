//! Outliers of channels with a robust loss.

use super::robust::MAD_TO_SIGMA;
use crate::record::{Channel, Experiment, Loss};
use crate::signal::median;

/// Distance of an outlier from the median of itself and its neighbours, in robust standard deviations of these distances: one of a
/// normal distribution in two million.
const OUTLYING: f64 = 5.0;
/// Neighbours on either side of a sample in that median.
const NEIGHBOURS: usize = 2;

/// The experiment with outliers of channels with a robust loss replaced by the median of their neighbours. The smoothed state follows
/// from these samples; the residuals of the equation are those of the measured ones.
pub(super) fn without_outliers(experiment: &Experiment) -> Experiment {
    let of_channel = |channel: &Channel| match channel.loss() {
        Loss::Squares => channel.clone(),
        Loss::Huber { .. } | Loss::StudentT { .. } => {
            channel.clone().with_samples(cleaned(channel.observed()))
        }
    };
    Experiment {
        channels: experiment.channels.iter().map(of_channel).collect(),
        ..experiment.clone()
    }
}

/// Samples with each outlier replaced by the median of itself and its neighbours.
fn cleaned(samples: &[f64]) -> Vec<f64> {
    let medians: Vec<f64> = (0..samples.len())
        .map(|i| {
            let end = (i + NEIGHBOURS + 1).min(samples.len());
            median(&samples[i.saturating_sub(NEIGHBOURS)..end])
        })
        .collect();
    let distances = samples.iter().zip(&medians).map(|(y, m)| (y - m).abs());
    let limit = OUTLYING * MAD_TO_SIGMA * median(distances.collect::<Vec<f64>>());
    let pairs = samples.iter().zip(&medians);
    pairs
        .map(|(y, m)| if (y - m).abs() > limit { *m } else { *y })
        .collect()
}
