//! Magnitudes of a record judged together: frequency, amplitude, and the velocity and acceleration that they imply.
//!
//! A response of amplitude `A` at the frequency `f` has
//!
//! ```text
//! displacement A,    velocity 2 pi f A,    acceleration (2 pi f)^2 A
//! ```
//!
//! which for mechanical vibrations lie within known ranges. A wrong unit of time or of the samples leads out of them; the reading that leads
//! back with the fewest changes is named.

use crate::units::{Measurand, Unit};
use kmcfit_core::assessment::Implausible;
use kmcfit_core::number_format::significant;
use kmcfit_core::signal::{Spectrum, median};
use std::f64::consts::{PI, TAU};

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Largest acceleration of a vibration, m/s^2: 500 g, below the frequencies of shocks (Hz).
const ACCELERATION: f64 = 500.0 * GRAVITY;
const SHOCKS: f64 = 1000.0;
/// Largest amplitude of a rotation about a position of rest, rad.
const ANGLE: f64 = PI;
/// Ranges of a reading that is proposed: frequency (Hz), displacement (m or rad), and largest velocity (m/s) and acceleration (m/s^2).
const USUAL_FREQUENCIES: [f64; 2] = [0.05, 5000.0];
const USUAL_DISPLACEMENTS: [f64; 2] = [1e-9, 1.0];
const USUAL_VELOCITY: f64 = 20.0;
const USUAL_ACCELERATION: f64 = 100.0 * GRAVITY;
/// Share of the samples within the amplitude: outliers are beyond it.
const WITHIN: f64 = 0.99;
/// Frequencies of mains, Hz, and the relative distance within which a line is one of them.
const MAINS: [f64; 2] = [50.0, 60.0];
const NEAR_MAINS: f64 = 0.005;
/// Fewest periods of a line in a record, and its smallest density relative to the median of the frequencies around.
const LINE_PERIODS: f64 = 200.0;
const LINE: f64 = 100.0;
/// Frequency spacings on either side of a line that are compared.
const AROUND: [usize; 2] = [4, 10];

/// A channel: measured quantity, unit and amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnitude {
    /// Displacement, velocity or acceleration.
    pub quantity: Measurand,
    /// The unit in which it was read.
    pub unit: Unit,
    /// Amplitude in SI.
    pub amplitude: f64,
}

impl Magnitude {
    /// The magnitude of samples in SI: the deviation from their median within which 99 % of them lie.
    pub fn of(quantity: Measurand, unit: Unit, values: &[f64]) -> Option<Self> {
        let values: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        let last = values.len().checked_sub(1)?;
        let level = median(&*values);
        let mut away: Vec<f64> = values.iter().map(|x| (x - level).abs()).collect();
        let position = (WITHIN * last as f64) as usize;
        let amplitude = *away.select_nth_unstable_by(position, f64::total_cmp).1;
        Some(Self {
            quantity,
            unit,
            amplitude,
        })
    }

    /// The same samples read in another unit.
    fn read_in(self, unit: Unit) -> Self {
        let amplitude = self.amplitude * unit.factor() / self.unit.factor();
        Self {
            unit,
            amplitude,
            ..self
        }
    }

    /// Displacement, velocity and acceleration at a frequency (Hz).
    fn motion(self, frequency: f64) -> [f64; 3] {
        let order = match self.quantity {
            Measurand::Velocity => 1,
            Measurand::Acceleration => 2,
            _ => 0,
        };
        let omega = TAU * frequency;
        [0, 1, 2].map(|other| self.amplitude * omega.powi(other - order))
    }

    fn is_possible(self, frequency: f64) -> bool {
        let [least, most] = Implausible::FREQUENCIES;
        let [y, v, a] = self.motion(frequency);
        let has_frequency = (least..=most).contains(&frequency);
        has_frequency
            && match self.unit.is_angular() {
                true => y <= ANGLE,
                false => {
                    y <= Implausible::DISPLACEMENT
                        && v <= Implausible::VELOCITY
                        && (a <= ACCELERATION || frequency > SHOCKS)
                }
            }
    }

    fn is_usual(self, frequency: f64) -> bool {
        let [least, most] = USUAL_FREQUENCIES;
        let [smallest, largest] = USUAL_DISPLACEMENTS;
        let [y, v, a] = self.motion(frequency);
        let is_small = (v <= USUAL_VELOCITY && a <= USUAL_ACCELERATION) || self.unit.is_angular();
        (least..=most).contains(&frequency) && (smallest..=largest).contains(&y) && is_small
    }

    /// Amplitude with its unit: `4 m`, or an acceleration in g.
    fn in_words(self) -> String {
        let number = significant(self.amplitude / self.unit.factor(), 2);
        format!("{number} {}", self.unit.symbol())
    }
}

/// Units in which the samples of a quantity are read in place of others, the most frequent error first.
fn readings(quantity: Measurand, is_angular: bool) -> &'static [&'static str] {
    match (quantity, is_angular) {
        (Measurand::Time, _) => &["ms", "s", "µs", "min"],
        (Measurand::Displacement, false) => &["mm", "cm", "µm", "in", "m"],
        (Measurand::Displacement, true) => &["deg", "mrad", "rad"],
        (Measurand::Velocity, false) => &["mm/s", "cm/s", "in/s", "m/s"],
        (Measurand::Velocity, true) => &["deg/s", "rad/s"],
        (Measurand::Acceleration, false) => &["m/s²", "g", "mg", "mm/s²"],
        (Measurand::Acceleration, true) => &["deg/s²", "rad/s²"],
        (Measurand::Force, _) => &[],
    }
}

/// Other units of the same quantity and dimension.
fn others(quantity: Measurand, unit: Unit) -> impl Iterator<Item = Unit> {
    let names = readings(quantity, unit.is_angular()).iter();
    let units = names.filter_map(move |name| Unit::recognise(quantity, name));
    units.filter(move |other| *other != unit && !unit.is_arbitrary())
}

/// Magnitudes outside the range of mechanical vibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct ImplausibleMagnitudes {
    /// The magnitudes: `4 m at 0.002 Hz`.
    pub magnitudes: String,
    /// The reading that makes them plausible: `the times read as ms and the displacement read as mm give 2 Hz and 4 mm`.
    pub reading: Option<String>,
}

/// Judges the magnitudes of the channels of a record together; `time` is the unit in which a column of times was read. `None` where they are
/// plausible at the dominant frequency (Hz), or at that which halves the energy: a broad record has its amplitude at neither.
pub fn implausible(
    [frequency, middle]: [f64; 2],
    time: Option<Unit>,
    channels: &[Magnitude],
) -> Option<ImplausibleMagnitudes> {
    let is_possible = |c: &Magnitude| c.is_possible(frequency) || c.is_possible(middle);
    let position = channels.iter().position(|c| !is_possible(c))?;
    let first = channels.get(position)?;
    let acceleration = first.motion(frequency)[2];
    let implied = match first.unit.is_angular()
        || acceleration < USUAL_ACCELERATION
        || first.quantity == Measurand::Acceleration
    {
        true => String::new(),
        false => format!(" ({} g)", significant(acceleration / GRAVITY, 2)),
    };
    let hertz = |frequency: f64| format!("{} Hz", significant(frequency, 2));
    Some(ImplausibleMagnitudes {
        magnitudes: format!("{} at {}{implied}", first.in_words(), hertz(frequency)),
        reading: reading(frequency, time, channels).map(|(time, frequency, read)| {
            let changed = read
                .iter()
                .zip(channels)
                .filter(|(new, old)| new.unit != old.unit);
            let changed = changed.map(|(new, _)| {
                format!("the {} read as {}", new.quantity.name(), new.unit.symbol())
            });
            let time = time.map(|unit| format!("the times read as {}", unit.symbol()));
            let changes: Vec<String> = time.into_iter().chain(changed).collect();
            let amplitude = read
                .get(position)
                .map_or(String::new(), |c| format!(" and {}", c.in_words()));
            let gives = if changes.len() > 1 || time_alone(&changes) {
                "give"
            } else {
                "gives"
            };
            format!(
                "{} {gives} {}{amplitude}",
                changes.join(" and "),
                hertz(frequency)
            )
        }),
    })
}

/// True for a change of the times, which are many.
fn time_alone(changes: &[String]) -> bool {
    changes
        .first()
        .is_some_and(|change| change.starts_with("the times"))
}

/// The fewest changes of units with which all channels are usual: the unit of time, if it changes, frequency and channels.
fn reading(
    frequency: f64,
    time: Option<Unit>,
    channels: &[Magnitude],
) -> Option<(Option<Unit>, f64, Vec<Magnitude>)> {
    let slower = time.into_iter().flat_map(|unit| {
        others(Measurand::Time, unit)
            .map(move |other| (Some(other), frequency * unit.factor() / other.factor()))
    });
    let times = std::iter::once((None, frequency)).chain(slower);
    let each = times.filter_map(|(unit, frequency)| {
        let read = |channel: &Magnitude| {
            let same = std::iter::once(*channel);
            let mut all = same
                .chain(others(channel.quantity, channel.unit).map(|other| channel.read_in(other)));
            all.find(|channel| channel.is_usual(frequency))
        };
        let read: Vec<Magnitude> = channels.iter().map(read).collect::<Option<_>>()?;
        let changes = read
            .iter()
            .zip(channels)
            .filter(|(new, old)| new.unit != old.unit)
            .count();
        Some((
            changes + usize::from(unit.is_some()),
            (unit, frequency, read),
        ))
    });
    // The first of equally few: the order is that of the frequency of the errors.
    each.min_by_key(|(changes, _)| *changes)
        .map(|(_, reading)| reading)
}

/// Frequency (Hz) of a narrow line of a spectrum that is mains hum if the times are read in another unit, with that unit.
pub fn mains_hum(spectrum: &Spectrum, time: Unit) -> Option<(f64, Unit)> {
    let (density, resolution) = (spectrum.density(), spectrum.resolution());
    let units = others(Measurand::Time, time).filter(|unit| unit.factor() < time.factor());
    let mut lines =
        units.flat_map(|unit| MAINS.map(|mains| (mains * unit.factor() / time.factor(), unit)));
    lines.find(|(frequency, _)| {
        let near = (NEAR_MAINS * frequency / resolution).max(1.0) as usize;
        let centre = (frequency / resolution).round() as usize;
        let bins = centre.saturating_sub(near)..=centre + near;
        let peak = bins
            .filter_map(|k| Some((k, *density.get(k)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, peak)) = peak else {
            return false;
        };
        let [inner, outer] = AROUND;
        let sides = (k.saturating_sub(outer)..k.saturating_sub(inner)).chain(k + inner..k + outer);
        let around: Vec<f64> = sides.filter_map(|k| density.get(k).copied()).collect();
        let is_long = frequency / resolution >= LINE_PERIODS;
        is_long && !around.is_empty() && peak > LINE * median(around)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(quantity: Measurand, text: &str) -> Unit {
        Unit::parse(quantity, text).expect("a unit")
    }

    fn of(quantity: Measurand, text: &str, number: f64) -> Magnitude {
        let unit = unit(quantity, text);
        Magnitude {
            quantity,
            unit,
            amplitude: number * unit.factor(),
        }
    }

    fn judged(frequency: f64, channels: &[Magnitude]) -> Option<(String, Option<String>)> {
        let found = implausible([frequency; 2], Some(unit(Measurand::Time, "s")), channels)?;
        Some((found.magnitudes, found.reading))
    }

    #[test]
    fn implausible_magnitudes_have_a_reading() {
        let displacement = |number: f64| [of(Measurand::Displacement, "m", number)];
        let acceleration = |number: f64| [of(Measurand::Acceleration, "g", number)];
        let text = |text: &str| Some(text.to_owned());
        // Milliseconds and millimetres read as s and m.
        assert_eq!(
            judged(0.002, &displacement(4.0)),
            Some((
                "4 m at 0.002 Hz".into(),
                text("the times read as ms and the displacement read as mm give 2 Hz and 4 mm")
            ))
        );
        // Millimetres read as m.
        assert_eq!(
            judged(2.0, &displacement(4.0)),
            Some((
                "4 m at 2 Hz".into(),
                text("the displacement read as mm gives 2 Hz and 4 mm")
            ))
        );
        // m/s^2 read as g.
        assert_eq!(
            judged(10.0, &acceleration(900.0)),
            Some((
                "900 g at 10 Hz".into(),
                text("the acceleration read as m/s² gives 10 Hz and 900 m/s²")
            ))
        );
        // Milliseconds read as s.
        assert_eq!(
            judged(0.003, &displacement(0.001)),
            Some((
                "0.001 m at 0.003 Hz".into(),
                text("the times read as ms give 3 Hz and 0.001 m")
            ))
        );
        // Degrees read as rad.
        assert_eq!(
            judged(0.1, &[of(Measurand::Displacement, "rad", 20.0)]),
            Some((
                "20 rad at 0.1 Hz".into(),
                text("the displacement read as deg gives 0.1 Hz and 20 deg")
            ))
        );
    }

    /// From a moored platform (10 m in 100 s) to a shock (2000 g at 5 kHz) and a resonator (1 nm at 32 kHz).
    #[test]
    fn real_vibrations_are_plausible() {
        for (frequency, quantity, text, number) in [
            (0.01, Measurand::Displacement, "m", 9.0),
            (0.1, Measurand::Displacement, "m", 1.0),
            (2.0, Measurand::Displacement, "mm", 40.0),
            (5000.0, Measurand::Acceleration, "g", 2000.0),
            (32768.0, Measurand::Displacement, "µm", 1e-3),
            (30.0, Measurand::Acceleration, "g", 20.0),
            (0.2, Measurand::Displacement, "deg", 30.0),
            (12.0, Measurand::Velocity, "m/s", 3.0),
        ] {
            assert_eq!(
                judged(frequency, &[of(quantity, text, number)]),
                None,
                "{number} {text}"
            );
        }
    }

    /// A line at 0.05 Hz over 400 periods beside noise: 50 Hz in ms. A decay at that frequency is broad; no unit is smaller than µs.
    #[test]
    fn mains_hum_shows_milliseconds() {
        let seconds = unit(Measurand::Time, "s");
        let of = |values: &[f64]| Spectrum::of(values, 1.0).expect("it varies");
        let noise =
            |i: usize| f64::from((i as u32).wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
        let hum: Vec<f64> = (0..8000)
            .map(|i| noise(i) + (TAU * 0.05 * i as f64).sin())
            .collect();
        assert_eq!(
            mains_hum(&of(&hum), seconds),
            Some((0.05, unit(Measurand::Time, "ms")))
        );
        let decay =
            |i: usize| (-0.01 * TAU * 0.05 * i as f64).exp() * (TAU * 0.05 * i as f64).sin();
        let decay: Vec<f64> = (0..8000).map(|i| 0.02 * noise(i) + decay(i)).collect();
        assert_eq!(mains_hum(&of(&decay), seconds), None);
        assert_eq!(mains_hum(&of(&hum), unit(Measurand::Time, "µs")), None);
    }

    #[test]
    fn the_amplitude_excludes_outliers() {
        let mut values: Vec<f64> = (0..1000).map(|i| 2.0 + (f64::from(i)).sin()).collect();
        values[10] = 1e6;
        let found = Magnitude::of(
            Measurand::Displacement,
            unit(Measurand::Displacement, "m"),
            &values,
        )
        .expect("samples");
        assert!((found.amplitude - 1.0).abs() < 0.02, "{}", found.amplitude);
    }
}
