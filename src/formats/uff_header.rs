//! Header of a function in a universal file: data set 58, records 6 to 9, and the units of data set 164.
//!
//! Fields stand at fixed columns. Reference: SDRC Universal File Formats, data sets 58 and 164.

use crate::units::{Measurand, Unit};

/// Number of lines of the header.
pub(super) const LINES: usize = 11;
/// Types of functions that are samples in time: general, and time response.
const GENERAL: u32 = 0;
const TIME_RESPONSE: u32 = 1;
/// Type of an abscissa in time, and types that state nothing.
const TIME: u32 = 17;
const UNSTATED: [u32; 2] = [0, 1];

/// Factors from SI to the units of a file: `value in the file = factor * value in SI`.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitFactors {
    pub length: f64,
    pub force: f64,
}

/// Header of a function.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FunctionHeader {
    pub name: String,
    /// Content, unless samples in time.
    pub other: Option<String>,
    /// Numbers of 8 bytes instead of 4.
    pub is_double: bool,
    pub count: usize,
    /// Times beside the samples instead of a first time and an interval.
    pub is_uneven: bool,
    pub start: f64,
    pub step: f64,
    /// Unit of the abscissa, as spelt.
    pub time_unit: String,
    pub unit: Option<String>,
    /// Factor of the numbers to this unit.
    pub scale: f64,
    /// Two numbers for each sample.
    pub is_complex: bool,
}

/// The field at these columns, from 0, without blanks around it.
fn field(line: &str, from: usize, to: usize) -> &str {
    let end = to.min(line.len());
    line.get(from.min(end)..end).unwrap_or_default().trim()
}

fn integer(line: &str, from: usize, to: usize) -> Option<u32> {
    field(line, from, to).parse().ok()
}

/// A number, with D or E before its exponent.
pub(super) fn number(text: &str) -> Option<f64> {
    text.trim().replace(['D', 'd'], "E").parse().ok()
}

/// An axis: type and unit.
fn axis(line: &str) -> (u32, String) {
    let unit = field(line, 47, 67);
    let is_none = unit.eq_ignore_ascii_case("none");
    (
        integer(line, 0, 10).unwrap_or(0),
        if is_none {
            String::new()
        } else {
            unit.to_owned()
        },
    )
}

impl FunctionHeader {
    /// Reads the [`LINES`] of a header.
    ///
    /// # Errors
    /// The index of the line that is invalid, and what it should hold.
    pub fn read(
        lines: &[String],
        units: Option<UnitFactors>,
    ) -> Result<Self, (usize, &'static str)> {
        let line = |i: usize| lines.get(i).map_or("", String::as_str);
        let form = "type, number of samples, spacing, first abscissa and increment in columns of 10, 10, 10, 13 and 13";
        let (ends, form_line) = (line(5), line(6));
        let kind = integer(ends, 0, 5).ok_or((5, "the type of the function in columns 1 to 5"))?;
        let invalid = (6, form);
        let data_type = integer(form_line, 0, 10).ok_or(invalid)?;
        let count = integer(form_line, 10, 20).ok_or(invalid)?;
        let spacing = integer(form_line, 20, 30).ok_or(invalid)?;
        let is_even = spacing == 1;
        let start = number(field(form_line, 30, 43));
        let step = number(field(form_line, 43, 56));
        let (start, step) = match is_even {
            true => (start.ok_or(invalid)?, step.ok_or(invalid)?),
            false => (0.0, 0.0),
        };
        let (abscissa, time_unit) = axis(line(7));
        let (ordinate, label) = axis(line(8));
        let (noun, quantity) = quantity(ordinate);
        let is_complex = matches!(data_type, 5 | 6);
        let other = content(kind, abscissa, is_complex);
        let name = match other {
            Some(_) => function_noun(kind).replace(' ', "_"),
            None => noun.to_owned(),
        };
        let (scale, unit) = match (label.is_empty(), units, quantity) {
            (false, ..) => (1.0, Some(label)),
            (true, Some(units), Some(quantity)) => units.scaled(quantity),
            (true, ..) => (1.0, None),
        };
        Ok(Self {
            name: format!("{name}{}", position(ends)),
            other,
            is_double: matches!(data_type, 4 | 6),
            count: count as usize,
            is_uneven: !is_even,
            start,
            step,
            time_unit,
            unit,
            scale,
            is_complex,
        })
    }
}

/// Node and direction of the response, as in `_12+Z`.
fn position(line: &str) -> String {
    let direction = match field(line, 51, 55).parse::<i32>().unwrap_or(0) {
        1 => "+X",
        2 => "+Y",
        3 => "+Z",
        4 => "+RX",
        5 => "+RY",
        6 => "+RZ",
        -1 => "-X",
        -2 => "-Y",
        -3 => "-Z",
        -4 => "-RX",
        -5 => "-RY",
        -6 => "-RZ",
        _ => "",
    };
    match integer(line, 41, 51).unwrap_or(0) {
        0 if direction.is_empty() => String::new(),
        node => format!("_{node}{direction}"),
    }
}

/// Name and quantity of a type of ordinates.
fn quantity(code: u32) -> (&'static str, Option<Measurand>) {
    match code {
        8 => ("displacement", Some(Measurand::Displacement)),
        9 | 13 => ("force", Some(Measurand::Force)),
        11 => ("velocity", Some(Measurand::Velocity)),
        12 => ("acceleration", Some(Measurand::Acceleration)),
        2 => ("stress", None),
        3 => ("strain", None),
        5 => ("temperature", None),
        15 => ("pressure", None),
        17 => ("time", Some(Measurand::Time)),
        _ => ("channel", None),
    }
}

fn function_noun(kind: u32) -> &'static str {
    match kind {
        GENERAL | TIME_RESPONSE => "time response",
        2 => "auto spectrum",
        3 => "cross spectrum",
        4 => "frequency response function",
        5 => "transmissibility",
        6 => "coherence",
        7 => "autocorrelation",
        8 => "cross correlation",
        9 => "power spectral density",
        10 => "energy spectral density",
        11 => "probability density",
        12 => "spectrum",
        _ => "function",
    }
}

/// Content of a function that is no record in time.
fn content(kind: u32, abscissa: u32, is_complex: bool) -> Option<String> {
    let noun = function_noun(kind);
    let in_time = abscissa == TIME || UNSTATED.contains(&abscissa);
    match (kind, in_time, is_complex) {
        (GENERAL | TIME_RESPONSE, true, false) => None,
        (_, _, true) => Some(format!("a {noun} of complex numbers")),
        (GENERAL | TIME_RESPONSE, false, _) => {
            Some("samples over another axis than time".to_owned())
        }
        _ => Some(format!("a {noun}")),
    }
}

impl UnitFactors {
    /// Unit of a quantity in the file: a factor and a symbol, of SI unless the factor is 1.
    fn scaled(self, quantity: Measurand) -> (f64, Option<String>) {
        let (factor, symbols): (f64, &[(f64, &str)]) = match quantity {
            Measurand::Force => (self.force, &FORCES),
            _ => (self.length, &LENGTHS),
        };
        let known = symbols
            .iter()
            .find(|(of, _)| (factor / of - 1.0).abs() < SAME);
        let after = match quantity {
            Measurand::Velocity => "/s",
            Measurand::Acceleration => "/s²",
            _ => "",
        };
        match (quantity, known) {
            (Measurand::Time, _) => (1.0, Some("s".to_owned())),
            (_, Some((_, symbol))) => (1.0, Some(format!("{symbol}{after}"))),
            (_, None) => (1.0 / factor, Some(Unit::si(quantity).symbol().to_owned())),
        }
    }
}

/// Relative difference below which factors are equal: writers print six digits.
const SAME: f64 = 1e-5;
const LENGTHS: [(f64, &str); 5] = [
    (1.0, "m"),
    (1000.0, "mm"),
    (100.0, "cm"),
    (1.0 / 0.0254, "in"),
    (1.0 / 0.3048, "ft"),
];
const FORCES: [(f64, &str); 6] = [
    (1.0 / 9.806_65, "kgf"),
    (1e5, "dyn"),
    (1.0, "N"),
    (1000.0, "mN"),
    (0.001, "kN"),
    (1.0 / 4.448_221_615_260_5, "lbf"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_follow_from_factors() {
        let units = |length, force| UnitFactors { length, force };
        for (factors, quantity, symbol) in [
            (units(1.0, 1.0), Measurand::Acceleration, "m/s²"),
            (units(1000.0, 1000.0), Measurand::Velocity, "mm/s"),
            (units(1000.0, 1000.0), Measurand::Force, "mN"),
            (units(39.37008, 0.2248089), Measurand::Displacement, "in"),
            (units(39.37008, 0.2248089), Measurand::Force, "lbf"),
            (units(1.0, 0.101_971_6), Measurand::Force, "kgf"),
        ] {
            let unit = (1.0, Some(symbol.to_owned()));
            assert_eq!(factors.scaled(quantity), unit);
        }
        let other = units(4.0, 1.0).scaled(Measurand::Velocity);
        assert_eq!(other, (0.25, Some("m/s".to_owned())));
    }

    #[test]
    fn numbers_of_fortran() {
        assert_eq!(number(" 1.5D-01 "), Some(0.15));
        assert_eq!(number("-2.5e+00"), Some(-2.5));
        assert_eq!(number(""), None);
    }
}
