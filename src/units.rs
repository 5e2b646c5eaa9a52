//! Units of measured quantities and their factors to SI.
//!
//! For rotational systems displacements are angles in rad, forces are torques in N m, and the mass is a moment of
//! inertia in kg m². Volts denote uncalibrated samples, which are not converted.

mod spelling;

use crate::error::InputError;
use crate::spelling::nearest;
use crate::text_io::{one_of, quote};
use kmcfit_core::record::ChannelKind;
use spelling::{names, product};

/// Measured quantity of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measurand {
    /// Displacement or angle; SI: m or rad.
    Displacement,
    /// Velocity; SI: m/s or rad/s.
    Velocity,
    /// Acceleration; SI: m/s² or rad/s².
    Acceleration,
    /// Force or torque; SI: N or N m.
    Force,
    /// Time; SI: s.
    Time,
}

impl From<ChannelKind> for Measurand {
    fn from(kind: ChannelKind) -> Self {
        match kind {
            ChannelKind::Displacement => Self::Displacement,
            ChannelKind::Velocity => Self::Velocity,
            ChannelKind::Acceleration => Self::Acceleration,
        }
    }
}

impl Measurand {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::Displacement,
        Self::Velocity,
        Self::Acceleration,
        Self::Force,
        Self::Time,
    ];

    /// Its name, in small letters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Force => "force",
            Self::Time => "time",
        }
    }

    /// Symbols of usual units, that of SI for translation first.
    fn symbols(self) -> &'static [&'static str] {
        match self {
            Self::Displacement => &["m", "mm", "cm", "µm", "in", "ft", "rad", "mrad", "deg", "V"],
            Self::Velocity => &["m/s", "mm/s", "cm/s", "in/s", "ft/s", "rad/s", "deg/s", "V"],
            Self::Acceleration => &[
                "m/s²", "mm/s²", "g", "mg", "gal", "in/s²", "ft/s²", "rad/s²", "deg/s²", "V",
            ],
            Self::Force => &["N", "kN", "mN", "lbf", "kgf", "N m", "mN m", "V"],
            Self::Time => &["s", "ms", "µs", "min"],
        }
    }

    /// Powers of length, time, force, angle and voltage; the second of rotation.
    fn dimensions(self) -> [Powers; 2] {
        match self {
            Self::Displacement => [[1, 0, 0, 0, 0], [0, 0, 0, 1, 0]],
            Self::Velocity => [[1, -1, 0, 0, 0], [0, -1, 0, 1, 0]],
            Self::Acceleration => [[1, -2, 0, 0, 0], [0, -2, 0, 1, 0]],
            Self::Force => [[0, 0, 1, 0, 0], [1, 0, 1, 0, 0]],
            Self::Time => [[0, 1, 0, 0, 0]; 2],
        }
    }
}

/// Powers of length, time, force, angle and voltage.
type Powers = [i8; 5];

const VOLT: Powers = [0, 0, 0, 0, 1];

/// A unit: `value in SI = factor * value`.
///
/// ```
/// use kmcfit::units::{Measurand, Unit};
/// let unit = Unit::parse(Measurand::Acceleration, "[g]")?;
/// assert_eq!((unit.symbol(), unit.factor()), ("g", 9.80665));
/// assert_eq!(Unit::parse(Measurand::Acceleration, "m/s^2")?.symbol(), "m/s²");
/// assert!(Unit::parse(Measurand::Force, "g").is_err());
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    symbol: Symbol,
    factor: f64,
    powers: Powers,
}

/// A short text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Symbol {
    bytes: [u8; 16],
    length: usize,
}

impl Symbol {
    fn of(text: &str) -> Option<Self> {
        let mut bytes = [0; 16];
        bytes
            .get_mut(..text.len())?
            .copy_from_slice(text.as_bytes());
        let length = text.len();
        Some(Self { bytes, length })
    }
}

impl Unit {
    /// The SI unit for translation.
    pub fn si(kind: Measurand) -> Self {
        let symbol = kind.symbols()[0];
        Self {
            symbol: Symbol::of(symbol).unwrap_or(Symbol {
                bytes: [0; 16],
                length: 0,
            }),
            factor: 1.0,
            powers: kind.dimensions()[0],
        }
    }

    /// The unit named by a text, or `None` if it names none of this quantity. Volts belong to every quantity but time.
    ///
    /// A unit is a product of names with prefixes and powers: `mm/s^2`, `cm s⁻²`, `kN·m`, `inches per second squared`. Brackets around it do
    /// not count; capitals do, since `mN` is not `MN`, but where all letters are capital.
    pub fn recognise(kind: Measurand, text: &str) -> Option<Self> {
        Self::any(text).filter(|unit| unit.is_of(kind))
    }

    /// The unit of any quantity that a text names.
    pub fn any(text: &str) -> Option<Self> {
        let is_of_quantity = |unit: &Self| Measurand::ALL.iter().any(|kind| unit.is_of(*kind));
        product(text).filter(is_of_quantity)
    }

    pub(crate) fn is_of(&self, kind: Measurand) -> bool {
        kind.dimensions().contains(&self.powers) || self.powers == VOLT && kind != Measurand::Time
    }

    /// The unit that a text names.
    ///
    /// # Errors
    ///
    /// When there is no such unit of this kind; the place is an argument of the kind's name.
    pub fn parse(kind: Measurand, text: &str) -> Result<Self, InputError> {
        Self::recognise(kind, text).ok_or_else(|| unknown(kind, text))
    }

    /// The symbols of usual units of a kind.
    pub fn symbols(kind: Measurand) -> impl Iterator<Item = &'static str> {
        kind.symbols().iter().copied()
    }

    /// True for a unit of any quantity, or any text in brackets: a field of a row of units.
    pub fn looks_like(text: &str) -> bool {
        let other = || OTHERS.contains(&unbracketed(text).trim());
        // `Second` is the name of a column.
        let is_name = |text: &str| {
            let mut rest = text.trim().chars();
            rest.next().is_some_and(char::is_uppercase)
                && text.len() > 3
                && rest.all(char::is_lowercase)
        };
        unbracketed(text) != text.trim() || product(text).is_some() && !is_name(text) || other()
    }

    /// Its symbol, for instance `m/s²`.
    pub fn symbol(&self) -> &str {
        let bytes = self.symbol.bytes.get(..self.symbol.length);
        std::str::from_utf8(bytes.unwrap_or_default()).unwrap_or_default()
    }

    /// Factor from this unit to SI; from a voltage to V.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// True for units of angles and torques.
    pub fn is_angular(&self) -> bool {
        self.powers[3] != 0 || self.powers == Measurand::Force.dimensions()[1]
    }

    /// True for uncalibrated units: volts.
    pub fn is_arbitrary(&self) -> bool {
        self.powers == VOLT
    }
}

/// A unit with a factor: samples in multiples of it, as `50 g` for an accelerometer whose full scale is 50 g.
///
/// ```
/// use kmcfit::units::{Measurand, ScaledUnit};
/// let scaled = ScaledUnit::parse(Measurand::Force, "250 N", None)?;
/// assert_eq!((scaled.factor(), scaled.unit.symbol()), (250.0, "N"));
/// let sensor = ScaledUnit::parse(Measurand::Acceleration, "100 mV/g", None)?;
/// assert!((sensor.factor() - 98.0665).abs() < 1e-12);
/// assert!(ScaledUnit::parse(Measurand::Force, "0 N", None).is_err());
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledUnit {
    /// Number of units in one of the file.
    pub scale: f64,
    /// The unit.
    pub unit: Unit,
}

impl From<Unit> for ScaledUnit {
    fn from(unit: Unit) -> Self {
        Self { scale: 1.0, unit }
    }
}

impl ScaledUnit {
    /// The unit that a text names, with the number before it, if any; or the sensitivity of a sensor, `10 V/(m/s²)`, with the unit of the
    /// voltages in the file.
    ///
    /// # Errors
    ///
    /// As [`Unit::parse`], and when the number is zero or not finite.
    pub fn parse(kind: Measurand, text: &str, in_file: Option<Unit>) -> Result<Self, InputError> {
        let (scale, unit) = split_factor(text);
        if scale == 0.0 || !scale.is_finite() {
            let location = format!("unit of the {}", kind.name());
            return Err(InputError::argument(location, "invalid factor of a unit")
                .found(quote(text))
                .expected("a finite number other than 0 before the unit, as in `50 g`"));
        }
        let sensitivity = product(unit).and_then(|sensitivity| {
            let [mut powers, mut rotation] = kind.dimensions().map(|own| own.map(|power| -power));
            powers[4] += 1;
            rotation[4] += 1;
            [powers, rotation]
                .iter()
                .position(|p| *p == sensitivity.powers)
                .map(|i| (sensitivity, i))
        });
        if let Some((sensitivity, i)) = sensitivity {
            let si = match i {
                0 => Unit::si(kind),
                _ => Unit::parse(kind, ROTATION[kind as usize])?,
            };
            let volts = in_file
                .filter(Unit::is_arbitrary)
                .map_or(1.0, |unit| unit.factor);
            return Ok(Self {
                scale: volts / (scale * sensitivity.factor),
                unit: si,
            });
        }
        let unit = Unit::parse(kind, unit)?;
        Ok(Self { scale, unit })
    }

    /// Factor from the numbers of the file to SI.
    pub fn factor(&self) -> f64 {
        self.scale * self.unit.factor()
    }
}

/// The number before a unit, 1 without one, and the unit.
pub(crate) fn split_factor(text: &str) -> (f64, &str) {
    let text = text.trim();
    let factor = text.split_once(' ').and_then(|(number, unit)| {
        let factor: f64 = number.parse().ok()?;
        Some((factor, unit.trim()))
    });
    factor.unwrap_or((1.0, text))
}

/// The error for a text that is no unit of this kind.
fn unknown(kind: Measurand, text: &str) -> InputError {
    let error = InputError::argument(format!("unit of the {}", kind.name()), "unknown unit")
        .found(quote(text))
        .expected(one_of(Unit::symbols(kind)));
    let of_other = Measurand::ALL
        .iter()
        .find(|&&other| Unit::recognise(other, text).is_some());
    if let Some(other) = of_other {
        return error.hint(format!("this is a unit of {}", other.name()));
    }
    let names = Unit::symbols(kind).chain(names());
    let near = nearest(text.trim(), names).and_then(|near| Unit::recognise(kind, near));
    error.hint_if(near.map(|near| format!("did you mean `{}`?", near.symbol())))
}

/// A text without brackets around it.
pub(crate) fn unbracketed(text: &str) -> &str {
    let text = text.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(inner) = text.strip_prefix(open).and_then(|t| t.strip_suffix(close)) {
            return inner.trim();
        }
    }
    text
}

/// Symbols of SI for rotation, in the order of [`Measurand`].
const ROTATION: [&str; 5] = ["rad", "rad/s", "rad/s²", "N m", "s"];

/// Units of other quantities that occur in rows of units.
const OTHERS: [&str; 25] = [
    "uV", "A", "mA", "Hz", "kHz", "rpm", "1/min", "%", "degC", "°C", "degF", "°F", "K", "bar",
    "Pa", "kPa", "MPa", "psi", "kg", "W", "counts", "dB", "ohm", "lsb", "C",
];

#[cfg(test)]
mod tests {
    use super::spelling::{DEGREE, GRAVITY};
    use super::*;

    #[test]
    fn factors_are_those_of_the_definitions() {
        use Measurand::{Acceleration, Displacement, Force, Time, Velocity};
        for (kind, texts, factor, symbol) in [
            (Displacement, "um|µm|[µm]|micron|micrometers", 1e-6, "µm"),
            (Displacement, "in|inch|inches|INCH", 0.0254, "in"),
            (Displacement, "ft|feet", 12.0 * 0.0254, "ft"),
            (Displacement, "mil|mils|thou", 25.4e-6, "mil"),
            (Displacement, "°|deg|degrees|DEG", DEGREE, "deg"),
            (Displacement, "mrad|milliradian", 1e-3, "mrad"),
            (Displacement, "mm|MM|millimetres|millimeter", 1e-3, "mm"),
            (
                Velocity,
                "cm/s|cm s-1|cms-1|cm·s⁻¹|centimeters per second",
                1e-2,
                "cm/s",
            ),
            (Velocity, "km/h", 1000.0 / 3600.0, "km/h"),
            (
                Velocity,
                "deg/s|°/s|deg/sec|degrees per second",
                DEGREE,
                "deg/s",
            ),
            (
                Acceleration,
                "m/s2|m s^-2|(m/s²)|m/s^2|m/s**2|ms-2|ms⁻²|m/s/s|m/sec2|m/sec^2|m/(s^2)|m.s-2|M/S**2|metres per second squared|m/s^(2)|ms2",
                1.0,
                "m/s²",
            ),
            (Acceleration, "cm/s/s|cm/s²|cm/sec^2|cm s^-2", 1e-2, "cm/s²"),
            (Acceleration, "g|G|gn|g0", GRAVITY, "g"),
            (Acceleration, "mg|mG", 1e-3 * GRAVITY, "mg"),
            (Acceleration, "%g|% g", 1e-2 * GRAVITY, "%g"),
            (Acceleration, "gal|Gal|GAL", 1e-2, "gal"),
            (Acceleration, "mm/s²|mms-2", 1e-3, "mm/s²"),
            (Acceleration, "rad/s**2|rad/s/s", 1.0, "rad/s²"),
            (Force, "lbf|lb|lbs|LBF|pounds", 4.448_221_615_260_5, "lbf"),
            (Force, "kip|kips|klbf", 4_448.221_615_260_5, "kip"),
            (Force, "kgf|kp|KP", GRAVITY, "kgf"),
            (Force, "daN|decanewton", 10.0, "daN"),
            (Force, "MN", 1e6, "MN"),
            (Force, "kN|KN", 1e3, "kN"),
            (Force, "dyn|dynes", 1e-5, "dyn"),
            (Force, "Nm|N·m|N-m|N m|N*m|Newton metres", 1.0, "N m"),
            (
                Force,
                "lbf ft|ft-lbf|lb-ft|ftlb",
                4.448_221_615_260_5 * 0.3048,
                "lbf ft",
            ),
            (Force, "Nmm|N mm", 1e-3, "N mm"),
            (Force, "V", 1.0, "V"),
            (Force, "mV|MilliVolts", 1e-3, "mV"),
            (Time, "[us]|µs|usec|microseconds", 1e-6, "µs"),
            (Time, "s|sec|Seconds|SEC|seconds since 2024-01-10", 1.0, "s"),
            (Time, "ns", 1e-9, "ns"),
            (Time, "min|minutes", 60.0, "min"),
            (Time, "h|hours", 3600.0, "h"),
        ] {
            for text in texts.split('|') {
                let unit =
                    Unit::parse(kind, text).unwrap_or_else(|error| panic!("{text}: {error}"));
                assert!((unit.factor() / factor - 1.0).abs() < 1e-14, "{text}");
                if !["micron", "klbf", "ft-lbf", "lb-ft", "ftlb"].contains(&text) {
                    assert_eq!(unit.symbol(), symbol, "{text}");
                }
                assert_eq!(Unit::recognise(kind, unit.symbol()), Some(unit), "{text}");
            }
        }
        assert!(
            Unit::parse(Measurand::Velocity, "V")
                .unwrap()
                .is_arbitrary()
        );
        assert!(!Unit::si(Measurand::Time).is_arbitrary());
    }

    #[test]
    fn other_texts_are_no_units() {
        for text in [
            "", "t", "off", "12", "kg", "dBm", "Pa", "Hz", "m/", "/s", "m//s", "(m", "m)", "m^9",
            "s²", "rpm", "counts", "x", "left", "50 g", "mkg", "kg m", "m s", "Grad",
        ] {
            assert_eq!(Unit::any(text), None, "{text}");
        }
    }

    #[test]
    fn sensitivities_of_sensors() {
        let parse = |kind, text, of_file: Option<&str>| {
            let of_file = of_file.and_then(|unit| Unit::recognise(kind, unit));
            ScaledUnit::parse(kind, text, of_file).unwrap().factor()
        };
        use Measurand::{Acceleration, Displacement, Force};
        for (kind, text, of_file, factor) in [
            (Acceleration, "10 V/(m/s2)", None, 0.1),
            (Acceleration, "100 mV/g", Some("V"), 10.0 * GRAVITY),
            (Acceleration, "100 mV/g", Some("mV"), 0.01 * GRAVITY),
            (Force, "2 mV/N", None, 500.0),
            (Displacement, "5 V/mm", None, 2e-4),
            (Displacement, "1 V/deg", None, DEGREE),
            (Acceleration, "50 g", None, 50.0 * GRAVITY),
        ] {
            let found = parse(kind, text, of_file);
            assert!((found / factor - 1.0).abs() < 1e-14, "{text}: {found}");
        }
    }

    #[test]
    fn unknown_units_are_refused_with_a_hint() {
        let message = |kind, text| Unit::parse(kind, text).unwrap_err().to_string();
        assert_eq!(
            message(Measurand::Time, "weeks"),
            "unit of the time: unknown unit\n  found: `weeks`\n  expected: one of: s, ms, µs, min"
        );
        assert!(
            message(Measurand::Force, "m/s²").ends_with("hint: this is a unit of acceleration")
        );
        assert!(message(Measurand::Force, "newtn").ends_with("hint: did you mean `N`?"));
        assert!(message(Measurand::Force, "kn").ends_with("hint: did you mean `kN`?"));
    }

    #[test]
    fn rows_of_units_are_recognised() {
        for text in ["s", "m/s²", "(g)", "[whatever]", "N", "°C", "mV", "Hz"] {
            assert!(Unit::looks_like(text), "{text}");
        }
        for text in ["", "t", "off", "12", "y_m"] {
            assert!(!Unit::looks_like(text), "{text}");
        }
    }
}
