//! An axis, its range and ticks.
//!
//! Ranges are in the coordinate in which the axis is uniform: the value itself, or its decimal logarithm.

use crate::report::text;
use kmcfit_core::signal::Extremes;
use std::ops::RangeInclusive;

/// Magnitudes beyond this leave gaps, so that no difference of two values overflows.
const LARGEST: f64 = 1e300;
/// Magnitudes below this count as zero on linear axes, so that no step loses its digits.
const SMALLEST: f64 = 1e-290;
/// Spans below this share of the magnitude are rounding errors and are drawn as a constant.
const FLAT: f64 = 1e-9;
/// Blank share of a vertical linear range above and below its data.
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

/// An axis: quantity, unit, scale and range.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Measurand and symbol, as in `time t`.
    pub label: String,
    /// Unit, as in `s`; empty for a pure number.
    pub unit: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Lowest and highest value shown, in the unit of the axis; `None` for the range of the data.
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

/// A tick: position as a share of the axis from its low end, and label, which is empty for a short tick between the others.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub share: f64,
    pub label: String,
}

/// An axis with its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ruler {
    pub scale: Scale,
    pub range: Range,
}

impl Ruler {
    /// The range of an axis for data of these extents; `pad` adds a margin to linear data.
    pub fn new(axis: &Axis, extents: impl Iterator<Item = Range>, pad: bool) -> Self {
        let scale = axis.scale;
        let of_axis = axis.limits.and_then(|(low, high)| {
            let (low, high) = (even(scale, low), even(scale, high));
            (high - low > FLAT * low.abs().max(high.abs())).then_some((low, high))
        });
        let of_data = || {
            let all = extents.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
            match scale {
                Scale::Log => decades(all.unwrap_or((0.0, 0.0))),
                Scale::Linear => linear(all.unwrap_or((0.0, 1.0)), if pad { PAD } else { 0.0 }),
            }
        };
        Self {
            scale,
            range: of_axis.unwrap_or_else(of_data),
        }
    }

    /// Position of a value as a share of the axis; NaN if it cannot be drawn.
    pub fn share(&self, value: f64) -> f64 {
        self.location(even(self.scale, value))
    }

    fn location(&self, even: f64) -> f64 {
        (even - self.range.0) / (self.range.1 - self.range.0)
    }

    /// At most about `most` labelled ticks, and those between them.
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        let most = most.max(2);
        let (low, high) = self.range;
        match self.scale {
            Scale::Linear => linear_ticks(self.range, most)
                .map(|(value, label)| Tick {
                    share: self.location(value),
                    label,
                })
                .collect(),
            Scale::Log if (high + FLAT).floor() <= (low - FLAT).ceil() => {
                let round = linear_ticks((10f64.powf(low), 10f64.powf(high)), most);
                round
                    .map(|(value, label)| Tick {
                        share: self.share(value),
                        label,
                    })
                    .filter(|tick| tick.share.is_finite())
                    .collect()
            }
            Scale::Log => self.log_ticks(most),
        }
    }

    /// Labels at decades; over few decades short ticks at their multiples.
    fn log_ticks(&self, most: usize) -> Vec<Tick> {
        let (low, high) = self.range;
        let (first, last) = ((low - FLAT).ceil() as i64, (high + FLAT).floor() as i64);
        let stride = (last - first).div_euclid(most as i64) + 1;
        let decades = (first..=last).map(|exponent| Tick {
            share: self.location(exponent as f64),
            label: match exponent.rem_euclid(stride) {
                0 => text::decade(exponent),
                _ => String::new(),
            },
        });
        let between = (first - 1..=last).filter(|_| high - low <= MINOR_DECADES);
        let between = between.flat_map(|exponent| {
            (2..10).map(move |digit| exponent as f64 + f64::from(digit).log10())
        });
        let between = between.map(|location| Tick {
            share: self.location(location),
            label: String::new(),
        });
        let inside = between.filter(|tick| (0.0..=1.0).contains(&tick.share));
        decades.chain(inside).collect()
    }
}

/// The whole decades around a logarithmic extent; a small tolerance keeps rounding errors from adding a decade.
fn decades((low, high): Range) -> Range {
    let (low, high) = ((low + FLAT).floor(), (high - FLAT).ceil());
    if high > low {
        (low, high)
    } else {
        (low - 1.0, low + 1.0)
    }
}

fn linear((low, high): Range, pad: f64) -> Range {
    let size = low.abs().max(high.abs());
    if high - low <= FLAT * size {
        let room = if size > 0.0 { 0.1 * size } else { 1.0 };
        return (low - room, high + room);
    }
    let room = pad * (high - low);
    (low - room, high + room)
}

/// Round values in a range with their labels.
fn linear_ticks((low, high): Range, most: usize) -> impl Iterator<Item = (f64, String)> {
    let step = round_step((high - low) / most as f64);
    let largest = low.abs().max(high.abs());
    let slack = FLAT * (high - low) / step;
    let (first, last) = ((low / step - slack).ceil(), (high / step + slack).floor());
    let count = (last - first).clamp(0.0, 100.0) as usize;
    (0..=count).map(move |index| {
        let value = (first + index as f64) * step;
        (value, text::tick(value, step, largest))
    })
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

    fn labels(scale: Scale, range: Range, most: usize) -> Vec<String> {
        let ticks = Ruler { scale, range }.ticks(most).into_iter();
        ticks
            .map(|tick| tick.label)
            .filter(|label| !label.is_empty())
            .collect()
    }

    #[test]
    fn ticks_are_round_or_decades() {
        let linear = |range, most| labels(Scale::Linear, range, most);
        assert_eq!(linear((0.0, 25.0), 6), ["0", "5", "10", "15", "20", "25"]);
        assert_eq!(linear((-0.31, 0.52), 5), ["−0.2", "0.0", "0.2", "0.4"]);
        let log = |range| labels(Scale::Log, range, 7);
        assert_eq!(log((-3.0, 0.0)), ["10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
        assert_eq!(
            log((-16.0, 4.0)),
            ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰", "10³"]
        );
        assert_eq!(log((0.1, 0.5)), ["1.5", "2.0", "2.5", "3.0"]);
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
            for axis in [Axis::linear("", ""), Axis::log("", "").limits(0.0, 1.0)] {
                let extents = extent(axis.scale, &values).into_iter();
                let ruler = Ruler::new(&axis, extents, true);
                let (low, high) = ruler.range;
                assert!(
                    low < high && (high - low).is_finite(),
                    "{values:?} {axis:?}"
                );
                assert!(!ruler.ticks(5).is_empty());
            }
        }
    }

    /// Exact decades add none.
    #[test]
    fn a_logarithmic_range_has_whole_decades() {
        let range = |values: &[f64]| {
            let extents = extent(Scale::Log, values).into_iter();
            Ruler::new(&Axis::log("", ""), extents, true).range
        };
        assert_eq!(range(&[8.1e-5, 0.8, 0.0, f64::NAN]), (-5.0, 0.0));
        assert_eq!(range(&[1.0, 10.0, 1000.0]), (0.0, 3.0));
    }
}
