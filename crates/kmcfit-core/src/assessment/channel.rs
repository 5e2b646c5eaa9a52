//! One channel of a fit: outliers, residual diagnostics, and patterns that are neither noise nor response.

use crate::diagnostics::{ResidualDiagnostics, ResidualRecord, far_off, offset_and_drift};
use crate::record::{Channel, Loss};
use crate::signal::{Spectrum, even_spacing};
use serde::{Deserialize, Serialize};

/// Residuals below this share of the largest sample are rounding.
const ROUNDING: f64 = 1e-6;
/// Half of the energy of a tone lies within this share of its frequency, which is further than that other share from
/// that of the samples.
const NARROW: f64 = 0.15;
const APART: f64 = 0.25;
/// A multiple of a frequency is met to within this share.
const MULTIPLE: f64 = 0.1;
/// A pattern that holds more than this share of the squares is the first thing to mend.
const HALF: f64 = 0.5;

/// A pattern of residuals that is neither noise nor response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResidualPattern {
    /// Single outliers ([`far_off`]) under least squares.
    #[serde(rename = "far-off")]
    Outliers {
        /// Number of outliers.
        samples: usize,
        /// Time of the first, s.
        first: f64,
    },
    /// The mean holds more than half of the sum of squares.
    Offset,
    /// A straight line holds more than half of the sum of squares about the mean.
    Drift,
    /// Oscillation at a frequency away from that of the record.
    Tone {
        /// Frequency of the residuals, Hz.
        frequency: f64,
        /// Frequency of the record, Hz.
        beside: f64,
    },
}

/// The pattern of a channel's residuals that a robust loss, or a sensor's offset or drift, may explain.
pub fn pattern(channel: &Channel, predicted: &[f64]) -> Option<ResidualPattern> {
    let residuals: Vec<f64> = channel.residuals(predicted).collect();
    let largest =
        |values: &mut dyn Iterator<Item = &f64>| values.fold(0.0f64, |m, v| m.max(v.abs()));
    // Rounding may have any pattern.
    let missed = channel.observed().iter().zip(predicted).map(|(o, p)| o - p);
    let missed: Vec<f64> = missed.collect();
    if largest(&mut missed.iter()) <= ROUNDING * largest(&mut channel.observed().iter()) {
        return None;
    }
    let far = far_off(&residuals);
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

/// The tone of residuals at equal distances, most of whose energy is near one frequency that is not the samples', nor
/// a multiple of it, which is the nonlinearity's. Without a sigma nothing says that residuals are more than what a descent
/// has left.
fn tone(channel: &Channel, residuals: &[f64]) -> Option<ResidualPattern> {
    channel.weighting().sigma(0)?;
    let spacing = even_spacing(channel.times())?;
    let [own, samples] = [residuals, channel.observed()].map(|x| Spectrum::of(x, spacing));
    let (own, beside) = (own?, samples?.dominant());
    let [low, high] = own.band(HALF);
    let frequency = own.dominant();
    let is_narrow = high - low <= NARROW * frequency.max(own.resolution());
    let is_other = (frequency - beside).abs() > APART * beside;
    let is_multiple = [2.0, 3.0]
        .iter()
        .any(|n| (frequency - n * beside).abs() <= MULTIPLE * frequency);
    (is_narrow && is_other && !is_multiple && beside > 0.0 && frequency > 0.0)
        .then_some(ResidualPattern::Tone { frequency, beside })
}

/// Diagnostics of a channel's residuals; [`outliers`] count as missing.
pub fn diagnostics(channel: &Channel, predicted: &[f64]) -> ResidualDiagnostics {
    let mut residuals: Vec<f64> = channel.residuals(predicted).collect();
    let mut observed = channel.observed().to_vec();
    for i in outliers(channel, &residuals) {
        residuals[i] = f64::NAN;
        observed[i] = f64::NAN;
    }
    ResidualDiagnostics::new(&ResidualRecord {
        times: channel.times(),
        residuals: &residuals,
        observed: &observed,
        model: predicted,
    })
}

/// Indices of outliers ([`far_off`]) under a robust loss: they are left out of the statistics of the fit. None under least
/// squares.
pub fn outliers(channel: &Channel, residuals: &[f64]) -> Vec<usize> {
    match channel.loss() {
        Loss::Squares => Vec::new(),
        _ => far_off(residuals),
    }
}
