//! An axis, its range and ticks.
//!
//! Ranges are in the coordinate in which the axis is uniform: the value itself, or its decimal logarithm.

use crate::report::text;
use kmcfit_core::internals::signal::Extremes;
use serde::{Serialize, Serializer};
use std::ops::RangeInclusive;

/// Magnitudes beyond this leave gaps, so that no difference of two values overflows.
pub(super) const LARGEST: f64 = 1e300;
/// Magnitudes below this count as zero on linear axes, so that no step loses its digits.
const SMALLEST: f64 = 1e-290;
/// Spans below this share of the magnitude are rounding errors and are drawn as a constant.
const FLAT: f64 = 1e-9;
/// Blank share of a linear range above and below its data.
const PAD: f64 = 0.05;
/// Axes over more decades have no ticks between them.
const MINOR_DECADES: f64 = 7.0;

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Length proportional to the value.
    Linear,
    /// Length proportional to the logarithm; values at or below zero leave gaps.
    Log,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_log<S: Serializer>(scale: &Scale, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(*scale == Scale::Log)
}

/// An axis: quantity, unit, scale and range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// Quantity and symbol, as in `time t`.
    pub label: String,
    /// Unit, as in `s`; empty for a pure number.
    pub unit: String,
    /// Linear or logarithmic.
    #[serde(rename = "log", serialize_with = "is_log")]
    pub scale: Scale,
    /// Lowest and highest value shown, in the unit of the axis; `None` for the range of the data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis as wide as its data.
    pub fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            unit: unit.into(),
            scale: Scale::Linear,
            limits: None,
        }
    }

    /// A logarithmic axis over the whole decades that hold its data.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label, unit)
        }
    }

    /// Sets the lowest and the highest value shown; ignores invalid limits (not finite, not increasing, not positive on
    /// a logarithmic axis).
    #[must_use]
    pub fn limits(mut self, low: f64, high: f64) -> Self {
        let is_range = low.is_finite() && high.is_finite() && low < high;
        let is_drawable = self.scale == Scale::Linear || low > 0.0;
        self.limits = (is_range && is_drawable).then_some((low, high));
        self
    }

    /// Label and unit as written beside the axis: `time t (s)`.
    pub fn caption(&self) -> String {
        match (self.label.as_str(), self.unit.as_str()) {
            (label, "") => label.to_string(),
            ("", unit) => unit.to_string(),
            (label, unit) => format!("{label} ({unit})"),
        }
    }
}

/// Lowest and highest value in the uniform coordinate.
pub(super) type Range = (f64, f64);

/// The value in the uniform coordinate; NaN if it cannot be drawn.
pub(super) fn even(scale: Scale, value: f64) -> f64 {
    match scale {
        _ if value.is_nan() || value.abs() > LARGEST => f64::NAN,
        Scale::Linear if value.abs() < SMALLEST => 0.0,
        Scale::Linear => value,
        Scale::Log if value > 0.0 => value.log10(),
        Scale::Log => f64::NAN,
    }
}

/// The smallest range that contains all drawable values, if any.
pub(super) fn extent(scale: Scale, values: &[f64]) -> Option<Range> {
    // Of the values, because logarithms take most of the time and have the same order.
    let Extremes { low, high, .. } = Extremes::of(values, drawable(scale));
    (low <= high).then(|| (even(scale, low), even(scale, high)))
}

/// Values that can be drawn: those with a place in the uniform coordinate.
pub(super) fn drawable(scale: Scale) -> RangeInclusive<f64> {
    match scale {
        Scale::Linear => -LARGEST..=LARGEST,
        // From the smallest number above zero.
        Scale::Log => f64::from_bits(1)..=LARGEST,
    }
}

/// The smallest range that contains both.
pub(super) fn union(one: Option<Range>, other: Range) -> Range {
    one.map_or(other, |one| (one.0.min(other.0), one.1.max(other.1)))
}

/// The range of an axis for data of this extent; `pad` adds a margin to linear data.
pub(super) fn range(axis: &Axis, extent: Option<Range>, pad: bool) -> Range {
    if let Some(limits) = limits(axis) {
        return limits;
    }
    let (low, high) = extent.unwrap_or((0.0, if axis.scale == Scale::Log { 0.0 } else { 1.0 }));
    match axis.scale {
        Scale::Log => decades(low, high),
        Scale::Linear => linear(low, high, if pad { PAD } else { 0.0 }),
    }
}

fn limits(axis: &Axis) -> Option<Range> {
    let (low, high) = axis.limits?;
    let (low, high) = (even(axis.scale, low), even(axis.scale, high));
    (high - low > FLAT * low.abs().max(high.abs())).then_some((low, high))
}

/// The whole decades around a logarithmic extent; a small tolerance keeps rounding errors from adding a decade.
fn decades(low: f64, high: f64) -> Range {
    let (low, high) = ((low + FLAT).floor(), (high - FLAT).ceil());
    if high > low {
        (low, high)
    } else {
        (low - 1.0, low + 1.0)
    }
}

fn linear(low: f64, high: f64, pad: f64) -> Range {
    let size = low.abs().max(high.abs());
    if high - low <= FLAT * size {
        let room = if size > 0.0 { 0.1 * size } else { 1.0 };
        return (low - room, high + room);
    }
    let room = pad * (high - low);
    (low - room, high + room)
}

/// A tick: position as a share of the axis from its low end, and label.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub share: f64,
    pub label: String,
}

/// An axis ready to draw.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ruler {
    scale: Scale,
    range: Range,
    /// Labelled ticks.
    pub major: Vec<Tick>,
    /// Shares of the short ticks without a label.
    pub minor: Vec<f64>,
}

impl Ruler {
    /// A ruler with at most about `most` labelled ticks.
    pub fn new(scale: Scale, range: Range, most: usize) -> Self {
        let mut ruler = Self {
            scale,
            range,
            major: Vec::new(),
            minor: Vec::new(),
        };
        match scale {
            Scale::Linear => ruler.linear_ticks(most.max(2)),
            Scale::Log => ruler.log_ticks(most.max(2)),
        }
        ruler
    }

    /// A horizontal ruler of `length` pixels without overlapping labels.
    pub fn across(scale: Scale, range: Range, length: f64, size: f64) -> Self {
        let most = ((length / 45.0) as usize).clamp(2, 8);
        (2..=most)
            .rev()
            .map(|most| Self::new(scale, range, most))
            .find(|ruler| ruler.widest(size) + size < length / ruler.major.len().max(1) as f64)
            .unwrap_or_else(|| Self::new(scale, range, 2))
    }

    /// Position of a value as a share of the axis; NaN if it cannot be drawn.
    pub fn share(&self, value: f64) -> f64 {
        self.place(even(self.scale, value))
    }

    /// Width of the widest label, in pixels.
    pub fn widest(&self, size: f64) -> f64 {
        let widths = self.major.iter().map(|tick| text::width(&tick.label, size));
        widths.fold(0.0, f64::max)
    }

    fn place(&self, even: f64) -> f64 {
        (even - self.range.0) / (self.range.1 - self.range.0)
    }

    fn linear_ticks(&mut self, most: usize) {
        let (low, high) = self.range;
        let step = round_step((high - low) / most as f64);
        let largest = low.abs().max(high.abs());
        let slack = FLAT * (high - low) / step;
        let (first, last) = ((low / step - slack).ceil(), (high / step + slack).floor());
        let count = (last - first).clamp(0.0, 100.0) as usize;
        for index in 0..=count {
            let value = (first + index as f64) * step;
            let label = text::tick(value, step, largest);
            let share = self.place(value);
            self.major.push(Tick { share, label });
        }
    }

    /// Ticks at decades, or at round values if the range has too few decades.
    fn log_ticks(&mut self, most: usize) {
        let (low, high) = self.range;
        let (first, last) = ((low - FLAT).ceil() as i64, (high + FLAT).floor() as i64);
        if last <= first {
            return self.round_values(most);
        }
        let stride = (last - first).div_euclid(most as i64) + 1;
        for exponent in first..=last {
            let share = self.place(exponent as f64);
            if exponent.rem_euclid(stride) == 0 {
                let label = text::decade(exponent);
                self.major.push(Tick { share, label });
            } else {
                self.minor.push(share);
            }
        }
        if high - low <= MINOR_DECADES {
            self.between_decades(first - 1, last);
        }
    }

    fn between_decades(&mut self, first: i64, last: i64) {
        for exponent in first..=last {
            for digit in 2..10 {
                let share = self.place(exponent as f64 + f64::from(digit).log10());
                if (0.0..=1.0).contains(&share) {
                    self.minor.push(share);
                }
            }
        }
    }

    /// Ticks at linear steps on a logarithmic axis of less than two decades.
    fn round_values(&mut self, most: usize) {
        let (low, high) = (10f64.powf(self.range.0), 10f64.powf(self.range.1));
        let plain = Ruler::new(Scale::Linear, (low, high), most);
        for tick in plain.major {
            let share = self.share(low + tick.share * (high - low));
            let label = tick.label;
            if share.is_finite() {
                self.major.push(Tick { share, label });
            }
        }
    }
}

/// The next larger of 1, 2 and 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|f| f * power >= step * (1.0 - FLAT));
    factor.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ruler: &Ruler) -> Vec<&str> {
        ruler.major.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        let ruler = Ruler::new(Scale::Linear, (0.0, 25.0), 6);
        assert_eq!(labels(&ruler), ["0", "5", "10", "15", "20", "25"]);
        let ruler = Ruler::new(Scale::Linear, (-0.31, 0.52), 5);
        assert_eq!(labels(&ruler), ["−0.2", "0.0", "0.2", "0.4"]);
    }

    #[test]
    fn log_axes_label_decades_only() {
        let axis = Axis::log("J/J0", "");
        let range = range(
            &axis,
            extent(Scale::Log, &[8.1e-5, 0.8, 0.0, f64::NAN]),
            true,
        );
        assert_eq!(range, (-5.0, 0.0));
        let ruler = Ruler::new(Scale::Log, range, 6);
        assert_eq!(
            labels(&ruler),
            ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]
        );
        assert_eq!(ruler.minor.len(), 40);
    }

    #[test]
    fn many_decades_are_labelled_in_strides() {
        let ruler = Ruler::new(Scale::Log, (-16.0, 4.0), 7);
        assert_eq!(
            labels(&ruler),
            ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰", "10³"]
        );
    }

    #[test]
    fn exact_decades_stay_within() {
        let values: Vec<f64> = (0..4).map(|e| 10f64.powi(e)).collect();
        assert_eq!(
            range(&Axis::log("", ""), extent(Scale::Log, &values), true),
            (0.0, 3.0)
        );
    }

    #[test]
    fn every_extent_gives_a_range() {
        for values in [
            vec![],
            vec![f64::NAN, f64::INFINITY],
            vec![0.0; 3],
            vec![1.0; 3],
            vec![1.0, 1.0 + 1e-15],
            vec![-1e300, 1e300],
            vec![5e-324],
        ] {
            for axis in [Axis::linear("", ""), Axis::log("", "")] {
                let (low, high) = range(&axis, extent(axis.scale, &values), true);
                assert!(
                    low < high && (high - low).is_finite(),
                    "{values:?} {axis:?}"
                );
                assert!(!Ruler::new(axis.scale, (low, high), 5).major.is_empty());
            }
        }
    }

    #[test]
    fn useless_limits_count_as_absent() {
        let axis = Axis::log("", "").limits(0.0, 1.0);
        assert_eq!(range(&axis, Some((-2.0, 0.0)), true), (-2.0, 0.0));
        let axis = Axis::linear("", "").limits(3.0, f64::NAN);
        assert_eq!(range(&axis, Some((-2.0, 0.0)), false), (-2.0, 0.0));
    }
}
