//! Meaning of the names of attributes, properties, small variables and lines beside samples: the one table of these names.

use crate::units::{Measurand, Unit};

/// Meaning of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// Sampling rate, Hz.
    Rate,
    /// Sampling interval, s.
    Interval,
    /// Time of the first sample on the axis of the times, s.
    Start,
    /// Time of the first sample, s, or date: its difference from that of other channels counts.
    Begin,
    /// Unit of the samples.
    Unit,
    /// Unit of the times, of the interval, or of the rate.
    UnitOfTimes,
    UnitOfRate,
    /// A sentence, which can have a unit.
    Description,
    /// Factor of counts, and what is added to their product.
    Factor,
    Offset,
    /// A scale or a clock that no convention defines: it is named, and not applied.
    Unapplied,
}

/// Names in small letters and without signs.
const NAMES: [(Meaning, &str); 10] = [
    (
        Meaning::Rate,
        "fs sr rate samplerate samplingrate samplefrequency samplingfrequency samplefreq samplingfreq \
         sampfreq actualrate fsamp sps samplespersecond samprate",
    ),
    (
        Meaning::Interval,
        "dt ts deltat deltax samplinginterval sampleinterval samplingperiod sampleperiod wfincrement \
         increment xincrement timestep dts tinterval timeincrement sampletime samplingtime",
    ),
    (
        Meaning::Start,
        "t0 x0 wfstartoffset startoffset tstart timeoffset",
    ),
    (
        Meaning::Begin,
        "starttime wfstarttime begintime triggertime",
    ),
    (
        Meaning::Unit,
        "unit units unitstring yunit yunits yunitlabel unitdescription unitlabel unitname engineeringunit \
         engineeringunits engunits eu uom unitofmeasure unitsymbol physicalunit dimension dimensions einheit \
         einheiten verticalunit verticalunits",
    ),
    (
        Meaning::UnitOfTimes,
        "xunit xunits xunitstring xunitlabel horizontalunit horizontalunits",
    ),
    (
        Meaning::Description,
        "longname description desc title comment label",
    ),
    (Meaning::Factor, "scalefactor"),
    (Meaning::Offset, "addoffset"),
    (Meaning::Unapplied, "cal eu2v pregain unitsi fullscale"),
];

/// Words of the names of scales that no convention defines.
const SCALES: &str = "gain sensitivity calibration calfactor factor scale scaling scaled slope multiplier multiplicator mult offset intercept bias \
     coefficient coefficients coeff coeffs coef conversion conv convfactor lsb resolution amplification attenuation unitsi";
/// Words beside `per` and `to` in the names of scales.
const COUNTS: &str =
    "count counts bit bits volt volts v mv lsb adc raw code codes digit digits unit units eu";
const RATIO: &str = "per to";
/// Words of the names of clocks that no convention defines.
const CLOCKS: &str = "delay latency lag skew drift";
/// Words before a meaning that denote the samples themselves.
const GENERIC: &str = "channel channels ch wf ni data signal sample samples daq adc ai x y the raw measured nominal actual sensor table column columns \
     field value values dataset waveform record measurement test acquisition acq c";

/// Units of a rate, and their factors to Hz.
const RATES: [(&str, f64); 7] = [
    ("", 1.0),
    ("hz", 1.0),
    ("1/s", 1.0),
    ("s/s", 1.0),
    ("sps", 1.0),
    ("khz", 1e3),
    ("mhz", 1e6),
];

/// Factor of a unit of rates to Hz.
pub(super) fn factor_of_rate(unit: &str) -> Option<f64> {
    let small = unit.trim().to_lowercase();
    let found = RATES.iter().find(|(symbol, _)| *symbol == small);
    found.map(|(_, factor)| *factor)
}

/// Factor of a unit of times to s, also with a number as in `1e-4 s`.
pub(super) fn factor_of_time(unit: &str) -> Option<f64> {
    let (number, unit) = crate::units::split_factor(unit);
    Some(number * Unit::recognise(Measurand::Time, unit)?.factor())
}

/// A name, as it is understood.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Name {
    /// The words before the meaning in small letters: `acc` of `acc_unit`.
    pub subject: String,
    pub meaning: Meaning,
    /// Factor of the unit that the name states: 1e3 of `fs_kHz`.
    pub factor: Option<f64>,
}

/// The words of a name in small letters: parted by signs and capitals.
fn words(name: &str) -> Vec<String> {
    let (mut words, mut before) = (vec![String::new()], ' ');
    for c in name.chars() {
        if !c.is_alphanumeric() || c.is_uppercase() && before.is_lowercase() {
            words.push(String::new());
        }
        if let (Some(last), true) = (words.last_mut(), c.is_alphanumeric()) {
            last.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Letters and digits of a name, small.
pub(crate) fn letters(name: &str) -> String {
    words(name).concat()
}

fn has(list: &str, word: &str) -> bool {
    list.split(' ').any(|own| own == word)
}

/// True for words that denote the samples themselves, or none.
pub(super) fn is_generic(subject: &str) -> bool {
    let letters = subject.trim_end_matches(|c: char| c.is_ascii_digit());
    letters.is_empty() || has(GENERIC, letters)
}

fn exact(letters: &str) -> Option<Meaning> {
    let found = NAMES.iter().find(|(_, names)| has(names, letters));
    found.map(|(meaning, _)| *meaning)
}

/// The meaning of a name, if any.
pub(super) fn read(name: &str) -> Option<Name> {
    let parts = words(name);
    let named = |subject: &[String], meaning, factor| Name {
        subject: subject.concat(),
        meaning,
        factor,
    };
    if let Some((subject, meaning)) = known(&parts) {
        return Some(named(subject, meaning, None));
    }
    // `dt_ms`, `fs_kHz`, `sampling_period_us`.
    if let Some((rest, unit)) = name.trim().rsplit_once([' ', '_'])
        && let Some((subject, meaning)) = known(&words(rest))
    {
        let factor = match meaning {
            Meaning::Rate => factor_of_rate(unit),
            Meaning::Interval | Meaning::Start | Meaning::Begin => factor_of_time(unit),
            _ => None,
        };
        if factor.is_some() {
            return Some(named(subject, meaning, factor));
        }
    }
    let is = |i: usize, list: &str| parts.get(i).is_some_and(|word| has(list, word));
    let is_sampling = (0..parts.len()).any(|i| is(i, "sampling sample"));
    let is_smell = |i: usize| {
        let is_ratio = is(i, COUNTS) && is(i + 1, RATIO) || is(i, RATIO) && is(i + 1, COUNTS);
        let is_rate = is_sampling && is(i, "rate interval period frequency");
        is(i, SCALES) || is(i, CLOCKS) || is_ratio || is_rate
    };
    let at = (0..parts.len()).find(|i| is_smell(*i))?;
    Some(named(&parts[..at], Meaning::Unapplied, None))
}

pub(crate) fn meaning(name: &str) -> Option<Meaning> {
    read(name).map(|found| found.meaning)
}

/// The meaning of the last words of a name in the table, and the words before.
fn known(words: &[String]) -> Option<(&[String], Meaning)> {
    let at = (0..words.len()).find(|at| exact(&words[*at..].concat()).is_some())?;
    let (before, rest) = words.split_at(at);
    // `counts_per_unit` is a scale.
    if before.last().is_some_and(|word| has(RATIO, word)) {
        return None;
    }
    let meaning = match (exact(&rest.concat())?, exact(&before.concat())) {
        (Meaning::Unit, Some(Meaning::Rate)) => Meaning::UnitOfRate,
        (Meaning::Unit, Some(Meaning::Interval | Meaning::Start)) => Meaning::UnitOfTimes,
        (Meaning::Unit, _) if before == ["time"] => Meaning::UnitOfTimes,
        (meaning, _) => meaning,
    };
    Some((before, meaning))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_meanings() {
        use Meaning::*;
        for (name, subject, meaning, factor) in [
            ("fs", "", Rate, None),
            ("Sampling Rate", "", Rate, None),
            ("fs_kHz", "", Rate, Some(1e3)),
            ("sample_rate_hz", "", Rate, Some(1.0)),
            ("dt_ms", "", Interval, Some(1e-3)),
            ("sampling_period_us", "", Interval, Some(1e-6)),
            ("Tinterval", "", Interval, None),
            ("dt_unit", "dt", UnitOfTimes, None),
            ("wf_xunit_string", "wf", UnitOfTimes, None),
            ("time_unit", "time", UnitOfTimes, None),
            ("sample_rate_unit", "samplerate", UnitOfRate, None),
            ("acc_unit", "acc", Unit, None),
            ("NI_UnitDescription", "ni", Unit, None),
            ("FIELD_2_UNIT", "field2", Unit, None),
            ("scaleFactor", "", Factor, None),
            ("long_name", "", Description, None),
            ("wf_start_time", "", Begin, None),
        ] {
            let expected = Name {
                subject: subject.to_owned(),
                meaning,
                factor,
            };
            assert_eq!(read(name), Some(expected), "{name}");
        }
        assert_eq!(
            read("acc_sensitivity")
                .map(|found| found.subject)
                .as_deref(),
            Some("acc")
        );
        let scales = "gain cDAQ_gain lsb counts_per_unit volts_to_g bits_to_units conversion coefficients unitSI acc_sensitivity multiplicator factor \
             trigger_delay Resolution";
        for name in scales.split_whitespace() {
            assert_eq!(
                read(name).map(|found| found.meaning),
                Some(Unapplied),
                "{name}"
            );
        }
        for name in [
            "natural_frequency",
            "CLASS",
            "calendar",
            "valid_range",
            "operator",
            "MATLAB_class",
            "t",
            "acc",
        ] {
            assert_eq!(read(name), None, "{name}");
        }
    }
}
