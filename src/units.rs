//! Units of measured quantities and their factors to SI.
//!
//! For rotational systems displacements are angles in rad, forces are torques in N m, and the mass is a moment of
//! inertia in kg m². Volts denote uncalibrated samples, which are not converted.

use crate::error::InputError;
use crate::spelling::nearest;
use crate::text_io::{one_of, quote};

/// Standard gravity, m/s² (ISO 80000-3).
const GRAVITY: f64 = 9.806_65;

/// Degrees to radians.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// International inch and foot, m; pound-force, N.
const INCH: f64 = 0.0254;
const FOOT: f64 = 0.3048;
const POUND_FORCE: f64 = 0.453_592_37 * GRAVITY;

/// Measured quantity of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
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

impl Quantity {
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

    fn units(self) -> &'static [Unit] {
        match self {
            Self::Displacement => &DISPLACEMENT,
            Self::Velocity => &VELOCITY,
            Self::Acceleration => &ACCELERATION,
            Self::Force => &FORCE,
            Self::Time => &TIME,
        }
    }
}

/// Motion that a unit belongs to: translation, rotation, or either.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dimension {
    Linear,
    Angular,
    Either,
}

/// A unit of one kind of channel: `value in SI = factor * value`.
///
/// ```
/// use kmcfit::units::{Quantity, Unit};
/// let unit = Unit::parse(Quantity::Acceleration, "[g]")?;
/// assert_eq!((unit.symbol(), unit.factor()), ("g", 9.80665));
/// assert_eq!(Unit::parse(Quantity::Acceleration, "m/s^2")?.symbol(), "m/s²");
/// assert!(Unit::parse(Quantity::Force, "g").is_err());
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    symbol: &'static str,
    /// Other spellings, as [`plain`] makes them.
    others: &'static [&'static str],
    factor: f64,
    dimension: Dimension,
}

impl Unit {
    /// The SI unit for translation.
    pub fn si(kind: Quantity) -> Self {
        kind.units()[0]
    }

    /// The unit named by a text, or `None` if it names none of this quantity.
    ///
    /// Brackets around it do not count, nor do blanks and signs between factors; `²`, `^2`, `**2`
    /// and `2` are the same, as are `µ`, `u` and `μ`. Capitals count, since `mN` is not `MN`.
    pub fn recognise(kind: Quantity, text: &str) -> Option<Self> {
        let wanted = plain(text);
        let named =
            |unit: &&Self| wanted == plain(unit.symbol) || unit.others.contains(&wanted.as_str());
        kind.units().iter().find(named).copied()
    }

    /// The unit that a text names.
    ///
    /// # Errors
    ///
    /// When there is no such unit of this kind; the place is an argument of the kind's name.
    pub fn parse(kind: Quantity, text: &str) -> Result<Self, InputError> {
        Self::recognise(kind, text).ok_or_else(|| unknown(kind, text))
    }

    /// The symbols of all units of a kind.
    pub fn symbols(kind: Quantity) -> impl Iterator<Item = &'static str> {
        kind.units().iter().map(|unit| unit.symbol)
    }

    /// True for a unit of any quantity, or any text in brackets: a field of a row of units.
    pub fn looks_like(text: &str) -> bool {
        let known = || {
            Quantity::ALL
                .iter()
                .any(|&k| Self::recognise(k, text).is_some())
        };
        let other = || OTHERS.contains(&plain(text).as_str());
        unbracketed(text) != text.trim() || known() || other()
    }

    /// Its symbol, for instance `m/s²`.
    pub fn symbol(&self) -> &'static str {
        self.symbol
    }

    /// Factor from this unit to SI; 1 for volts.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// True for units of angles and torques.
    pub fn is_angular(&self) -> bool {
        self.dimension == Dimension::Angular
    }

    /// True for uncalibrated units: volts.
    pub fn is_arbitrary(&self) -> bool {
        self.symbol == VOLT.symbol
    }
}

/// A unit with a factor: samples in multiples of it, as `50 g` for an accelerometer whose full scale is 50 g.
///
/// ```
/// use kmcfit::units::{Quantity, ScaledUnit};
/// let scaled = ScaledUnit::parse(Quantity::Force, "250 N")?;
/// assert_eq!((scaled.factor(), scaled.unit.symbol()), (250.0, "N"));
/// assert_eq!(ScaledUnit::parse(Quantity::Force, "kN")?.factor(), 1000.0);
/// assert!(ScaledUnit::parse(Quantity::Force, "0 N").is_err());
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
    /// The unit that a text names, with the number before it, if any.
    ///
    /// # Errors
    ///
    /// As [`Unit::parse`], and when the number is zero or not finite.
    pub fn parse(kind: Quantity, text: &str) -> Result<Self, InputError> {
        let (scale, unit) = split_factor(text);
        if scale == 0.0 || !scale.is_finite() {
            let place = format!("unit of the {}", kind.name());
            return Err(InputError::argument(place, "invalid factor of a unit")
                .found(quote(text))
                .expected("a finite number other than 0 before the unit, as in `50 g`"));
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
fn unknown(kind: Quantity, text: &str) -> InputError {
    let error = InputError::argument(format!("unit of the {}", kind.name()), "unknown unit")
        .found(quote(text))
        .expected(one_of(Unit::symbols(kind)));
    let of_other = Quantity::ALL
        .iter()
        .find(|&&other| Unit::recognise(other, text).is_some());
    if let Some(other) = of_other {
        return error.hint(format!("this is a unit of {}", other.name()));
    }
    let wanted = plain(text);
    let spellings = kind.units().iter().flat_map(|unit| {
        let all = std::iter::once(unit.symbol).chain(unit.others.iter().copied());
        all.map(move |spelling| (spelling, unit.symbol))
    });
    let spellings: Vec<(&str, &str)> = spellings.collect();
    match nearest(&wanted, spellings.iter().map(|(spelling, _)| *spelling)) {
        Some(near) => {
            let symbol = spellings.iter().find(|(spelling, _)| *spelling == near);
            let symbol = symbol.map_or(near, |(_, symbol)| symbol);
            error.hint(format!("did you mean `{symbol}`?"))
        }
        None => error,
    }
}

/// A unit as it is compared: no brackets, blanks or signs of powers and products.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    for c in unbracketed(text).chars() {
        match c {
            ' ' | '^' | '*' | '·' | '⋅' | '.' => {}
            '²' => plain.push('2'),
            '⁻' | '−' => plain.push('-'),
            '¹' => plain.push('1'),
            'µ' | 'μ' => plain.push('u'),
            '°' => plain.push_str("deg"),
            c => plain.push(c),
        }
    }
    plain
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

const fn unit(
    symbol: &'static str,
    others: &'static [&'static str],
    factor: f64,
    dimension: Dimension,
) -> Unit {
    Unit {
        symbol,
        others,
        factor,
        dimension,
    }
}

use Dimension::{Angular, Either, Linear};

const VOLT: Unit = unit("V", &["volt", "Volt", "volts", "Volts"], 1.0, Either);

const DISPLACEMENT: [Unit; 10] = [
    unit("m", &["meter", "metre", "meters", "metres"], 1.0, Linear),
    unit("mm", &["millimeter", "millimetre"], 1e-3, Linear),
    unit("cm", &["centimeter", "centimetre"], 1e-2, Linear),
    unit("µm", &["micron", "microns"], 1e-6, Linear),
    unit("in", &["inch", "inches"], INCH, Linear),
    unit("ft", &["foot", "feet"], FOOT, Linear),
    unit("rad", &["radian", "radians"], 1.0, Angular),
    unit("mrad", &[], 1e-3, Angular),
    unit("deg", &["degree", "degrees"], DEGREE, Angular),
    VOLT,
];

const VELOCITY: [Unit; 8] = [
    unit("m/s", &["ms-1", "m/sec"], 1.0, Linear),
    unit("mm/s", &["mms-1", "mm/sec"], 1e-3, Linear),
    unit("cm/s", &["cms-1", "cm/sec"], 1e-2, Linear),
    unit("in/s", &["ins-1", "in/sec", "ips"], INCH, Linear),
    unit("ft/s", &["fts-1", "ft/sec"], FOOT, Linear),
    unit("rad/s", &["rads-1", "rad/sec"], 1.0, Angular),
    unit("deg/s", &["degs-1", "deg/sec"], DEGREE, Angular),
    VOLT,
];

const ACCELERATION: [Unit; 10] = [
    unit("m/s²", &["ms-2", "m/s/s", "m/sec2"], 1.0, Linear),
    unit("mm/s²", &["mms-2", "mm/s/s", "mm/sec2"], 1e-3, Linear),
    unit("g", &["G", "gn", "g0"], GRAVITY, Linear),
    unit("mg", &["mG"], 1e-3 * GRAVITY, Linear),
    unit("gal", &["Gal", "cm/s2"], 1e-2, Linear),
    unit("in/s²", &["ins-2", "in/s/s", "in/sec2"], INCH, Linear),
    unit("ft/s²", &["fts-2", "ft/s/s", "ft/sec2"], FOOT, Linear),
    unit("rad/s²", &["rads-2", "rad/s/s"], 1.0, Angular),
    unit("deg/s²", &["degs-2", "deg/s/s"], DEGREE, Angular),
    VOLT,
];

const FORCE: [Unit; 7] = [
    unit("N", &["newton", "Newton", "newtons"], 1.0, Linear),
    unit("kN", &[], 1e3, Linear),
    unit("mN", &[], 1e-3, Linear),
    unit("lbf", &["lb", "lbs"], POUND_FORCE, Linear),
    unit("N m", &["N-m"], 1.0, Angular),
    unit("mN m", &["mN-m"], 1e-3, Angular),
    VOLT,
];

const TIME: [Unit; 4] = [
    unit("s", &["sec", "second", "seconds"], 1.0, Either),
    unit("ms", &["msec", "millisecond", "milliseconds"], 1e-3, Either),
    unit("µs", &["usec", "microsecond", "microseconds"], 1e-6, Either),
    unit("min", &["minute", "minutes"], 60.0, Either),
];

/// Units of other quantities that occur in rows of units.
const OTHERS: [&str; 17] = [
    "mV", "uV", "A", "mA", "Hz", "kHz", "rpm", "1/min", "%", "degC", "degF", "K", "bar", "Pa",
    "kPa", "kg", "W",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_of_the_definitions() {
        for (kind, text, factor, angular) in [
            (Quantity::Displacement, "um", 1e-6, false),
            (Quantity::Displacement, "µm", 1e-6, false),
            (Quantity::Displacement, "in", 0.0254, false),
            (Quantity::Displacement, "ft", 12.0 * 0.0254, false),
            (
                Quantity::Displacement,
                "°",
                std::f64::consts::PI / 180.0,
                true,
            ),
            (Quantity::Displacement, "mrad", 1e-3, true),
            (Quantity::Velocity, "cm/s", 1e-2, false),
            (
                Quantity::Velocity,
                "deg/s",
                std::f64::consts::PI / 180.0,
                true,
            ),
            (Quantity::Acceleration, "m/s2", 1.0, false),
            (Quantity::Acceleration, "m s^-2", 1.0, false),
            (Quantity::Acceleration, "(m/s²)", 1.0, false),
            (Quantity::Acceleration, "mg", 9.80665e-3, false),
            (Quantity::Acceleration, "cm/s²", 1e-2, false),
            (Quantity::Acceleration, "rad/s**2", 1.0, true),
            (Quantity::Force, "lbf", 4.448_221_615_260_5, false),
            (Quantity::Force, "mN", 1e-3, false),
            (Quantity::Force, "Nm", 1.0, true),
            (Quantity::Force, "N·m", 1.0, true),
            (Quantity::Force, "N-m", 1.0, true),
            (Quantity::Force, "V", 1.0, false),
            (Quantity::Time, "[us]", 1e-6, false),
            (Quantity::Time, "min", 60.0, false),
        ] {
            let unit = Unit::parse(kind, text).unwrap();
            // The factors are products of two exact decimals: one rounding each.
            assert!((unit.factor() / factor - 1.0).abs() < 1e-15, "{text}");
            assert_eq!(unit.is_angular(), angular, "{text}");
        }
        assert!(Unit::parse(Quantity::Velocity, "V").unwrap().is_arbitrary());
        assert!(!Unit::si(Quantity::Time).is_arbitrary());
    }

    #[test]
    fn every_symbol_names_its_unit_alone() {
        for kind in Quantity::ALL {
            for unit in kind.units() {
                let spellings = std::iter::once(&unit.symbol).chain(unit.others);
                for spelling in spellings {
                    assert_eq!(Unit::recognise(kind, spelling), Some(*unit), "{spelling}");
                }
            }
        }
    }

    #[test]
    fn unknown_units_are_refused_with_a_hint() {
        let message = |kind, text| Unit::parse(kind, text).unwrap_err().to_string();
        assert_eq!(
            message(Quantity::Time, "hours"),
            "unit of the time: unknown unit\n  found: `hours`\n  expected: one of: s, ms, µs, min"
        );
        assert!(message(Quantity::Force, "m/s²").ends_with("hint: this is a unit of acceleration"));
        assert!(message(Quantity::Force, "newtn").ends_with("hint: did you mean `N`?"));
        assert!(message(Quantity::Force, "kn").ends_with("hint: did you mean `kN`?"));
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
