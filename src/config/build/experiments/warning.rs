//! Warnings about the data of an experiment.

use crate::finding::Finding;
use crate::number_format::significant;
use serde::Serialize;
use thiserror::Error;

/// A warning about the data of an experiment. Values are in the unit of the column.
#[derive(Debug, Clone, PartialEq, Serialize, Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum DataWarning {
    /// The model and the file state different units of a column.
    #[error("column `{column}`: unit taken from the model ({used}); the file says {stated}")]
    UnitDiffersFromFile {
        column: String,
        used: String,
        stated: String,
    },
    /// The row of units and the name of a column state different units.
    #[error(
        "column `{column}`: unit taken from the file's row of units ({used}); its name ends in {stated}"
    )]
    UnitDiffersFromName {
        column: String,
        used: String,
        stated: String,
    },
    /// The file states a unit that the program cannot convert.
    #[error(
        "the unit `{stated}` of the {quantity} in the column `{column}` is not known: {used} is assumed; state one under `units`"
    )]
    UnknownUnit {
        column: String,
        stated: String,
        quantity: &'static str,
        used: String,
    },
    /// The samples are voltages of a sensor whose sensitivity is not stated.
    #[error(
        "the {} in the column `{column}` is in {unit}: state the sensitivity of its sensor, as in `units: {{{quantity}: \
         10 V/(m/s²)}}`",
        quantity.replace('_', " ")
    )]
    Volts {
        column: String,
        quantity: String,
        unit: String,
    },
    /// The file states a scale by a name that no convention defines.
    #[error(
        "the file states {stated} for the column `{column}`, which is not applied: state what one unit of its numbers is, as in \
         `units: {{{quantity}: 0.1 {unit}}}`"
    )]
    ScaleNotApplied {
        column: String,
        stated: String,
        quantity: String,
        unit: String,
    },
    /// Neither the model nor the file states the unit of a column. A statement beside a result, and no warning.
    #[error("{} in {unit} (column `{column}`)", quantity.replace('_', " "))]
    UnitAssumed {
        column: String,
        quantity: String,
        unit: String,
    },
    /// The name of a column ends in a unit that is not used.
    #[error(
        "column `{column}`: {used} is assumed, although its name ends in {stated}; add `units: {{{name}: {stated}}}` if it is \
         in {stated}"
    )]
    UnitOfNameUnused {
        column: String,
        name: String,
        used: String,
        stated: String,
    },
    /// A column of standard deviations states another unit than its samples.
    #[error("column `{column}`: unit taken from the samples ({used}); the file says {stated}")]
    SigmaUnitDiffers {
        column: String,
        used: String,
        stated: String,
    },
    /// Two channels, or a channel and the initial state, disagree by the factor between two units.
    #[error("{quantity} is {} times its expected value, {factor}; check `units`", significant(*ratio, 4))]
    SuspiciousFactor {
        quantity: String,
        ratio: f64,
        factor: &'static str,
    },
    /// The magnitudes of a record are outside the range of mechanical vibrations.
    #[error("{magnitudes} is implausible{}; check `units`",
        reading.as_ref().map(|reading| format!(": {reading}")).unwrap_or_default()
    )]
    ImplausibleMagnitudes {
        magnitudes: String,
        reading: Option<String>,
    },
    /// A narrow line that is mains hum in another unit of time.
    #[error(
        "the {channel} has a narrow line at {} Hz: mains hum, if the times are in {unit}; check `units: {{time: {unit}}}`",
        significant(*frequency, 3)
    )]
    MainsHum {
        channel: &'static str,
        frequency: f64,
        unit: String,
    },
    /// The force and the response imply another mass than the stated one, by the factor between two units.
    #[error(
        "the force and the {channel} imply a mass of {} kg, {} times the stated one, {factor}; check `units` and the mass",
        significant(*implied, 3),
        significant(*ratio, 3)
    )]
    SuspiciousMass {
        channel: &'static str,
        implied: f64,
        ratio: f64,
        factor: &'static str,
    },
    /// Two channels of one response have opposite signs.
    #[error(
        "{high} and {low} have opposite signs; if the {high} is reversed, add `sensors: {{{high}: {{gain: -1}}}}`"
    )]
    OppositeSign {
        high: &'static str,
        low: &'static str,
    },
    /// A free record at rest before its motion begins.
    #[error(
        "the {channel} is at rest before {start} s; a free decay must begin after the release or impact: `window: {{min: \
         {start}}}`"
    )]
    AtRest { channel: &'static str, start: f64 },
    /// A response that a random force keeps up, without a measured input.
    #[error(
        "no force is measured, and the {channel} does not decay: an unmeasured force acts, with which neither a free response nor the \
         equation error determines the damping; `fit: {{method: equation-error}}` gives the natural frequency"
    )]
    UnmeasuredForce { channel: &'static str },
    /// Two modes in a free response.
    #[error(
        "two modes vibrate in the {channel}, at {} and {} Hz; the model has one; keep one by `band`, or measure at a node of the \
         other",
        significant(frequencies[0], 3),
        significant(frequencies[1], 3)
    )]
    TwoModes {
        channel: &'static str,
        /// The stronger one first, Hz.
        frequencies: [f64; 2],
    },
    /// A constraint excludes the frequency at which the record vibrates.
    #[error(
        "the {channel} vibrates at {} Hz, which the constraint on the natural frequency ({}) excludes",
        significant(*frequency, 3),
        range_in_words(*min, *max)
    )]
    FrequencyExcluded {
        channel: &'static str,
        frequency: f64,
        min: Option<f64>,
        max: Option<f64>,
    },
    /// Values that stand for missing samples.
    #[error(
        "the {} holds the value {} far outside the others, which stands for a missing sample: `missing: {}`",
        channels.join(" and the "),
        codes.iter().map(|code| format!("{code:?}")).collect::<Vec<_>>().join(" and "),
        serde_json::json!(codes)
    )]
    MissingCodes {
        /// Names of the columns by their quantity.
        channels: Vec<String>,
        codes: Vec<f64>,
    },
    /// Outliers under a quadratic loss.
    #[error(
        "{samples} outlier{} in the {channel}, the first {} {unit} at {first_time} s; delete {} (empty fields) or use a \
         robust loss (`loss: {{{channel}: huber}}`{})",
        if *samples == 1 { "" } else { "s" },
        significant(*first_value, 4),
        if *samples == 1 { "it" } else { "them" },
        if *has_sigma { "" } else { ", with `sigma`" },
    )]
    Outliers {
        channel: &'static str,
        samples: usize,
        first_value: f64,
        first_time: f64,
        unit: String,
        #[serde(skip)]
        has_sigma: bool,
    },
    /// Many samples at the end of the range.
    #[error(
        "{samples} samples of the {channel} equal its extreme value {} {unit}; if the sensor saturates there, {}",
        significant(*level, 4),
        if *is_input {
            "keep a part without them by `window`"
        } else {
            "leave them out: `exclude: [saturation]`"
        }
    )]
    Saturation {
        channel: String,
        samples: usize,
        level: f64,
        unit: String,
        #[serde(skip)]
        is_input: bool,
    },
    /// Samples held at a constant value.
    #[error(
        "{samples} samples of the {channel} are held at a constant value, from {} to {} s at first, as by a dropout; {}",
        significant(first[0], 6),
        significant(first[1], 6),
        if *is_input {
            "keep a part without them by `window`"
        } else {
            "leave them out: `exclude: [dropouts]`"
        }
    )]
    Dropouts {
        channel: String,
        samples: usize,
        first: [f64; 2],
        #[serde(skip)]
        is_input: bool,
    },
    /// Single samples far from their neighbours.
    #[error(
        "{} of the {channel} {} far from the neighbours, the first at {} s; {}",
        if *samples == 1 { "1 sample".to_owned() } else { format!("{samples} samples") },
        if *samples == 1 { "is" } else { "are" },
        significant(*first, 6),
        if *is_input {
            "correct the file, or keep a part without spikes by `window`"
        } else {
            "leave spikes out: `exclude: [spikes]`"
        }
    )]
    Spikes {
        channel: String,
        samples: usize,
        first: f64,
        #[serde(skip)]
        is_input: bool,
    },
    /// A record with the samples of another one: the intervals count them twice.
    #[error(
        "{experiment} has the samples of {other}: listed twice, they narrow the intervals without further information; remove one"
    )]
    RepeatedRecord { experiment: String, other: String },
    /// Gaps in the samples of an input.
    #[error(
        "the {channel} has {}, across which it is interpolated, the longest from {} to {} s; keep a part without them by \
         `window`",
        if *count == 1 { "a gap".to_owned() } else { format!("{count} gaps") },
        significant(longest[0], 6),
        significant(longest[1], 6)
    )]
    InputGaps {
        channel: String,
        count: usize,
        longest: [f64; 2],
    },
}

/// A range of frequencies in words.
fn range_in_words(min: Option<f64>, max: Option<f64>) -> String {
    match (min, max) {
        (Some(min), Some(max)) => format!("{min} to {max} Hz"),
        (Some(min), None) => format!("at least {min} Hz"),
        (None, Some(max)) => format!("at most {max} Hz"),
        (None, None) => "any".to_owned(),
    }
}

impl DataWarning {
    /// Kind of [`DataWarning::UnitAssumed`].
    pub const UNIT_ASSUMED: &str = "unit_assumed";
    /// Kinds of the warnings on what a file states of units and scales.
    pub const STATED_UNITS: [&str; 4] = [
        "scale_not_applied",
        "unknown_unit",
        "unit_of_name_unused",
        "volts",
    ];
    /// Kinds of the warnings that show a wrong unit by the samples.
    pub const DOUBTFUL_UNITS: [&str; 4] = [
        "implausible_magnitudes",
        "mains_hum",
        "suspicious_factor",
        "suspicious_mass",
    ];

    /// The warning as a finding about a key or an experiment of the model file.
    pub fn at(&self, place: &str) -> Finding {
        Finding::of(self, format!("{place}: {self}")).with("place", place)
    }
}
