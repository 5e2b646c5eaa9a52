//! Times of samples that a format states by a rate or an interval.

/// Times of the samples of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sampling {
    /// Sampling rate, Hz: sample i at i/rate.
    Rate(f64),
    /// First time and interval, s: sample i at start + i step.
    Interval {
        /// Time of the first sample, s.
        start: f64,
        /// Sampling interval, s.
        step: f64,
    },
}

impl Sampling {
    /// `None` unless rate and interval are positive and finite.
    pub(super) fn interval(start: f64, step: f64) -> Option<Self> {
        let valid = start.is_finite() && step.is_finite() && step > 0.0;
        valid.then_some(Self::Interval { start, step })
    }

    /// These times, later by `late` (s).
    pub(super) fn later(self, late: f64) -> Self {
        let (start, step) = (self.time(0) + late, self.step());
        Self::Interval { start, step }
    }

    /// Sampling interval, s.
    pub(super) fn step(self) -> f64 {
        match self {
            Self::Rate(rate) => 1.0 / rate,
            Self::Interval { step, .. } => step,
        }
    }

    /// Time of sample i, s.
    pub fn time(self, i: usize) -> f64 {
        match self {
            Self::Rate(rate) => i as f64 / rate,
            Self::Interval { start, step } => start + i as f64 * step,
        }
    }

    /// Bits by which equal times are recognised.
    pub fn key(self) -> [u64; 3] {
        match self {
            Self::Rate(rate) => [0, rate.to_bits(), 0],
            Self::Interval { start, step } => [1, start.to_bits(), step.to_bits()],
        }
    }
}
