//! Summary of a record: sampling, onset, dominant frequency, outliers, offset and drift, and the size of the
//! excitation.

use super::columns::ColumnAssignment;
use super::roles::{Role, UsedColumn};
use crate::config::dominant::{Oscillation, remove_outliers, values_of};
use crate::config::lowering::known_stretches;
use crate::error::InputError;
use crate::tables::{Duplicates, RepeatedTimes, Table, lines_in_words, repeated_times};
use kmcfit_core::signal::{is_kept_up, jumps, median, onset};
use kmcfit_core::system::round_time;

/// Most lines in a comment.
const LISTED: usize = 10;
/// Fewest samples for a model.
const FEWEST: usize = 8;
/// Relative difference below which spacings are equal up to rounded times.
const REGULAR: f64 = 0.05;

/// Summary of a record.
#[derive(Debug)]
pub struct RecordSummary {
    pub samples: usize,
    pub missing: usize,
    /// Lines that repeat a time with other values, in words.
    pub repeated: Option<String>,
    /// First time used, s.
    pub from: f64,
    /// s.
    pub duration: f64,
    /// Median sampling interval, s.
    pub spacing: f64,
    pub is_regular: bool,
    /// The summarised channel, and the factor of its unit to SI.
    pub channel: (Role, f64),
    /// Number of outliers, and the first one in SI.
    pub outliers: Option<(usize, f64)>,
    /// Onset of the response, s; `None` without an initial rest.
    pub begins: Option<f64>,
    /// First and last time of the longest part without missing values of the input, s; `None` where none is missing.
    pub known: Option<[f64; 2]>,
    /// Dominant frequency, Hz.
    pub frequency: Option<f64>,
    /// True if the samples drift along a straight line.
    pub drifts: bool,
    /// True where no input is measured and a force keeps up the motion.
    pub is_kept_up: bool,
    /// Interpolation of force and base motion between samples.
    pub between: &'static str,
}

impl RecordSummary {
    pub fn of(
        table: &Table,
        columns: &ColumnAssignment,
        codes: &[(f64, usize)],
    ) -> Result<Self, InputError> {
        let (times, repeated) = times(table, columns)?;
        let in_si = |table, column| in_si(table, column, &repeated, codes);
        let channel = |role: Role| columns.find(role);
        let order = [Role::Displacement, Role::Velocity, Role::Acceleration];
        let Some(column) = order.into_iter().find_map(channel) else {
            return Err(InputError::file(table.path(), "no column of a response"));
        };
        let response = in_si(table, column)?;
        let spacings: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        let spacing = median(&*spacings);
        let drives = [Role::Force, Role::BaseAcceleration, Role::BaseDisplacement];
        let input = drives.into_iter().find_map(channel);
        let mut input = input.map(|c| in_si(table, c)).transpose()?;
        let mut part = 0..times.len();
        if let Some(input) = &mut input {
            let longest = known_stretches(input)
                .into_iter()
                .max_by_key(|run| run.len());
            part = longest.unwrap_or(part);
            *input = input[part.clone()].to_vec();
        }
        let known = (part.len() < times.len()).then(|| [times[part.start], times[part.end - 1]]);
        let times = &times[part.clone()];
        let mut pairs = moving(table, times, &response[part])?;
        let missing = times.len() - pairs.len();
        let outliers = remove_outliers(&mut pairs);
        let values = values_of(&pairs);
        // The excitation can set in late as well.
        let begins = match input {
            Some(_) => None,
            None => onset(&values, spacing),
        };
        let pairs = &pairs[begins.unwrap_or(0)..];
        let duration = times[times.len() - 1] - begins.map_or(times[0], |_| pairs[0].0);
        let oscillation = Oscillation::of(pairs, spacing, duration);
        let is_regular = (spacings.iter()).all(|s| (s - spacing).abs() <= REGULAR * spacing);
        Ok(Self {
            between: between(input.as_deref().unwrap_or_default()),
            samples: pairs.len(),
            missing,
            repeated: (!repeated.are_equal).then(|| {
                let lines = repeated.lines(table, LISTED);
                lines_in_words(&lines, repeated.excess())
            }),
            channel: (column.role, column.factor()),
            outliers,
            begins: begins.map(|_| round_time(pairs[0].0, spacing)),
            known,
            from: round_time(begins.map_or(times[0], |_| pairs[0].0), spacing),
            duration,
            spacing,
            is_kept_up: input.is_none() && is_regular && is_kept_up(&values_of(pairs), spacing),
            is_regular,
            frequency: oscillation.frequency,
            drifts: oscillation.drifts,
        })
    }

    /// Number of periods of the dominant frequency in the record.
    pub fn periods(&self) -> f64 {
        self.frequency.unwrap_or(0.0) * self.duration
    }

    pub fn spacing_in_words(&self) -> String {
        let kind = match self.is_regular {
            true => "one every",
            false => "at irregular times, about one every",
        };
        let missing = match self.missing {
            0 => String::new(),
            some => format!(", {some} missing"),
        };
        format!("{kind} {} s{missing}", super::short(self.spacing))
    }
}

/// Samples with their times. Refuses too few samples and constant ones.
fn moving(table: &Table, times: &[f64], values: &[f64]) -> Result<Vec<(f64, f64)>, InputError> {
    let pairs = times.iter().copied().zip(values.iter().copied());
    let pairs: Vec<(f64, f64)> = pairs.filter(|(_, value)| value.is_finite()).collect();
    if pairs.len() < FEWEST {
        return Err(InputError::file(table.path(), "too few samples")
            .found(pairs.len())
            .expected(format!("{FEWEST} or more")));
    }
    let still = pairs[0].1;
    match pairs.iter().all(|(_, x)| *x == still) {
        false => Ok(pairs),
        true => Err(InputError::file(table.path(), "all samples are equal")
            .found(format!("{} samples, all {still}", pairs.len()))
            .expected("a record of a moving system")),
    }
}

/// Interpolation that predicts every second sample of an excitation best from the others.
fn between(input: &[f64]) -> &'static str {
    if !jumps(input).is_empty() {
        return "hold";
    }
    let (mut line, mut cubic) = (0.0, 0.0);
    for x in input.windows(7) {
        let near = 0.5 * (x[2] + x[4]);
        let far = 0.5 * (x[0] + x[6]);
        line += (x[3] - near).powi(2);
        cubic += (x[3] - near - (near - far) / 8.0).powi(2);
    }
    // Ratio of squared errors: less than half the error.
    match cubic < 0.25 * line {
        true => "cubic",
        false => "linear",
    }
}

fn times(
    table: &Table,
    columns: &ColumnAssignment,
) -> Result<(Vec<f64>, RepeatedTimes), InputError> {
    match columns.find(Role::Time) {
        Some(column) => {
            let repeated = repeated_times(table, column.index, Duplicates::First)?;
            let times = repeated.merged(table.values(column.index)?, Duplicates::First);
            let times = times.iter().map(|t| t * column.factor());
            Ok((times.collect(), repeated))
        }
        None => {
            let rate = columns.sample_rate.unwrap_or(1.0);
            let times = (0..table.rows()).map(|i| i as f64 / rate).collect();
            Ok((times, RepeatedTimes::NONE))
        }
    }
}

fn in_si(
    table: &Table,
    column: &UsedColumn,
    repeated: &RepeatedTimes,
    codes: &[(f64, usize)],
) -> Result<Vec<f64>, InputError> {
    let factor = column.factor();
    let samples = repeated.merged(table.samples(column.index)?, Duplicates::First);
    let is_code = |x: f64| codes.iter().any(|(code, _)| *code == x);
    let value = |x: &f64| if is_code(*x) { f64::NAN } else { x * factor };
    Ok(samples.iter().map(value).collect())
}
