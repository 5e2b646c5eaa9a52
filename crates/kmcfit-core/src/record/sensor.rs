//! Sensors: gain, offset, drift and delay.

use crate::functions::ScalarValue;

/// Sensor model `sample(t) = gain * response(t - delay + input_delay) + offset + drift * age`, on the time axis of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Gain, dimensionless.
    pub gain: ScalarValue,
    /// Offset, in the unit of the channel.
    pub offset: ScalarValue,
    /// Drift, in the unit of the channel per s.
    pub drift: ScalarValue,
    /// Delay of the samples, s: positive for a channel recorded late.
    pub delay: ScalarValue,
    /// Delay of the recorded input, s: positive for an input recorded late. One parameter for all channels of a record.
    pub input_delay: ScalarValue,
}

impl Default for Sensor {
    /// An ideal sensor.
    fn default() -> Self {
        Self {
            gain: ScalarValue::Known(1.0),
            offset: ScalarValue::Known(0.0),
            drift: ScalarValue::Known(0.0),
            delay: ScalarValue::Known(0.0),
            input_delay: ScalarValue::Known(0.0),
        }
    }
}

impl Sensor {
    /// Number of parameters of a sensor.
    pub const PARAMETERS: usize = 5;

    fn list(self) -> [ScalarValue; Self::PARAMETERS] {
        [
            self.gain,
            self.offset,
            self.drift,
            self.delay,
            self.input_delay,
        ]
    }

    /// Gain, offset and drift for the values `scalars` of all scalars.
    pub fn values(self, scalars: &[f64]) -> [f64; 3] {
        [self.gain, self.offset, self.drift].map(|value| value.of(scalars))
    }

    /// Delay of the samples relative to the recorded input, s.
    pub fn total_delay(self, scalars: &[f64]) -> f64 {
        self.delay.of(scalars) - self.input_delay.of(scalars)
    }

    /// True unless the samples are known to be simultaneous with the input.
    pub fn is_delayed(self) -> bool {
        [self.delay, self.input_delay] != [ScalarValue::Known(0.0); 2]
    }

    /// Indices of the estimated scalars: of gain, offset, drift, delay and delay of the input.
    pub fn indices(self) -> [Option<usize>; Self::PARAMETERS] {
        self.list().map(ScalarValue::index)
    }

    /// True if a parameter is estimated.
    pub fn is_estimated(self) -> bool {
        self.indices().iter().any(Option::is_some)
    }

    /// Change of a sample along a change of the scalars: the sum of its derivatives `factors` in the estimated parameters.
    pub fn change(self, factors: [f64; Self::PARAMETERS], scalars: &[f64]) -> f64 {
        let pairs = self.indices().into_iter().zip(factors);
        pairs
            .map(|(index, factor)| index.map_or(0.0, |i| factor * scalars[i]))
            .sum()
    }

    /// Adds the gradient with respect to the scalars: `slope` times the derivatives `factors` in the parameters.
    pub(crate) fn add_gradient(
        self,
        factors: [f64; Self::PARAMETERS],
        slope: f64,
        scalars: &mut [f64],
    ) {
        for (index, factor) in self.indices().into_iter().zip(factors) {
            if let Some(index) = index {
                scalars[index] += slope * factor;
            }
        }
    }
}
