//! Sensors: gain, offset and drift.

use crate::functions::ScalarValue;

/// Sensor model `sample = gain * response + offset + drift * time`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Gain, dimensionless.
    pub gain: ScalarValue,
    /// Offset, in the unit of the channel.
    pub offset: ScalarValue,
    /// Drift, in the unit of the channel per s.
    pub drift: ScalarValue,
}

impl Default for Sensor {
    /// An ideal sensor.
    fn default() -> Self {
        Self {
            gain: ScalarValue::Known(1.0),
            offset: ScalarValue::Known(0.0),
            drift: ScalarValue::Known(0.0),
        }
    }
}

impl Sensor {
    fn list(self) -> [ScalarValue; 3] {
        [self.gain, self.offset, self.drift]
    }

    /// Gain, offset and drift for the values `scalars` of all scalars.
    pub fn values(self, scalars: &[f64]) -> [f64; 3] {
        self.list().map(|value| value.of(scalars))
    }

    /// Changes of gain, offset and drift along a change of the scalars.
    pub fn changes(self, scalars: &[f64]) -> [f64; 3] {
        self.indices()
            .map(|index| index.map_or(0.0, |i| scalars[i]))
    }

    /// Indices of the estimated scalars.
    pub fn indices(self) -> [Option<usize>; 3] {
        self.list().map(ScalarValue::index)
    }

    /// Adds the gradient with respect to the scalars: `slope` times the `factors` of gain, offset and drift.
    pub(crate) fn add_gradient(self, factors: [f64; 3], slope: f64, scalars: &mut [f64]) {
        for (index, factor) in self.indices().into_iter().zip(factors) {
            if let Some(index) = index {
                scalars[index] += slope * factor;
            }
        }
    }
}
