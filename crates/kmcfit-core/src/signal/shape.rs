//! Excitation shapes given by formulas.

use std::f64::consts::{PI, TAU};

/// Largest distance, relative to a time, of a computed time that is taken as equal.
const ROUNDING: f64 = 1e-12;

/// Frequency of a sweep over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SweepLaw {
    /// Linear: `f = f0 + (f1 - f0) s/T`.
    #[default]
    Linear,
    /// Logarithmic: `f = f0 (f1/f0)^(s/T)`.
    Logarithmic,
}

/// An excitation shape. Amplitudes are in the unit of the signal, times in s, frequencies in Hz, phases in rad.
///
/// ```
/// use kmcfit_core::signal::ExcitationShape;
/// let step = ExcitationShape::Step { amplitude: 2.0, at: 1.0 };
/// assert_eq!((step.value_before(1.0), step.value(1.0)), (0.0, 2.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExcitationShape {
    /// Constant `a`.
    Constant {
        /// Amplitude `a`.
        amplitude: f64,
    },
    /// Sine `a sin(2π f t + phase)`.
    Sine {
        /// Amplitude `a`.
        amplitude: f64,
        /// Frequency `f`, Hz.
        frequency: f64,
        /// Phase at time zero, rad.
        phase: f64,
    },
    /// Sweep `a sin(2π ∫ f ds)` for `0 <= s < T`, zero elsewhere, with `s = t - start`:
    ///
    /// ```text
    /// linear       ∫ f ds = f0 s + (f1 - f0) s²/(2 T)
    /// logarithmic  ∫ f ds = f0 T/ln(f1/f0) ((f1/f0)^(s/T) - 1)
    /// ```
    ///
    /// It may jump at the end. A logarithmic sweep needs positive frequencies.
    Sweep {
        /// Amplitude `a`.
        amplitude: f64,
        /// Initial frequency `f0`, Hz.
        from: f64,
        /// Final frequency `f1`, Hz.
        to: f64,
        /// Start, s.
        start: f64,
        /// Duration `T`, s.
        duration: f64,
        /// Frequency law.
        law: SweepLaw,
    },
    /// Step: zero before `at`, `a` from there.
    Step {
        /// Height `a`.
        amplitude: f64,
        /// Time of the step, s.
        at: f64,
    },
    /// Half sine `a sin(π (t - at)/T)` for `at <= t < at + T`, zero elsewhere.
    HalfSine {
        /// Amplitude `a`.
        amplitude: f64,
        /// Start, s.
        at: f64,
        /// Duration `T`, s.
        duration: f64,
    },
}

impl ExcitationShape {
    /// Value at a time; at a jump the value after it.
    pub fn value(&self, t: f64) -> f64 {
        self.on(t, |time| t >= time - ROUNDING * time.abs())
    }

    /// Left limit of the value: at a jump the value before it.
    pub fn value_before(&self, t: f64) -> f64 {
        self.on(t, |time| t > time + ROUNDING * time.abs())
    }

    /// Times of jumps and kinks, increasing, which no step should cross.
    pub fn breaks(&self) -> Vec<f64> {
        match *self {
            Self::Constant { .. } | Self::Sine { .. } => Vec::new(),
            Self::Step { at, .. } => vec![at],
            Self::Sweep {
                start: at,
                duration,
                ..
            }
            | Self::HalfSine { at, duration, .. } => vec![at, at + duration],
        }
    }

    /// Value at `t`; `has_come` is true for breaks at or before the time.
    fn on(&self, t: f64, has_come: impl Fn(f64) -> bool) -> f64 {
        let during = |from: f64, to: f64| has_come(from) && !has_come(to);
        match *self {
            Self::Constant { amplitude } => amplitude,
            Self::Sine {
                amplitude,
                frequency,
                phase,
            } => amplitude * (TAU * frequency * t + phase).sin(),
            Self::Step { amplitude, at } if has_come(at) => amplitude,
            Self::Sweep {
                amplitude,
                from,
                to,
                start,
                duration,
                law,
            } if during(start, start + duration) => {
                amplitude * (TAU * cycles(from, to, duration, law, t - start)).sin()
            }
            Self::HalfSine {
                amplitude,
                at,
                duration,
            } if during(at, at + duration) => amplitude * (PI * (t - at) / duration).sin(),
            Self::Step { .. } | Self::Sweep { .. } | Self::HalfSine { .. } => 0.0,
        }
    }
}

/// Number of cycles of a sweep after `s` seconds.
fn cycles(from: f64, to: f64, duration: f64, law: SweepLaw, s: f64) -> f64 {
    let octaves = (to / from).ln();
    match law {
        // Without a change of frequency both laws are equal.
        SweepLaw::Logarithmic if octaves != 0.0 => {
            from * duration / octaves * (octaves * s / duration).exp_m1()
        }
        _ => from * s + (to - from) * s * s / (2.0 * duration),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SWEEP: ExcitationShape = ExcitationShape::Sweep {
        amplitude: 2.0,
        from: 1.0,
        to: 4.0,
        start: 0.5,
        duration: 3.0,
        law: SweepLaw::Linear,
    };

    #[test]
    fn shapes_have_their_values() {
        assert_eq!(
            ExcitationShape::Constant { amplitude: 3.0 }.value(-1.0),
            3.0
        );
        let sine = ExcitationShape::Sine {
            amplitude: 2.0,
            frequency: 0.25,
            phase: PI / 2.0,
        };
        assert_eq!(sine.value(0.0), 2.0);
        assert!(sine.value(1.0).abs() < 1e-15);
        assert!((sine.value(2.0) + 2.0).abs() < 1e-15);
        let blow = ExcitationShape::HalfSine {
            amplitude: 5.0,
            at: 1.0,
            duration: 0.5,
        };
        assert_eq!(
            (blow.value(0.9), blow.value(1.25), blow.value(1.6)),
            (0.0, 5.0, 0.0)
        );
        assert_eq!(blow.breaks(), [1.0, 1.5]);
    }

    #[test]
    fn jumps_have_two_sides() {
        let step = ExcitationShape::Step {
            amplitude: 2.0,
            at: 0.3,
        };
        // 3 * 0.1 is above 0.3 by rounding, 0.3 (1 - 1e-16) below.
        for t in [0.3, 3.0 * 0.1, 0.3 * (1.0 - 2e-16)] {
            assert_eq!((step.value_before(t), step.value(t)), (0.0, 2.0));
        }
        assert_eq!((step.value(0.29), step.value_before(0.31)), (0.0, 2.0));
        // 1 + 4 Hz in 3 s: 7.5 cycles, where a sine is zero; 0.01 s earlier it is not.
        assert_eq!((SWEEP.value(0.4), SWEEP.value(3.5)), (0.0, 0.0));
        assert!(SWEEP.value_before(3.5).abs() < 1e-13);
        assert!(SWEEP.value(3.45).abs() > 1.0);
    }

    #[test]
    fn sweeps_have_their_frequencies() {
        for (law, middle) in [(SweepLaw::Linear, 2.5), (SweepLaw::Logarithmic, 2.0)] {
            let h = 1e-5;
            let frequency = |s: f64| {
                (cycles(1.0, 4.0, 3.0, law, s + h) - cycles(1.0, 4.0, 3.0, law, s - h)) / (2.0 * h)
            };
            // Central differences: h² times a third derivative below 1, and rounding 1e-16/h.
            for (s, expected) in [(0.0, 1.0), (1.5, middle), (3.0, 4.0)] {
                assert!((frequency(s) - expected).abs() < 1e-9, "{law:?} {s}");
            }
        }
        assert_eq!(cycles(2.0, 2.0, 3.0, SweepLaw::Logarithmic, 1.5), 3.0);
    }
}
