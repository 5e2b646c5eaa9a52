//! Records of an oscillator of 1 Hz (15 Hz beside the mains) that has one thing more than constants: a free decay (mass 1 kg, damping ratio 1 %,
//! amplitude 1 m), or the response from rest to a broadband force that is linear between its samples (mass 1.7 kg, damping ratio 2 %);
//! displacements, 20.5 samples in a period, by an independent integrator.

use super::forced::{broadband, response, rms, white};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::candidates::{Addition, RecordParameter};
use kmcfit_core::model::{CoefficientSpec, ScalarSpec};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::structure::CoefficientKind;
use std::f64::consts::{PI, SQRT_2, TAU};

const SAMPLES_PER_PERIOD: f64 = 20.5;
/// Velocity over which the sign of friction changes, relative to the largest velocity: below that of the noise.
const FRICTION_WIDTH: f64 = 0.005;
/// Frequency of the mains, Hz, and relative to that of the oscillator.
const MAINS: f64 = 50.0;
const MAINS_RATIO: f64 = 3.37;
/// Latest jump in a free decay, in periods.
const LATEST_JUMP: f64 = 20.0;
/// Damping ratio of a second mode.
const SECOND_RATIO: f64 = 0.015;
/// Sines of a smooth force, and their largest frequency.
const SINES: usize = 60;
const HIGHEST: f64 = 3.0;

/// What a record has beside constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Clean,
    SlowStiffness,
    Trend,
    SlowMass,
    SlowDamping,
    Jump,
    Cubic,
    Quadratic,
    Coulomb,
    Offset,
    Drift,
    Delay,
    /// A second mode at this multiple of the frequency.
    Mode(f64),
    Mains,
    SensorCurve,
    /// A force that is smooth between its samples.
    SmoothForce,
    /// A force that is not measured.
    Disturbance,
    /// Errors of the measured force.
    ForceNoise,
}

impl Kind {
    /// Size of a record with this kind: a share of the coefficient, of the force of the damping at the largest velocity, of the amplitude, of
    /// the force, or samples.
    fn size(self) -> f64 {
        match self {
            Self::Clean | Self::SmoothForce => 0.0,
            Self::SlowStiffness | Self::SlowMass => 0.04,
            Self::Trend => 0.06,
            Self::SlowDamping | Self::Quadratic => 0.6,
            Self::Jump | Self::Cubic | Self::ForceNoise => 0.05,
            Self::Coulomb | Self::Delay => 0.3,
            Self::Offset | Self::Mains | Self::SensorCurve => 0.01,
            Self::Drift | Self::Mode(_) | Self::Disturbance => 0.03,
        }
    }

    /// True for the addition that describes the kind, to a model whose functions are mass, damping and stiffness.
    pub fn is(self, addition: &Addition) -> bool {
        let varies =
            |of: usize| matches!(addition, Addition::Variation { function, .. } if *function == of);
        let term = |of: CoefficientKind| matches!(addition, Addition::Term(kind, _) if *kind == of);
        match self {
            Self::Clean => false,
            Self::SlowMass => varies(0),
            Self::SlowDamping => varies(1),
            Self::SlowStiffness | Self::Trend => varies(2),
            Self::Jump => matches!(addition, Addition::Jump { function: 2, .. }),
            Self::Cubic => term(CoefficientKind::CUBIC_STIFFNESS),
            Self::Quadratic => term(CoefficientKind::QUADRATIC_DAMPING),
            Self::Coulomb => term(CoefficientKind::COULOMB_FRICTION),
            Self::Offset => {
                matches!(addition, Addition::Record(RecordParameter::Offset(..)))
            }
            Self::Drift => matches!(addition, Addition::Record(RecordParameter::Drift(..))),
            Self::Delay => matches!(addition, Addition::Record(RecordParameter::Delay(_))),
            Self::Mode(_) => matches!(addition, Addition::SecondMode { .. }),
            Self::Mains => matches!(addition, Addition::Tone { .. }),
            Self::SensorCurve => matches!(addition, Addition::SensorCurve { .. }),
            Self::SmoothForce => matches!(addition, Addition::CubicInputs),
            Self::Disturbance | Self::ForceNoise => {
                matches!(addition, Addition::Disturbance { .. })
            }
        }
    }
}

/// A record to make.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub kind: Kind,
    pub is_free: bool,
    pub seed: u64,
    pub periods: f64,
    /// Standard deviation of the noise relative to the amplitude.
    pub noise: f64,
    /// Coefficient of the first order of the noise.
    pub phi: f64,
    /// Multiple of the size of the kind.
    pub times: f64,
}

/// Means over the record: natural frequency (Hz), damping ratio, stiffness (N/m).
pub type Truth = [f64; 3];

/// The names of [`Truth`].
pub const NAMES: [&str; 3] = ["natural_frequency", "damping_ratio", "stiffness"];

/// The record of a case.
pub struct Made {
    times: Vec<f64>,
    force: Vec<f64>,
    samples: Vec<f64>,
    sigma: f64,
    mass: f64,
    damping: f64,
    pub truth: Truth,
    is_free: bool,
}

/// Mass, damping and stiffness at a share of the record.
type Course<'a> = &'a dyn Fn(f64) -> [f64; 3];

impl Case {
    fn count(&self) -> usize {
        (self.periods * SAMPLES_PER_PERIOD) as usize + 1
    }

    /// Natural frequency, Hz.
    fn frequency(&self) -> f64 {
        match self.kind {
            Kind::Mains => MAINS / MAINS_RATIO,
            _ => 1.0,
        }
    }

    /// Time between samples, s.
    fn spacing(&self) -> f64 {
        1.0 / (SAMPLES_PER_PERIOD * self.frequency())
    }

    fn white(&self, stream: u64) -> Vec<f64> {
        white(self.seed, stream, self.count())
    }

    pub fn made(&self) -> Made {
        let count = self.count();
        let h = self.spacing();
        let span = h * (count - 1) as f64;
        let (omega, size) = (TAU * self.frequency(), self.times * self.kind.size());
        let (m, ratio) = if self.is_free {
            (1.0, 0.01)
        } else {
            (1.7, 0.02)
        };
        let (c, k) = (2.0 * ratio * omega * m, m * omega * omega);
        let slow = |x: f64| 1.0 + size * (1.5 * PI * x).sin();
        // A free decay is still in motion.
        let last = if self.is_free {
            LATEST_JUMP / self.periods
        } else {
            1.0
        };
        let jump = last.min(0.4);
        let course = |x: f64| match self.kind {
            Kind::SlowMass => [m * slow(x), c, k],
            Kind::SlowDamping => [m, c * slow(x), k],
            Kind::SlowStiffness => [m, c, k * slow(x)],
            Kind::Trend => [m, c, k * (1.0 - size * (x - 0.5))],
            Kind::Jump => [m, c, if x < jump { k } else { k * (1.0 - size) }],
            _ => [m, c, k],
        };
        let force = if self.is_free {
            vec![0.0; count]
        } else {
            broadband(self.white(1))
        };
        let start = [if self.is_free { 1.0 } else { 0.0 }, 0.0];
        let linear = response(h, start, &force, |_, y, v, f| (f - c * v - k * y) / m);
        let plain: Vec<f64> = linear.iter().map(|s| s[0]).collect();
        let amplitude = if self.is_free {
            1.0
        } else {
            SQRT_2 * rms(&plain)
        };
        let exact = self.exact(&force, &course, amplitude, size);
        let noise = self.white(2).into_iter().scan(0.0, |noise, e| {
            *noise = self.phi * *noise + (1.0 - self.phi * self.phi).sqrt() * e;
            Some(*noise)
        });
        let sigma = self.noise * amplitude;
        let samples = exact.iter().zip(noise).map(|(y, e)| y + sigma * e);
        let measured = match self.kind {
            Kind::ForceNoise => {
                let errors = self.white(3);
                let part = size * rms(&force);
                force
                    .iter()
                    .zip(errors)
                    .map(|(f, e)| f + part * e)
                    .collect()
            }
            Kind::SmoothForce => {
                let smooth = self.smooth_force();
                (0..count).map(|i| smooth(h * i as f64)).collect()
            }
            _ => force,
        };
        let mean = |of: &dyn Fn([f64; 3]) -> f64| {
            let parts = 20_000;
            let each = (0..parts).map(|i| of(course((i as f64 + 0.5) / parts as f64)));
            each.sum::<f64>() / parts as f64
        };
        let truth = [
            mean(&|[m, _, k]| (k / m).sqrt() / TAU),
            mean(&|[m, c, k]| c / (2.0 * (k * m).sqrt())),
            mean(&|[_, _, k]| k),
        ];
        Made {
            times: (0..count)
                .map(|i| span * i as f64 / (count - 1) as f64)
                .collect(),
            force: measured,
            samples: samples.collect(),
            sigma,
            mass: m,
            damping: c,
            truth,
            is_free: self.is_free,
        }
    }

    /// The displacements without noise.
    fn exact(&self, force: &[f64], course: Course, amplitude: f64, size: f64) -> Vec<f64> {
        let h = self.spacing();
        let span = h * (force.len() - 1) as f64;
        let [m, c, k] = course(0.0);
        let omega = TAU * self.frequency();
        let fastest = omega * amplitude;
        let start = [if self.is_free { 1.0 } else { 0.0 }, 0.0];
        let displacements = |force: &[f64], a: &dyn Fn(f64, f64, f64, f64) -> f64| -> Vec<f64> {
            let states = response(h, start, force, a);
            states.into_iter().map(|s| s[0]).collect()
        };
        let by_course = |t: f64, y: f64, v: f64, f: f64| {
            let [m, c, k] = course(t / span);
            (f - c * v - k * y) / m
        };
        let times = (0..force.len()).map(|i| h * i as f64);
        let with = |added: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            let plain = displacements(force, &by_course);
            plain
                .iter()
                .zip(times.clone())
                .map(|(y, t)| y + added(t, *y))
                .collect()
        };
        match self.kind {
            Kind::Cubic => {
                let k3 = size * k / (amplitude * amplitude);
                displacements(force, &|_, y, v, f| {
                    (f - c * v - k * y - k3 * y.powi(3)) / m
                })
            }
            Kind::Quadratic => {
                let c2 = size * c / fastest;
                displacements(force, &|_, y, v, f| {
                    (f - c * v - k * y - c2 * v * v.abs()) / m
                })
            }
            Kind::Coulomb => {
                let (friction, width) = (size * c * fastest, FRICTION_WIDTH * fastest);
                displacements(force, &|_, y, v, f| {
                    (f - c * v - k * y - friction * (v / width).tanh()) / m
                })
            }
            Kind::Offset => with(&|_, _| size * amplitude),
            Kind::Drift => with(&|t, _| size * amplitude * t / span),
            Kind::Mains => with(&|t, _| size * amplitude * (TAU * MAINS * t + 0.5).sin()),
            Kind::SensorCurve => {
                with(&|_, y| size * (y * y / amplitude + y.powi(3) / (amplitude * amplitude)))
            }
            Kind::Delay => {
                let late = |t: f64| {
                    let x = (t / h - size).clamp(0.0, (force.len() - 1) as f64);
                    let i = (x as usize).min(force.len() - 2);
                    force[i] + (x - i as f64) * (force[i + 1] - force[i])
                };
                displacements(force, &|t, y, v, _| (late(t) - c * v - k * y) / m)
            }
            Kind::Mode(multiple) => {
                let plain = displacements(force, &by_course);
                let own = multiple * omega;
                let second = response(
                    h,
                    [if self.is_free { size } else { 0.0 }, 0.0],
                    force,
                    |_, y, v, f| f - 2.0 * SECOND_RATIO * own * v - own * own * y,
                );
                let second: Vec<f64> = second.into_iter().map(|s| s[0]).collect();
                let factor = if self.is_free {
                    1.0
                } else {
                    size * rms(&plain) / rms(&second)
                };
                plain
                    .iter()
                    .zip(second)
                    .map(|(y, q)| y + factor * q)
                    .collect()
            }
            Kind::SmoothForce => {
                let smooth = self.smooth_force();
                displacements(force, &|t, y, v, _| (smooth(t) - c * v - k * y) / m)
            }
            Kind::Disturbance => {
                let part = size * rms(force);
                let errors = self.white(3);
                let acting: Vec<f64> = force
                    .iter()
                    .zip(errors)
                    .map(|(f, e)| f + part * e)
                    .collect();
                displacements(&acting, &by_course)
            }
            _ => displacements(force, &by_course),
        }
    }

    /// A sum of sines of random phases and sizes, N.
    fn smooth_force(&self) -> impl Fn(f64) -> f64 {
        let sizes = white(self.seed, 4, 2 * SINES);
        move |t| {
            let each = (1..=SINES).map(|i| {
                // No common period.
                let frequency = HIGHEST * (i as f64 - 0.3 * (i as f64).sin()) / SINES as f64;
                let (sin, cos) = (TAU * frequency * t).sin_cos();
                sizes[2 * i - 2] * sin + sizes[2 * i - 1] * cos
            });
            each.sum()
        }
    }
}

impl Made {
    /// Constants for damping and stiffness, in a forced record also for the mass; the state at the beginning of a free decay is estimated.
    pub fn problem(&self) -> Problem {
        let mut channel = ChannelSpec::new(ChannelKind::Displacement, &self.times, &self.samples);
        channel.weighting = Some(Weighting::Estimated { sigma: self.sigma });
        let record = Record::new("record").channel(channel);
        let record = match self.is_free {
            true => record.initial([1.0, 0.0].map(ScalarSpec::starting_at)),
            false => record.from_state(0.0, 0.0).force(&self.times, &self.force),
        };
        let mass = match self.is_free {
            true => CoefficientSpec::fixed(self.mass),
            false => CoefficientSpec::constant(self.mass),
        };
        let stiffness = self.mass * (TAU * self.truth[0]).powi(2);
        let parts = [
            mass,
            CoefficientSpec::constant(0.8 * self.damping),
            CoefficientSpec::constant(stiffness),
        ];
        let builder = Builder::new(parts).record(record);
        let nodes = 2 * (self.times.len() - 1) + 1;
        builder.nodes(nodes).build().expect("a problem")
    }
}
