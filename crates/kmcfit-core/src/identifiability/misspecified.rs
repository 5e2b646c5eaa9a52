//! Channels whose residuals are not white under their noise model.

use crate::problem::Problem;
use crate::record::ScoreCovariance;
use std::ops::Range;

/// Samples of the channels whose scores have the covariance of a kernel, in the order of all samples.
pub(super) fn kernels(problem: &Problem) -> Vec<Range<usize>> {
    let channels = problem.channels().zip(problem.channel_samples());
    let misspecified = channels.filter(|(channel, samples)| {
        channel.noise().scores == ScoreCovariance::Kernel && samples.len() > problem.parameters()
    });
    misspecified.map(|(_, samples)| samples).collect()
}
