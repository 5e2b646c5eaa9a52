//! Systematic patterns in the residuals of one channel.

use crate::diagnostics::{offset_and_drift, outlier_indices};
use crate::record::{Channel, Loss};
use crate::signal::{Spectrum, even_spacing};
use serde::{Deserialize, Serialize};

/// Residuals below this share of the largest sample are rounding errors.
const ROUNDING: f64 = 1e-6;
/// Relative bandwidth that contains half of the energy of a tone, and the smallest relative distance of its frequency from that
/// of the samples.
const NARROW: f64 = 0.15;
const APART: f64 = 0.25;
/// Largest relative distance from a multiple of a frequency.
const MULTIPLE: f64 = 0.1;
/// Smallest share of the sum of squares that makes a pattern dominant.
const HALF: f64 = 0.5;

/// A systematic pattern of residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResidualPattern {
    /// Single outliers ([`outlier_indices`]) under least squares.
    Outliers {
        /// Number of outliers.
        samples: usize,
        /// Time of the first, s.
        first: f64,
    },
    /// The mean contains more than half of the sum of squares.
    Offset,
    /// A straight line contains more than half of the sum of squares about the mean.
    Drift,
    /// Oscillation at a frequency away from that of the record.
    Tone {
        /// Frequency of the residuals, Hz.
        frequency: f64,
        /// Frequency of the record, Hz.
        beside: f64,
    },
}

/// Dominant pattern of a channel's residuals, which a robust loss, or an offset or drift of the sensor, may explain.
pub fn pattern(channel: &Channel, predicted: &[f64]) -> Option<ResidualPattern> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let largest =
        |values: &mut dyn Iterator<Item = &f64>| values.fold(0.0f64, |m, v| m.max(v.abs()));
    // Rounding errors may have any pattern.
    let missed = channel.observed().iter().zip(predicted).map(|(o, p)| o - p);
    let missed: Vec<f64> = missed.collect();
    if largest(&mut missed.iter()) <= ROUNDING * largest(&mut channel.observed().iter()) {
        return None;
    }
    let far = outlier_indices(&residuals);
    if let (Some(first), Loss::Squares) = (far.first(), channel.loss()) {
        return Some(ResidualPattern::Outliers {
            samples: far.len(),
            first: channel.times()[*first],
        });
    }
    let [offset, drift] = offset_and_drift(channel.times(), &residuals);
    match () {
        () if offset > HALF => Some(ResidualPattern::Offset),
        () if drift > HALF => Some(ResidualPattern::Drift),
        () => tone(channel, &residuals),
    }
}

/// Tone in equally spaced residuals: most of the energy is near one frequency that is neither that of the samples nor a multiple
/// of it, which a nonlinearity causes. `None` without a sigma, because residuals may then be those of an unfinished descent.
fn tone(channel: &Channel, residuals: &[f64]) -> Option<ResidualPattern> {
    channel.weighting().sigma(0)?;
    let spacing = even_spacing(channel.times())?;
    let own = Spectrum::of(residuals, spacing)?;
    let [low, high] = own.band(HALF);
    let frequency = own.dominant();
    (high - low <= NARROW * frequency.max(own.resolution())).then_some(())?;
    let beside = Spectrum::of(channel.observed(), spacing)?.dominant();
    let is_other = (frequency - beside).abs() > APART * beside;
    let is_multiple = [2.0, 3.0]
        .iter()
        .any(|n| (frequency - n * beside).abs() <= MULTIPLE * frequency);
    (is_other && !is_multiple && beside > 0.0 && frequency > 0.0)
        .then_some(ResidualPattern::Tone { frequency, beside })
}
